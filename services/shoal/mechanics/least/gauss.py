"""Gauss's principle of least constraint, and the removal of drift, both in the metric of the mass matrix.

The true acceleration minimises 1/2 (M a - Q)' M^-1 (M a - Q) subject to C_q a = -eta (paper, eq. 16). How the
minimiser is found is one of METHODS; `projection` is the default and the only one that is right at singular positions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import carray, njit

from shoal.mechanics import functions
from shoal.mechanics.least import alternatives, constraints, projection, saddle
from shoal.mechanics.least.saddle import SaddleWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import add_product, clear, copy, pointer, subtract, subtract_product

PROJECTION = 0
BAUMGARTE = 4
METHODS = {"projection": PROJECTION, "kkt": 1, "augmented-lagrangian": 2, "proximal": 3, "baumgarte": BAUMGARTE}

SETTLING = 100.0
"""Drift is removed along fewer directions than accelerations are held: those this much farther from singular."""


@njit(cache=True, error_model="numpy", forceinline=True)
def derive(tile: Tile, m: Arrays, z: Array, begin: int, end: int, moving: bool) -> None:
    """Fill the derived rows of z from row `begin` up to row `end`; for rates (moving) the constants do not count."""
    for row in range(begin, end):
        d = row - m.unknowns
        if moving:
            clear(tile, z, row)
        else:
            copy(tile, z, row, m.derived.constant, d)
        for t in range(m.derived.start[d], m.derived.start[d + 1]):
            add_product(tile, z, row, m.derived.coefficient, t, z, m.derived.source[t])


class LaneWork(NamedTuple):
    """Work space for one lane at a time, as arrays; see `GaussWork`."""

    rows: Array
    triangle: Array
    norms: Array
    order: Index
    wanted: Array
    weights: Array
    y: Array
    row: Array


class GaussWork(NamedTuple):
    """Work space of one tile.

    jacobian, turning: C_q and dC_q/dt (entries, lanes). response: C_q' or H^-1 C_q' (constraints * unknowns, lanes).
    gram: (constraints^2, lanes). multiplier, gap: (constraints, lanes). extra: (unknowns, lanes). For one lane at a
    time: rows (constraints, unknowns), triangle, norms, order, wanted, weights (constraints), y, row (unknowns).
    """

    jacobian: Array
    turning: Array
    response: Array
    gram: Array
    multiplier: Array
    gap: Array
    extra: Array
    rows: Array
    triangle: Array
    norms: Array
    order: Array
    wanted: Array
    weights: Array
    y: Array
    row: Array
    saddle: SaddleWork


def work_space(width: int, m: Arrays) -> GaussWork:
    """Room for the constraints of a model."""
    count, n, entries = m.constraints.size, m.unknowns, len(m.constraints.column)
    sizes = (entries, entries, count * n, count * count, count, count, n)
    jacobian, turning, response, gram, multiplier, gap, extra = (np.zeros(size * width) for size in sizes)
    return GaussWork(
        jacobian,
        turning,
        response,
        gram,
        multiplier,
        gap,
        extra,
        np.zeros((count, n)),
        np.zeros((count, count)),
        np.zeros(count),
        np.zeros(count, dtype=np.int64),
        np.zeros(count),
        np.zeros(count),
        np.zeros(n),
        np.zeros(n),
        saddle.room(m.saddle.size, m.saddle.slots, width),
    )


@njit(cache=True, error_model="numpy")
def raw(w: GaussWork) -> GaussWork:
    """The same room with pointers for what is tile wide."""
    return GaussWork(
        pointer(w.jacobian),
        pointer(w.turning),
        pointer(w.response),
        pointer(w.gram),
        pointer(w.multiplier),
        pointer(w.gap),
        pointer(w.extra),
        pointer(w.rows),
        pointer(w.triangle),
        pointer(w.norms),
        pointer(w.order),
        pointer(w.wanted),
        pointer(w.weights),
        pointer(w.y),
        pointer(w.row),
        SaddleWork(pointer(w.saddle.values), pointer(w.saddle.first), pointer(w.saddle.x)),
    )


@njit(cache=True, error_model="numpy")
def _lane_work(m: Arrays, w: GaussWork) -> LaneWork:
    count, n = m.constraints.size, m.unknowns
    return LaneWork(
        carray(w.rows, (count, n)),
        carray(w.triangle, (count, count)),
        carray(w.norms, (count,)),
        carray(w.order, (count,)),
        carray(w.wanted, (count,)),
        carray(w.weights, (count,)),
        carray(w.y, (n,)),
        carray(w.row, (n,)),
    )


@njit(cache=True, error_model="numpy")
def constrain(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array, tolerance: float) -> None:
    """Turn the forces Q in `a` into the true acceleration; the multipliers go into w.multiplier.

    tolerance: distance from a singular position, relative to a row's length, below which third derivatives take over.
    They tell the acceleration there up to the distance d itself. The constraints tell it up to eps/d^2: round-off eps
    in C_q v leaves the rate of the weakest direction uncertain by eps/d, and its acceleration by that over d. So the
    best tolerance is about the cube root of eps.
    """
    derive(tile, m, q, m.unknowns, m.held_rows, False)
    derive(tile, m, v, m.unknowns, m.held_rows, True)
    if m.saddle.size > 0 and m.method == PROJECTION:
        _constrain_many(tile, m, w, t, q, v, a)
        return
    width = len(tile)
    s = _lane_work(m, w)
    constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
    _rows(tile, m, w)
    sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, a, 0)
    constraints.bias(tile, m.constraints, m.functions, t, v, w.gap)
    if m.method == BAUMGARTE:
        _stabilise(tile, m, w, t, q, v)
    for lane in range(width):
        _load_lane(width, lane, m, w, s, a)
        count = m.constraints.size
        for k in range(count):
            s.weights[k] = -w.gap[k * width + lane]
        if m.method == PROJECTION or m.method == BAUMGARTE:
            rank = projection.orthonormalise(s.rows, s.triangle, s.norms, s.order, tolerance)
            first = rank
            projection.components(rank, s.triangle, s.norms, s.order, s.weights, s.wanted)
            if rank < count:
                rank = _add_third_derivatives(tile, m, w, s, t, v, lane, rank, tolerance)
            projection.move(rank, s.rows, s.wanted, s.y)
            projection.multipliers(first, s.triangle, s.norms, s.order, s.wanted, s.weights)
        else:
            alternatives.correct(m.method, s.rows, s.weights, s.triangle, s.norms, s.wanted, s.y)
            for k in range(count):
                s.weights[k] = s.wanted[k] * s.norms[k]
        for i in range(m.unknowns):
            a[i * width + lane] = s.y[i]
        for k in range(count):
            w.multiplier[k * width + lane] = s.weights[k]
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, a, 0)


@njit(cache=True, error_model="numpy")
def _rows(tile: Tile, m: Arrays, w: GaussWork) -> None:
    """The rows D^-1/2 L^-1 C_q' of the Jacobian in w.jacobian, into w.response."""
    n = m.unknowns
    c = m.constraints
    for row in range(c.size * n):
        clear(tile, w.response, row)
    for k in range(c.size):
        for e in range(c.entry[k], c.entry[k + 1]):
            copy(tile, w.response, k * n + c.column[e], w.jacobian, e)
        sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.response, k * n)


