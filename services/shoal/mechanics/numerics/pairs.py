"""Vectors of the plane as pairs, of numbers or of SIMD vectors, inside kernels."""

from __future__ import annotations

from numba import njit


@njit(error_model="numpy", forceinline=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """a . b."""
    return a[0] * b[0] + a[1] * b[1]


@njit(error_model="numpy", forceinline=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """a x b."""
    return a[0] * b[1] - a[1] * b[0]


@njit(error_model="numpy", forceinline=True)
def quarter(a):  # type: ignore[no-untyped-def]
    """a turned by a right angle, counter-clockwise."""
    return -a[1], a[0]


@njit(error_model="numpy", forceinline=True)
def times(k, a):  # type: ignore[no-untyped-def]
    """k a."""
    return k * a[0], k * a[1]


@njit(error_model="numpy", forceinline=True)
def plus(a, k, b):  # type: ignore[no-untyped-def]
    """a + k b."""
    return a[0] + k * b[0], a[1] + k * b[1]
