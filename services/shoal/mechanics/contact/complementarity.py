"""Convex complementarity problem p >= 0, G p + c >= 0, p'(G p + c) = 0, the dual of a least deviation.

G is symmetric and not negative; where contacts depend on each other the forces are not unique, G p is. The active set
method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23) on the normal equations.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.numerics.tile import Array

DEPENDENT = 1e-12
"""Pivot, over its diagonal entry, below which a contact depends on others: its force is zero."""
ROUND_OFF = 1e-13
"""Violation, over the largest load, that is none."""


@njit(cache=True, error_model="numpy")
def solve(n: int, matrix: Array, load: Array, active: Array, out: Array) -> None:
    """Solve G p = -c for the active contacts, with p = 0 of the others; matrix: (n, n) in rows. Arrays or pointers."""
    factor = np.zeros((n, n))
    for i in range(n):
        out[i] = -load[i] if active[i] > 0.0 else 0.0
        for j in range(i + 1):
            if active[i] > 0.0 and active[j] > 0.0:
                total = matrix[i * n + j]
                for k in range(j):
                    total -= factor[i, k] * factor[j, k]
                if i > j:
                    factor[i, j] = total / factor[j, j] if factor[j, j] > 0.0 else 0.0
                else:
                    factor[i, i] = np.sqrt(total) if total > DEPENDENT * matrix[i * n + i] else 0.0
        for k in range(i):
            out[i] -= factor[i, k] * out[k]
        out[i] = out[i] / factor[i, i] if factor[i, i] > 0.0 else 0.0
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            out[i] -= factor[k, i] * out[k]
        out[i] = out[i] / factor[i, i] if factor[i, i] > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def complementary(n: int, matrix: Array, load: Array, touches: Array, out: Array) -> None:
    """Find p into out, (n,); matrix: G, (n, n) in rows, load: c, touches: not zero of forces that may be, (n,).

    Arrays or pointers.
    """
    active, trial, size = np.zeros(n), np.zeros(n), 0.0
    for i in range(n):
        out[i] = 0.0
        size = max(size, abs(load[i]))
    for _ in range(3 * n + 3):
        most, chosen = -ROUND_OFF * size, -1
        for i in range(n):
            slope = load[i]
            for j in range(n):
                slope += matrix[i * n + j] * out[j]
            if touches[i] != 0.0 and active[i] == 0.0 and slope < most:
                most, chosen = slope, i
        if chosen < 0:
            return
        active[chosen] = 1.0
        for _ in range(n + 1):
            solve(n, matrix, load, active, trial)
            part, leaving = 1.0, -1
            for i in range(n):
                if active[i] > 0.0 and trial[i] <= 0.0 and out[i] - trial[i] > 0.0:
                    share = out[i] / (out[i] - trial[i])
                    if share < part:
                        part, leaving = share, i
            for i in range(n):
                out[i] += part * (trial[i] - out[i])
            if leaving < 0:
                break
            out[leaving], active[leaving] = 0.0, 0.0
