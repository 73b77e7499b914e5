"""Vectors of space as triples, of numbers or of SIMD vectors, inside kernels."""

from __future__ import annotations

from numba import njit


@njit(error_model="numpy", forceinline=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(error_model="numpy", forceinline=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def times(k, a):  # type: ignore[no-untyped-def]
    """k a."""
    return k * a[0], k * a[1], k * a[2]


@njit(error_model="numpy", forceinline=True)
def plus(a, k, b):  # type: ignore[no-untyped-def]
    """a + k b."""
    return a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]


@njit(error_model="numpy", forceinline=True)
def across(a, t, inverse):  # type: ignore[no-untyped-def]
    """The derivative by s of what has the derivative a by t = s/|s|; inverse: 1/|s|."""
    return times(inverse, plus(a, -dot(a, t), t))
