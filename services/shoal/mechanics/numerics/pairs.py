"""Operations of planar vectors, in addition to `tuples`."""

from __future__ import annotations

from numba import njit


@njit(error_model="numpy", forceinline=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def quarter(a):  # type: ignore[no-untyped-def]
    """a turned by a right angle, counter-clockwise."""
    return -a[1], a[0]