@njit(cache=True, error_model="numpy")
def _load_lane(width: int, lane: int, m: Arrays, w: GaussWork, s: LaneWork, y: Array) -> None:
    for k in range(m.constraints.size):
        for i in range(m.unknowns):
            s.rows[k, i] = w.response[(k * m.unknowns + i) * width + lane]
    for i in range(m.unknowns):
        s.y[i] = y[i * width + lane]


@njit(cache=True, error_model="numpy")
def _add_third_derivatives(
    tile: Tile, m: Arrays, w: GaussWork, s: LaneWork, t: float, v: Array, lane: int, rank: int, tolerance: float
) -> int:
    """Rows u' d3C/dt3 = 0 for the dependent combinations u of one lane; returns the new rank."""
    width = len(tile)
    count, n = m.constraints.size, m.unknowns
    c = m.constraints
    first = rank
    constraints.jacobian(tile, c, v, 0.0, w.turning)
    for number in range(first, count):
        projection.dependence(number, first, s.triangle, s.norms, s.order, s.weights)
        target, size = 0.0, 0.0
        for i in range(n * width):
            w.extra[i] = 0.0
        for k in range(count):
            target -= s.weights[k] * functions.evaluate(m.functions, c.drive[k], t, 3)
            for e in range(c.entry[k], c.entry[k + 1]):
                part = 3.0 * s.weights[k] * w.turning[e * width + lane]
                w.extra[c.column[e] * width + lane] += part
                size += abs(part)
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(w.extra[i * width + lane]))
        if not largest > 1e-10 * size:
            continue  # redundant everywhere, or at rest
        sparse.forward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
        for i in range(n):
            s.row[i] = w.extra[i * width + lane]
        rank = projection.extend(rank, s.rows, s.wanted, s.row, target, 1e-6)
    return rank


