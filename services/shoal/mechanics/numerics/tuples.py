"""Vectors of the plane or of space as pairs or triples, of numbers or of SIMD vectors, inside kernels."""

from __future__ import annotations

from typing import Any

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


@overload(dot, jit_options=_INLINE)
def _dot(a, b):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda a, b: a[0] * b[0] + a[1] * b[1]
    return lambda a, b: a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@overload(times, jit_options=_INLINE)
def _times(k, a):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda k, a: (k * a[0], k * a[1])
    return lambda k, a: (k * a[0], k * a[1], k * a[2])


@overload(plus, jit_options=_INLINE)
def _plus(a, k, b):  # type: ignore[no-untyped-def]
    if len(a) == 2:
        return lambda a, k, b: (a[0] + k * b[0], a[1] + k * b[1])
    return lambda a, k, b: (a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2])
