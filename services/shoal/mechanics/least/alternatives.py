"""Other ways to the acceleration of least constraint, kept to compare with: they agree where C_q has full rank.

In y = D^1/2 L' a the problem is min |y - y_f|^2 / 2 subject to W y = target. `kkt` solves for the multipliers without
looking at the rank; the augmented Lagrangian (Bayo, Garcia de Jalon and Serna 1988) and the proximal point method
(Rockafellar 1976) iterate with a regularised matrix and stay solvable where it is singular, but like any minimiser
they miss the motion's limit there.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.least.projection import dot
from shoal.mechanics.numerics.tile import Array

KKT = 1
AUGMENTED = 2
PROXIMAL = 3
ITERATIONS = 50
PENALTY = 1e7
"""Of the augmented Lagrangian, for rows of unit length."""
PROXIMITY = 1e-6


@njit(cache=True, error_model="numpy")
def prepare(method: int, rows: Array, matrix: Array, scale: Array) -> None:
    """Bring rows to unit length by their scale, and factor the matrix of a method, (constraints, constraints)."""
    count, n = rows.shape
    for k in range(count):
        length = np.sqrt(dot(rows[k], rows[k]))
        scale[k] = 1.0 / length if length > 0.0 else 0.0
        for i in range(n):
            rows[k, i] *= scale[k]
    shift = 0.0
    if method == AUGMENTED:
        shift = 1.0 / PENALTY
    elif method == PROXIMAL:
        shift = PROXIMITY
    for i in range(count):
        for j in range(count):
            matrix[i, j] = dot(rows[i], rows[j])
        matrix[i, i] += shift
    _cholesky(matrix)


@njit(cache=True, error_model="numpy")
def correct(method: int, rows: Array, target: Array, matrix: Array, scale: Array, multiplier: Array, y: Array) -> None:
    """Move y to W y = target by one of the methods, for which all is prepared; adds to the multipliers of its rows."""
    count, n = rows.shape
    step = np.zeros(count)
    for _ in range(1 if method == KKT else ITERATIONS):
        largest = 0.0
        for k in range(count):
            step[k] = dot(rows[k], y) - scale[k] * target[k]
            largest = max(largest, abs(step[k]))
        if not largest > 1e-15:
            break
        _substitute(matrix, step)
        for k in range(count):
            multiplier[k] += step[k]
            for i in range(n):
                y[i] -= step[k] * rows[k, i]


@njit(cache=True, error_model="numpy")
def _cholesky(a: Array) -> None:
    """Replace a symmetric matrix by its Cholesky factor (lower); nan where it is not positive."""
    count = a.shape[0]
    for k in range(count):
        a[k, k] = np.sqrt(a[k, k])
        for i in range(k + 1, count):
            a[i, k] /= a[k, k]
        for i in range(k + 1, count):
            for j in range(k + 1, i + 1):
                a[i, j] -= a[i, k] * a[j, k]


@njit(cache=True, error_model="numpy")
def _substitute(a: Array, x: Array) -> None:
    count = a.shape[0]
    for i in range(count):
        for j in range(i):
            x[i] -= a[i, j] * x[j]
        x[i] /= a[i, i]
    for i in range(count - 1, -1, -1):
        for j in range(i + 1, count):
            x[i] -= a[j, i] * x[j]
        x[i] /= a[i, i]
