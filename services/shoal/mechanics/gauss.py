"""Gauss's principle of least constraint, and the removal of drift, both in the metric of the mass matrix.

The true acceleration minimises 1/2 (M a - Q)' M^-1 (M a - Q) subject to C_q a = -eta (paper, eq. 16).
With the free acceleration a_f = M^-1 Q the minimiser is the least-norm correction
a = a_f - M^-1 C_q' (C_q M^-1 C_q')^+ (C_q a_f + eta). The small matrix is factored with pivoting and a
rank tolerance, so redundant constraints do no harm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import constraints, sparse
from shoal.mechanics.model import Arrays
from shoal.mechanics.tile import Array, Tile
from shoal.mechanics.vector import add_product, clear, copy, pointer, subtract_product


class GaussWork(NamedTuple):
    """Work space: C_q and M^-1 C_q' (constraints * unknowns, lanes), their product, right-hand sides."""

    jacobian: Array
    response: Array
    gram: Array
    multiplier: Array
    gap: Array


def work_space(width: int, m: Arrays) -> GaussWork:
    """Room for the constraints of a model."""
    count, n = m.constraints.size, m.unknowns
    sizes = (count * n, count * n, count * count, count, count)
    return GaussWork(*(np.zeros(size * width) for size in sizes))


@njit(cache=True, error_model="numpy")
def raw(w: GaussWork) -> GaussWork:
    """The same room as pointers."""
    return GaussWork(pointer(w.jacobian), pointer(w.response), pointer(w.gram), pointer(w.multiplier), pointer(w.gap))


@njit(cache=True, error_model="numpy")
def prepare(tile: Tile, m: Arrays, factor: Array, pattern: sparse.Pattern, q: Array, w: GaussWork) -> None:
    """Evaluate C_q, H^-1 C_q' and C_q H^-1 C_q' at q for the factored matrix H (M, or a tangent)."""
    n = m.unknowns
    count = m.constraints.size
    constraints.jacobian(tile, m.constraints, n, q, w.jacobian)
    for row in range(count * n):
        copy(tile, w.response, row, w.jacobian, row)
    for k in range(count):
        sparse.solve(tile, pattern, factor, w.response, k * n)
    for i in range(count):
        for j in range(count):
            clear(tile, w.gram, i * count + j)
            for k in range(n):
                add_product(tile, w.gram, i * count + j, w.jacobian, i * n + k, w.response, j * n + k)


@njit(cache=True, error_model="numpy")
def apply(tile: Tile, m: Arrays, w: GaussWork, tolerance: float, x: Array) -> None:
    """x -= H^-1 C_q' lambda with (C_q H^-1 C_q') lambda = gap; lambda is left in w.multiplier."""
    width = len(tile)
    n = m.unknowns
    count = m.constraints.size
    for lane in range(width):
        _solve_semidefinite(count, width, lane, w.gram, w.gap, w.multiplier, tolerance)
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


@njit(cache=True, error_model="numpy")
def constrain(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array, tolerance: float) -> None:
    """Replace the free acceleration by the true one."""
    prepare(tile, m, m.mass_factor, m.pattern, q, w)
    constraints.bias(tile, m.constraints, v, w.gap)
    add_rates(tile, m, w, a)
    apply(tile, m, w, tolerance, a)


@njit(cache=True, error_model="numpy")
def add_rates(tile: Tile, m: Arrays, w: GaussWork, x: Array) -> None:
    """gap += C_q x."""
    for k in range(m.constraints.size):
        for i in range(m.unknowns):
            add_product(tile, w.gap, k, w.jacobian, k * m.unknowns + i, x, i)


@njit(cache=True, error_model="numpy")
def project(
    tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float, iterations: int
) -> None:
    """Move q and v back onto C = 0 and C_q v = 0 by the smallest change in the mass metric."""
    rows = m.constraints.size * len(tile)
    for _ in range(iterations):
        constraints.residual(tile, m.constraints, q, w.gap)
        largest = 0.0
        for k in range(rows):
            largest = max(largest, abs(w.gap[k]))
        if largest < 1e-15:
            break
        prepare(tile, m, m.mass_factor, m.pattern, q, w)
        apply(tile, m, w, tolerance, q)
    project_rates(tile, m, w, t, q, v, tolerance)


@njit(cache=True, error_model="numpy")
def project_rates(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float) -> None:
    """Move v back onto C_q v = 0 by the smallest change in the mass metric."""
    prepare(tile, m, m.mass_factor, m.pattern, q, w)
    for k in range(m.constraints.size):
        clear(tile, w.gap, k)
    add_rates(tile, m, w, v)
    apply(tile, m, w, tolerance, v)
