"""The arcs of small angles, for numbers and SIMD vectors, which have no functions beyond `+ - * /` and the root."""

from __future__ import annotations

from numba import njit

from shoal.mechanics.numerics.simd import root


@njit(error_model="numpy", forceinline=True)
def arctangent(r):  # type: ignore[no-untyped-def]
    """The angle whose tangent is r, |r| <= 1: halved three times, then by its series."""
    for _ in range(3):
        r = r / (1.0 + root(1.0 + r * r))
    s, v = r * r, 0.0 * r
    for n in range(10, -1, -1):
        v = 1.0 / (2.0 * n + 1.0) - s * v
    return 8.0 * r * v
