"""Vectors of R^d as tuples, of numbers or of SIMD vectors, and bivectors, inside kernels.

Sums, multiples and scalar products are those of tuples of any length, a tuple of tuples being a matrix by rows. The
wedge product a ^ b has d (d - 1)/2 components: one number in the plane, the cross product in space.

Each is written once, as a formula on tuples of `_Number`. It is evaluated twice while a kernel is compiled: with types
alone, for the type of the result, and with the numbers of the kernel, for the instructions. As functions for Numba to
compile, of which a kernel of an element would have a hundred, they took a third of its time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

from numba import types
from numba.extending import intrinsic

from shoal.compile.simd import FLAGS, Vector, spread_value


class _Number:
    """A number or a SIMD vector in a formula, whose operators append instructions; without a builder its type alone."""

    def __init__(self, builder: Any, kind: Any, value: Any) -> None:
        self._builder, self.kind, self.value = builder, kind, value

    def __add__(self, other: _Number) -> _Number:
        return self._combined("fadd", other)

    def __sub__(self, other: _Number) -> _Number:
        return self._combined("fsub", other)

    def __mul__(self, other: _Number) -> _Number:
        return self._combined("fmul", other)

    def __neg__(self) -> _Number:
        return _Number(self._builder, self.kind, self._builder and self._builder.fneg(self.value))

    def _combined(self, instruction: str, other: _Number) -> _Number:
        kind = self.kind if isinstance(self.kind, Vector) else other.kind
        if self._builder is None:
            return _Number(None, kind, None)
        if not isinstance(kind, Vector):
            return _Number(self._builder, kind, getattr(self._builder, instruction)(self.value, other.value))
        values = [
            one.value if isinstance(one.kind, Vector) else spread_value(self._builder, one.value, kind.count)
            for one in (self, other)
        ]
        return _Number(self._builder, kind, getattr(self._builder, instruction)(*values, flags=FLAGS))


Formula = Callable[..., Any]
"""Of nested tuples of `_Number` to one of them or to nested tuples."""


def _instructions(formula: Formula, *arguments: Any) -> Any:
    """Return the typed signature of a formula and the function that makes its instructions, as an intrinsic does."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        parts = [_unpacked(builder, kind, value) for kind, value in zip(signature.args, values, strict=True)]
        return _packed(context, builder, formula(*parts))[1]

    result, _ = _packed(None, None, formula(*(_unpacked(None, kind, None) for kind in arguments)))
    return result(*arguments), generate


def _unpacked(builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        values = [builder and builder.extract_value(value, k) for k in range(len(kind.types))]
        return tuple(_unpacked(builder, part, one) for part, one in zip(kind.types, values, strict=True))
    if not isinstance(kind, Vector | types.Float):
        raise TypeError(f"tuples of numbers or vectors, not of {kind}")
    return _Number(builder, kind, value)


def _packed(context: Any, builder: Any, found: Any) -> tuple[Any, Any]:
    """Return the type of a result and its value, which is None without a builder."""
    if isinstance(found, _Number):
        return found.kind, found.value
    parts = [_packed(context, builder, one) for one in found]
    kind = types.BaseTuple.from_types([part for part, _ in parts])
    return kind, builder and context.make_tuple(builder, kind, [value for _, value in parts])


def _add(a: Any, b: Any) -> Any:
    return tuple(map(_add, a, b)) if isinstance(a, tuple) else a + b


def _subtract(a: Any, b: Any) -> Any:
    return tuple(map(_subtract, a, b)) if isinstance(a, tuple) else a - b


def _scale(k: _Number, a: Any) -> Any:
    return tuple(_scale(k, one) for one in a) if isinstance(a, tuple) else k * a


@intrinsic
def dot(typing_context, a, b):  # type: ignore[no-untyped-def]
    """a . b."""
    return _instructions(lambda a, b: reduce(_Number.__add__, map(_Number.__mul__, a, b)), a, b)


@intrinsic
def times(typing_context, k, a):  # type: ignore[no-untyped-def]
    """k a."""
    return _instructions(_scale, k, a)


@intrinsic
def plus(typing_context, a, k, b):  # type: ignore[no-untyped-def]
    """a + k b."""
    return _instructions(lambda a, k, b: _add(a, _scale(k, b)), a, k, b)


@intrinsic
def minus(typing_context, a, b):  # type: ignore[no-untyped-def]
    """a - b."""
    return _instructions(_subtract, a, b)


@intrinsic
def wedge(typing_context, a, b):  # type: ignore[no-untyped-def]
    """a ^ b, the bivector of two vectors."""

    def formula(a: Any, b: Any) -> Any:
        pairs = [(0, 1)] if len(a) == 2 else [(1, 2), (2, 0), (0, 1)]
        return tuple(a[i] * b[j] - a[j] * b[i] for i, j in pairs)

    return _instructions(formula, a, b)


@intrinsic
def facing(typing_context, b, m):  # type: ignore[no-untyped-def]
    """The derivative of m . (a ^ b) by a, of a bivector m; the derivative by b is that by a with -a in place of b."""

    def formula(b: Any, m: Any) -> Any:
        if len(b) == 2:
            return b[1] * m[0], -b[0] * m[0]
        return b[1] * m[2] - b[2] * m[1], b[2] * m[0] - b[0] * m[2], b[0] * m[1] - b[1] * m[0]

    return _instructions(formula, b, m)


@intrinsic
def outer(typing_context, a, b):  # type: ignore[no-untyped-def]
    """The matrix a b'."""
    return _instructions(lambda a, b: tuple(_scale(one, b) for one in a), a, b)


@intrinsic
def plus_identity(typing_context, a, k):  # type: ignore[no-untyped-def]
    """a + k 1, of a matrix a."""

    def formula(a: Any, k: Any) -> Any:
        return tuple(tuple(one + k if i == j else one for j, one in enumerate(row)) for i, row in enumerate(a))

    return _instructions(formula, a, k)


@intrinsic
def plus_skew(typing_context, a, m):  # type: ignore[no-untyped-def]
    """The matrix a plus m . (e_i ^ e_j), of a bivector m."""

    def formula(a: Any, m: Any) -> Any:
        if len(a) == 2:
            return (a[0][0], a[0][1] + m[0]), (a[1][0] - m[0], a[1][1])
        return (
            (a[0][0], a[0][1] + m[2], a[0][2] - m[1]),
            (a[1][0] - m[2], a[1][1], a[1][2] + m[0]),
            (a[2][0] + m[1], a[2][1] - m[0], a[2][2]),
        )

    return _instructions(formula, a, m)
