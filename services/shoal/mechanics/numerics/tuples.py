"""Vectors of R^d as tuples, of numbers or of SIMD vectors, and bivectors, inside kernels.

Sums, multiples and scalar products are those of tuples of any length, by recursion when a kernel is compiled.
The wedge product a ^ b has d (d - 1)/2 components: one number in the plane, the cross product in space. Matrices are
tuples of rows.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import overload

_INLINE = {"error_model": "numpy", "forceinline": True}


def dot(a: Any, b: Any) -> Any:
    """a . b."""
    raise NotImplementedError


def times(k: Any, a: Any) -> Any:
    """k a."""
    raise NotImplementedError


def plus(a: Any, k: Any, b: Any) -> Any:
    """a + k b."""
    raise NotImplementedError


def minus(a: Any, b: Any) -> Any:
    """a - b."""
    raise NotImplementedError


def wedge(a: Any, b: Any) -> Any:
    """a ^ b, the bivector of two vectors."""
    raise NotImplementedError


def facing(b: Any, m: Any) -> Any:
    """The derivative of m . (a ^ b) by a, of a bivector m; the derivative by b is that by a with -a in place of b."""
    raise NotImplementedError


def outer(a: Any, b: Any) -> Any:
    """The matrix a b'."""
    raise NotImplementedError


def plus_identity(a: Any, k: Any) -> Any:
    """a + k 1, of a matrix a."""
    raise NotImplementedError


def plus_skew(a: Any, m: Any) -> Any:
    """The matrix a plus m . (e_i ^ e_j), of a bivector m."""
    raise NotImplementedError


@overload(dot, jit_options=_INLINE)
def _dot(a, b):  # type: ignore[no-untyped-def]
    if len(a) == 1:
        return lambda a, b: a[0] * b[0]
    return lambda a, b: dot(a[:-1], b[:-1]) + a[-1] * b[-1]


@overload(times, jit_options=_INLINE)
def _times(k, a):  # type: ignore[no-untyped-def]
    if len(a) == 1:
        return lambda k, a: (k * a[0],)
    return lambda k, a: (k * a[0], *times(k, a[1:]))


@overload(plus, jit_options=_INLINE)
def _plus(a, k, b):  # type: ignore[no-untyped-def]
    if not isinstance(a, types.BaseTuple):
        return lambda a, k, b: a + k * b
    if len(a) == 1:
        return lambda a, k, b: (plus(a[0], k, b[0]),)
    return lambda a, k, b: (plus(a[0], k, b[0]), *plus(a[1:], k, b[1:]))


@overload(minus, jit_options=_INLINE)
def _minus(a, b):  # type: ignore[no-untyped-def]
    if not isinstance(a, types.BaseTuple):
        return lambda a, b: a - b
    if len(a) == 1:
        return lambda a, b: (minus(a[0], b[0]),)
    return lambda a, b: (minus(a[0], b[0]), *minus(a[1:], b[1:]))


@overload(wedge, jit_options=_INLINE)
def _wedge(a, b):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda a, b: (a[0] * b[1] - a[1] * b[0],)
    return lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@overload(facing, jit_options=_INLINE)
def _facing(b, m):  # type: ignore[no-untyped-def]
    if len(b) == 2:
        return lambda b, m: (b[1] * m[0], -b[0] * m[0])
    return lambda b, m: (b[1] * m[2] - b[2] * m[1], b[2] * m[0] - b[0] * m[2], b[0] * m[1] - b[1] * m[0])


@overload(outer, jit_options=_INLINE)
def _outer(a, b):  # type: ignore[no-untyped-def]
    if len(a) == 1:
        return lambda a, b: (times(a[0], b),)
    return lambda a, b: (times(a[0], b), *outer(a[1:], b))


@overload(plus_identity, jit_options=_INLINE)
def _plus_identity(a, k):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda a, k: ((a[0][0] + k, a[0][1]), (a[1][0], a[1][1] + k))
    return lambda a, k: (
        (a[0][0] + k, a[0][1], a[0][2]),
        (a[1][0], a[1][1] + k, a[1][2]),
        (a[2][0], a[2][1], a[2][2] + k),
    )


@overload(plus_skew, jit_options=_INLINE)
def _plus_skew(a, m):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda a, m: ((a[0][0], a[0][1] + m[0]), (a[1][0] - m[0], a[1][1]))
    return lambda a, m: (
        (a[0][0], a[0][1] + m[2], a[0][2] - m[1]),
        (a[1][0] - m[2], a[1][1], a[1][2] + m[0]),
        (a[2][0] + m[1], a[2][1] - m[0], a[2][2]),
    )
