"""Constraints in implicit steps: the same saddle point problem with a tangent H in place of M."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.vector import clear, copy, subtract_product
from shoal.mechanics import constraints
from shoal.mechanics.derived import derive
from shoal.mechanics.least.work import GaussWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile


@njit(cache=True, error_model="numpy")
def prepare(tile: Tile, m: Arrays, factor: Array, pattern: sparse.Pattern, q: Array, w: GaussWork) -> None:
    """Evaluate C_q, H^-1 C_q' and C_q H^-1 C_q' at q for the factored matrix H."""
    derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
    n = m.unknowns
    c = m.constraints
    constraints.jacobian(tile, c, q, 1.0, w.jacobian)
    for row in range(c.size * n):
        clear(tile, w.response, row)
    for k in range(c.size):
        for e in range(c.entry[k], c.entry[k + 1]):
            copy(tile, w.response, k * n + c.column[e], w.jacobian, e)
        sparse.solve(tile, pattern, factor, w.response, k * n)
    width = len(tile)
    for i in range(c.size):
        for j in range(c.size):
            clear(tile, w.gram, i * c.size + j)
            for e in range(c.entry[i], c.entry[i + 1]):
                for lane in range(width):
                    w.gram[(i * c.size + j) * width + lane] += (
                        w.jacobian[e * width + lane] * w.response[(j * n + c.column[e]) * width + lane]
                    )


@njit(cache=True, error_model="numpy")
def add_rates(tile: Tile, m: Arrays, w: GaussWork, x: Array) -> None:
    """gap += C_q x."""
    constraints.add_product(tile, m.constraints, w.jacobian, x, w.gap)


@njit(cache=True, error_model="numpy")
def apply(tile: Tile, m: Arrays, w: GaussWork, tolerance: float, x: Array) -> None:
    """x -= H^-1 C_q' lambda with (C_q H^-1 C_q') lambda = gap; lambda is left in w.multiplier."""
    width = len(tile)
    n = m.unknowns
    count = m.constraints.size
    for lane in range(width):
        _solve_semidefinite(count, width, lane, w.gram, w.gap, w.multiplier, max(tolerance**2, 1e-13))
    for k in range(count):
        for i in range(n):
            subtract_product(tile, x, i, w.response, k * n + i, w.multiplier, k)


@njit(cache=True, error_model="numpy")
def _solve_semidefinite(
    count: int, width: int, lane: int, gram: Array, gap: Array, solution: Array, tolerance: float
) -> None:
    """Pivoted Cholesky of one lane; directions whose pivot falls below the tolerance are left out.

    The diagonal is scaled to one first, so that the mass of one body says nothing about the rank of another's rows.
    """
    if count == 1:
        solution[lane] = gap[lane] / gram[lane] if gram[lane] > 0 else 0.0
        return
    a = np.empty((count, count))
    b = np.empty(count)
    order = np.arange(count)
    scale = np.empty(count)
    for i in range(count):
        diagonal = gram[(i * count + i) * width + lane]
        scale[i] = 1.0 / np.sqrt(diagonal) if diagonal > 0 else 0.0
    for i in range(count):
        b[i] = scale[i] * gap[i * width + lane]
        for j in range(count):
            a[i, j] = scale[i] * scale[j] * gram[(i * count + j) * width + lane]
    rank = 0
    for k in range(count):
        pivot = k
        for i in range(k + 1, count):
            if a[i, i] > a[pivot, pivot]:
                pivot = i
        if not a[pivot, pivot] > tolerance:
            break
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            b[k], b[pivot] = b[pivot], b[k]
            for i in range(count):
                a[k, i], a[pivot, i] = a[pivot, i], a[k, i]
            for i in range(count):
                a[i, k], a[i, pivot] = a[i, pivot], a[i, k]
        for i in range(k + 1, count):
            ratio = a[i, k] / a[k, k]
            for j in range(k + 1, count):
                a[i, j] -= ratio * a[k, j]
            b[i] -= ratio * b[k]
        rank += 1
    for k in range(count):
        solution[order[k] * width + lane] = 0.0
    for k in range(rank - 1, -1, -1):
        total = b[k]
        for j in range(k + 1, rank):
            total -= a[k, j] * solution[order[j] * width + lane]
        solution[order[k] * width + lane] = total / a[k, k]
    for k in range(count):
        solution[k * width + lane] *= scale[k]