@njit(cache=True, error_model="numpy")
def _solve_many(tile: Tile, m: Arrays, w: GaussWork, load: Array, gap: Array, out: Array, multiplier: Array) -> None:
    """[M C_q'; C_q 0] [out; multiplier] = [load; -gap] with the factors in w.saddle."""
    s, room = m.saddle, w.saddle
    n = m.unknowns
    for i in range(n):
        copy(tile, room.x, s.place[i], load, i)
    for k in range(m.constraints.size):
        clear(tile, room.x, s.place[n + k])
        subtract(tile, room.x, s.place[n + k], gap, k)
    sparse.solve(tile, s.pattern, room.values, room.x, 0)
    for i in range(n):
        copy(tile, out, i, room.x, s.place[i])
    for k in range(m.constraints.size):
        copy(tile, multiplier, k, room.x, s.place[n + k])


@njit(cache=True, error_model="numpy")
def _constrain_many(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array) -> None:
    """`constrain` by the sparse saddle point problem."""
    c = m.constraints
    constraints.jacobian(tile, c, q, 1.0, w.jacobian)
    constraints.bias(tile, c, m.functions, t, v, w.gap)
    entries = c.entry[c.size]
    dropped = saddle.factor(tile, m.saddle, entries, w.jacobian, w.saddle, saddle.SINGULAR)
    _solve_many(tile, m, w, a, w.gap, a, w.multiplier)
    if dropped > 0:
        _add_many_third_derivatives(tile, m, w, t, v, a)


@njit(cache=True, error_model="numpy")
def _add_many_third_derivatives(tile: Tile, m: Arrays, w: GaussWork, t: float, v: Array, a: Array) -> None:
    """Correct `a` by the rows u' d3C/dt3 = 0 of the rows that the factorisation left out, one after the other."""
    width = len(tile)
    c = m.constraints
    n, count = m.unknowns, c.size
    constraints.jacobian(tile, c, v, 0.0, w.turning)
    moves = np.zeros((count, n))
    rows = np.zeros((count, n))
    zeros = np.zeros(count * width)
    load = np.zeros(n * width)
    found = np.zeros(n * width)
    for lane in range(width):
        rank = 0
        for k in range(count):
            if w.saddle.values[m.saddle.place[n + k] * width + lane] != 0.0:
                continue
            # u = e_k - mu with C_q' mu = the row k
            for i in range(n * width):
                load[i] = 0.0
            for e in range(c.entry[k], c.entry[k + 1]):
                load[c.column[e] * width + lane] = w.jacobian[e * width + lane]
            _solve_many(tile, m, w, pointer(load), pointer(zeros), pointer(found), w.multiplier)
            target, size = 0.0, 0.0
            for i in range(n):
                rows[rank, i] = 0.0
            for j in range(count):
                u = (1.0 if j == k else 0.0) - w.multiplier[j * width + lane]
                target -= u * functions.evaluate(m.functions, c.drive[j], t, 3)
                for e in range(c.entry[j], c.entry[j + 1]):
                    part = 3.0 * u * w.turning[e * width + lane]
                    rows[rank, c.column[e]] += part
                    size += abs(part)
            largest = 0.0
            for i in range(n * width):
                load[i] = 0.0
            for i in range(n):
                largest = max(largest, abs(rows[rank, i]))
                load[i * width + lane] = rows[rank, i]
            if not largest > 1e-10 * size:
                continue
            _solve_many(tile, m, w, pointer(load), pointer(zeros), pointer(found), w.multiplier)
            whole = 0.0
            for i in range(n):
                moves[rank, i] = found[i * width + lane]
                whole += moves[rank, i] * rows[rank, i]
            for r in range(rank):
                part = np.dot(rows[r], moves[rank]) / np.dot(rows[r], moves[r])
                for i in range(n):
                    moves[rank, i] -= part * moves[r, i]
            along = np.dot(rows[rank], moves[rank])
            if not along > 1e-10 * whole:
                continue
            gap = target
            for i in range(n):
                gap -= rows[rank, i] * a[i * width + lane]
            for i in range(n):
                a[i * width + lane] += gap / along * moves[rank, i]
            rank += 1


