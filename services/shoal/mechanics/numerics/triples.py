"""Operations of spatial vectors, in addition to `tuples`."""

from __future__ import annotations

from numba import njit

from shoal.mechanics.numerics.tuples import dot, plus, times


@njit(error_model="numpy", forceinline=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def across(a, t, inverse):  # type: ignore[no-untyped-def]
    """The derivative by s of what has the derivative a by t = s/|s|; inverse: 1/|s|."""
    return times(inverse, plus(a, -dot(a, t), t))
