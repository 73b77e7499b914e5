"""Arcs, sines and cosines of SIMD vectors, which have no functions beyond `+ - * /` and the root, by their series."""

from __future__ import annotations

from math import factorial

import numpy as np
from numba import njit

from shoal.compile.simd import inverse_root, reciprocal

COSINE = np.array([1.0 / factorial(2 * n) for n in range(11)])
SINE = np.array([1.0 / factorial(2 * n + 1) for n in range(11)])
"""Terms of the series: those left out are below the last digit up to a right angle and more."""


@njit(error_model="numpy", forceinline=True)
def arctangent(r):  # type: ignore[no-untyped-def]
    """The angle whose tangent is r, |r| <= 1: halved three times, then by its series."""
    for _ in range(3):
        square = 1.0 + r * r
        r = r * reciprocal(1.0 + square * inverse_root(square))
    s, v = r * r, 0.0 * r
    for n in range(10, -1, -1):
        v = 1.0 / (2.0 * n + 1.0) - s * v
    return 8.0 * r * v


@njit(error_model="numpy", forceinline=True)
def turn(a):  # type: ignore[no-untyped-def]
    """Sine and cosine of an angle up to a right one or so."""
    s, sine, cosine = a * a, 0.0 * a, 0.0 * a
    for n in range(len(COSINE) - 1, -1, -1):
        sine, cosine = SINE[n] - s * sine, COSINE[n] - s * cosine
    return a * sine, cosine
