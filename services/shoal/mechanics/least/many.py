"""Least constraint by the sparse saddle point problem (`saddle`)."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import pointer
from shoal.compile.vector import add, clear, copy, subtract
from shoal.mechanics import constraints, saddle
from shoal.mechanics.constraints import Constraints
from shoal.mechanics.least import crossing
from shoal.mechanics.least.projection import NOTHING, dot
from shoal.mechanics.least.work import HERE, GaussWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

STILL = 1e-9
"""A third derivative below this part of what its velocities could make it is none."""


REDUNDANT = 1e-5
"""Remainder of a redundant constraint's equation, as a part of its terms: stages of a step are that far off the closed
machine, and the projection counts a row as dependent from there, too."""


@njit(cache=True, error_model="numpy")
def solve(tile: Tile, m: Arrays, w: GaussWork, load: Array, gap: Array, out: Array, multiplier: Array) -> None:
    """[M C_q'; C_q 0] [out; multiplier] = [load; -gap] with the factors in w.saddle."""
    s, room = m.saddle, w.saddle
    n = m.unknowns
    for i in range(n):
        copy(tile, room.x, s.place[i], load, i)
    for j in range(s.rows):
        clear(tile, room.x, s.place[n + j])
        subtract(tile, room.x, s.place[n + j], gap, s.row[j])
    sparse.solve(tile, s.pattern, room.values, room.x, 0)
    for i in range(n):
        copy(tile, out, i, room.x, s.place[i])
    if s.rows < m.constraints.size:
        for k in range(m.constraints.size):
            clear(tile, multiplier, k)
    for j in range(s.rows):
        copy(tile, multiplier, s.row[j], room.x, s.place[n + j])
    for _ in range(m.refinements):  # see `lent`
        for i in range(n):
            copy(tile, w.moved, i, room.x, s.place[i])
        sparse.multiply(tile, m.pattern, m.lent, w.moved, w.lent)
        for i in range(n):
            copy(tile, room.x, s.place[i], w.lent, i)
        for j in range(s.rows):
            clear(tile, room.x, s.place[n + j])
        sparse.solve(tile, s.pattern, room.values, room.x, 0)
        for i in range(n):
            add(tile, out, i, room.x, s.place[i])
        for j in range(s.rows):
            add(tile, multiplier, s.row[j], room.x, s.place[n + j])


@njit(cache=True, error_model="numpy")
def constrain(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array) -> bool:
    """See `principle.constrain`; C_q and eta are in w. Whether it is done: not for few constraints near singular."""
    if w.saddle.opened[0] > 0.0:
        return False
    tolerance = saddle.SINGULAR if m.saddle.many else saddle.REGULAR
    dropped = saddle.factor(tile, m.saddle, w.jacobian, w.saddle, tolerance, w.closeness)
    if dropped > 0 and not m.saddle.many:
        return False
    if m.saddle.rows < m.constraints.size:
        for i in range(m.unknowns):
            copy(tile, w.extra, i, a, i)
    solve(tile, m, w, a, w.gap, a, w.multiplier)
    if m.saddle.rows < m.constraints.size and not _satisfies_left_out(tile, m, w, a):
        for i in range(m.unknowns):
            copy(tile, a, i, w.extra, i)
        return False
    clear(tile, w.near, 0)
    if dropped > 0:
        _add_dropped(tile, m, w, t, q, v, a)
    return True


@njit(cache=True, error_model="numpy")
def _satisfies_left_out(tile: Tile, m: Arrays, w: GaussWork, a: Array) -> bool:
    """Return whether an acceleration satisfies the constraints that were left out as well: C_q a = -eta."""
    width, c = len(tile), m.constraints
    for lane in range(width):
        largest, kept = 0.0, 0
        for i in range(lane, m.unknowns * width, width):
            largest = max(largest, abs(a[i]))
        for k in range(c.size):
            if kept < m.saddle.rows and m.saddle.row[kept] == k:
                kept += 1
                continue
            rest, size = w.gap[k * width + lane], abs(w.gap[k * width + lane])
            for e in range(c.entry[k], c.entry[k + 1]):
                rest += w.jacobian[e * width + lane] * a[c.column[e] * width + lane]
                size += abs(w.jacobian[e * width + lane]) * largest
            if abs(rest) > REDUNDANT * size:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _combine(tile: Tile, c: Constraints, w: GaussWork, number: int, lane: int, shares: Array, weights: Array) -> None:
    """Shares of the rows in the combination of row `number` that vanishes, by those of the others in it."""
    width, largest = len(tile), 0.0
    for turn in range(2):
        for j in range(c.size):
            square = 0.0
            for e in range(c.entry[j], c.entry[j + 1]):
                square += w.jacobian[e * width + lane] ** 2
            share = (1.0 if j == number else 0.0) - shares[j * width + lane]
            if turn == 0:
                largest = max(largest, abs(share) * np.sqrt(square))
            alien = j != number and abs(share) * np.sqrt(square) < NOTHING * largest
            weights[j] = 0.0 if alien else share


@njit(cache=True, error_model="numpy")
def _add_dropped(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, a: Array) -> None:
    """Correct `a` by a row for each that the factorisation left out, one after the other.

    Where branches of the motion cross it is u' d3C/dt3 = 0, else u' d2C/dt2 = 0, with the remainder of u' C_q.
    """
    width = len(tile)
    c = m.constraints
    n, count = m.unknowns, c.size
    constraints.residual(tile, c, m.functions, t, q, w.residual)
    moves = np.zeros((count, n))
    rows = np.zeros((count, n))
    none, shares = np.zeros(count * width), np.zeros(count * width)
    weights = np.zeros(count)
    load, found, change = np.zeros(n * width), np.zeros(n * width), np.zeros(n * width)
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
            solve(tile, m, w, pointer(load), pointer(none), pointer(found), pointer(shares))
            _combine(tile, c, w, k, lane, shares, weights)
            constraints.jacobian(tile, c, v, 0.0, w.turning)
            crossing.turn(tile, m, w, weights, lane, pointer(load))
            largest, pace = 0.0, constraints.pace(tile, c, weights, v, lane)
            for i in range(lane, n * width, width):
                largest = max(largest, abs(load[i]))
            if not largest > STILL * pace:
                continue
            solve(tile, m, w, pointer(load), pointer(none), pointer(found), pointer(shares))
            gap, whole = 0.0, 0.0
            for i in range(n):
                rows[rank, i], moves[rank, i] = load[i * width + lane], found[i * width + lane]
                whole += moves[rank, i] * rows[rank, i]
            if not _is_independent(rank, rows, moves, 1e-10 * whole * (pace / largest) ** 2):
                continue
            for i in range(n):
                load[i * width + lane] = 0.0
            for j in range(count):
                for e in range(c.entry[j], c.entry[j + 1]):
                    load[c.column[e] * width + lane] += weights[j] * w.jacobian[e * width + lane]
            solve(tile, m, w, pointer(load), pointer(none), w.branch, pointer(shares))
            square = 0.0
            for i in range(lane, n * width, width):
                square += load[i] * w.branch[i]
            if square > 0.0 and not crossing.crosses(tile, m, w, t, v, lane, weights, square):
                for i in range(n):
                    rows[rank, i], moves[rank, i] = load[i * width + lane], w.branch[i * width + lane]
                for j in range(count):
                    gap -= weights[j] * w.gap[j * width + lane]
                if not _is_independent(rank, rows, moves, 0.0):
                    continue
            else:
                for j in range(count):
                    gap -= weights[j] * constraints.third_derivative(tile, c, m.functions, j, t, q, v, lane)
            for i in range(n):
                gap -= rows[rank, i] * a[i * width + lane]
            gap /= dot(rows[rank], moves[rank])
            for i in range(n):
                a[i * width + lane] += gap * moves[rank, i]
                change[i * width + lane] += gap * moves[rank, i]
            w.near[lane] = HERE
            rank += 1
        if m.driven:
            w.power[lane] = crossing.power(tile, m, w, v, change, lane)


@njit(cache=True, error_model="numpy")
def _is_independent(rank: int, rows: Array, moves: Array, least: float) -> bool:
    """Take the rows before number `rank` out of its move; return whether more than the least is left of it along it."""
    for r in range(rank):
        part = dot(rows[r], moves[rank]) / dot(rows[r], moves[r])
        for i in range(moves.shape[1]):
            moves[rank, i] -= part * moves[r, i]
    return dot(rows[rank], moves[rank]) > least  # type: ignore[no-any-return]