@njit(cache=True, error_model="numpy")
def _stabilise(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array) -> None:
    """Baumgarte 1972: C'' + 2 alpha C' + alpha^2 C = 0 in place of C'' = 0."""
    width = len(tile)
    c = m.constraints
    constraints.residual(tile, c, m.functions, t, q, w.multiplier)
    for i in range(c.size * width):
        w.gap[i] += m.baumgarte * m.baumgarte * w.multiplier[i]
    constraints.rates(tile, c, m.functions, t, w.multiplier)
    constraints.add_product(tile, c, w.jacobian, v, w.multiplier)
    for i in range(c.size * width):
        w.gap[i] += 2.0 * m.baumgarte * w.multiplier[i]


@njit(cache=True, error_model="numpy")
def project(
    tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float, iterations: int
) -> None:
    """Move q and v back onto C = 0 and C_q v = -C_t by the smallest change in the mass metric."""
    for _ in range(iterations):
        derive(tile, m, q, m.unknowns, m.held_rows, False)
        constraints.residual(tile, m.constraints, m.functions, t, q, w.gap)
        largest = 0.0
        for k in range(m.constraints.size * len(tile)):
            largest = max(largest, abs(w.gap[k]))
        if largest < 1e-15:
            break
        constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
        _correct(tile, m, w, q, tolerance)
    project_rates(tile, m, w, t, q, v, tolerance)


@njit(cache=True, error_model="numpy")
def project_rates(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float) -> None:
    """Move v back onto C_q v = -C_t by the smallest change in the mass metric."""
    derive(tile, m, q, m.unknowns, m.held_rows, False)
    constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
    constraints.rates(tile, m.constraints, m.functions, t, w.gap)
    constraints.add_product(tile, m.constraints, w.jacobian, v, w.gap)
    _correct(tile, m, w, v, tolerance)


@njit(cache=True, error_model="numpy")
def _correct(tile: Tile, m: Arrays, w: GaussWork, x: Array, tolerance: float) -> None:
    """Change x by the smallest d in the mass metric with C_q d = -gap; C_q is in w.jacobian."""
    width = len(tile)
    if m.saddle.size > 0:
        c = m.constraints
        saddle.factor(tile, m.saddle, c.entry[c.size], w.jacobian, w.saddle, saddle.SETTLED)
        for row in range(m.unknowns):
            clear(tile, w.extra, row)
        _solve_many(tile, m, w, w.extra, w.gap, w.extra, w.multiplier)
        for i in range(m.unknowns * width):
            x[i] += w.extra[i]
        return
    s = _lane_work(m, w)
    _rows(tile, m, w)
    for lane in range(width):
        for i in range(m.unknowns):
            w.extra[i * width + lane] = 0.0
        _load_lane(width, lane, m, w, s, w.extra)
        for k in range(m.constraints.size):
            s.weights[k] = -w.gap[k * width + lane]
        rank = projection.orthonormalise(s.rows, s.triangle, s.norms, s.order, SETTLING * tolerance)
        projection.components(rank, s.triangle, s.norms, s.order, s.weights, s.wanted)
        projection.move(rank, s.rows, s.wanted, s.y)
        for i in range(m.unknowns):
            w.extra[i * width + lane] = s.y[i]
    sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
    for i in range(m.unknowns * width):
        x[i] += w.extra[i]


# Implicit steps: the same saddle point problem with a tangent H in place of M.


@njit(cache=True, error_model="numpy")
def prepare(tile: Tile, m: Arrays, factor: Array, pattern: sparse.Pattern, q: Array, w: GaussWork) -> None:
    """Evaluate C_q, H^-1 C_q' and C_q H^-1 C_q' at q for the factored matrix H."""
    derive(tile, m, q, m.unknowns, m.held_rows, False)
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
        alternatives.solve_semidefinite(count, width, lane, w.gram, w.gap, w.multiplier, max(tolerance**2, 1e-13))
    for k in range(count):
        for i in range(n):
            subtract_product(tile, x, i, w.response, k * n + i, w.multiplier, k)
