"""Least constraint by the sparse saddle point problem (`saddle`)."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import pointer
from shoal.compile.vector import add, clear, copy, subtract
from shoal.mechanics import constraints, functions, saddle
from shoal.mechanics.constraints import Constraints
from shoal.mechanics.least.projection import NOTHING, dot
from shoal.mechanics.least.work import GaussWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

STILL = 1e-9
"""A third derivative below this part of what its velocities could make it is none."""


@njit(cache=True, error_model="numpy")
def solve(tile: Tile, m: Arrays, w: GaussWork, load: Array, gap: Array, out: Array, multiplier: Array) -> None:
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
    for _ in range(m.refinements):  # see `lent`
        for i in range(n):
            copy(tile, w.moved, i, room.x, s.place[i])
        sparse.multiply(tile, m.pattern, m.lent, w.moved, w.lent)
        for i in range(n):
            copy(tile, room.x, s.place[i], w.lent, i)
        for k in range(m.constraints.size):
            clear(tile, room.x, s.place[n + k])
        sparse.solve(tile, s.pattern, room.values, room.x, 0)
        for i in range(n):
            add(tile, out, i, room.x, s.place[i])
        for k in range(m.constraints.size):
            add(tile, multiplier, k, room.x, s.place[n + k])


@njit(cache=True, error_model="numpy")
def constrain(tile: Tile, m: Arrays, w: GaussWork, t: float, v: Array, a: Array) -> bool:
    """See `principle.constrain`; C_q and eta are in w. Whether it is done: not for few constraints near singular."""
    c = m.constraints
    entries = c.entry[c.size]
    tolerance = saddle.SINGULAR if m.saddle.many else saddle.REGULAR
    dropped = saddle.factor(tile, m.saddle, entries, w.jacobian, w.saddle, tolerance, w.closeness)
    if dropped > 0 and not m.saddle.many:
        return False
    solve(tile, m, w, a, w.gap, a, w.multiplier)
    if dropped > 0:
        _add_third_derivatives(tile, m, w, t, v, a)
    return True


@njit(cache=True, error_model="numpy")
def _combine(tile: Tile, c: Constraints, w: GaussWork, number: int, lane: int, weights: Array) -> None:
    """Shares of the rows in the combination of row `number` that vanishes, by its multipliers in w."""
    width, largest = len(tile), 0.0
    for turn in range(2):
        for j in range(c.size):
            square = 0.0
            for e in range(c.entry[j], c.entry[j + 1]):
                square += w.jacobian[e * width + lane] ** 2
            share = (1.0 if j == number else 0.0) - w.multiplier[j * width + lane]
            if turn == 0:
                largest = max(largest, abs(share) * np.sqrt(square))
            alien = j != number and abs(share) * np.sqrt(square) < NOTHING * largest
            weights[j] = 0.0 if alien else share


@njit(cache=True, error_model="numpy")
def _add_third_derivatives(tile: Tile, m: Arrays, w: GaussWork, t: float, v: Array, a: Array) -> None:
    """Correct `a` by the rows u' d3C/dt3 = 0 of the rows that the factorisation left out, one after the other."""
    width = len(tile)
    c = m.constraints
    n, count = m.unknowns, c.size
    constraints.jacobian(tile, c, v, 0.0, w.turning)
    moves = np.zeros((count, n))
    rows = np.zeros((count, n))
    zeros = np.zeros(count * width)
    weights = np.zeros(count)
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
            solve(tile, m, w, pointer(load), pointer(zeros), pointer(found), w.multiplier)
            target = 0.0
            for i in range(n):
                rows[rank, i] = 0.0
            _combine(tile, c, w, k, lane, weights)
            for j in range(count):
                target -= weights[j] * functions.evaluate(m.functions, c.drive[j], t, 3)
                for e in range(c.entry[j], c.entry[j + 1]):
                    rows[rank, c.column[e]] += 3.0 * weights[j] * w.turning[e * width + lane]
            largest = 0.0
            for i in range(n * width):
                load[i] = 0.0
            for i in range(n):
                largest = max(largest, abs(rows[rank, i]))
                load[i * width + lane] = rows[rank, i]
            pace = constraints.pace(tile, c, weights, v, lane)
            if not largest > STILL * pace:
                continue
            solve(tile, m, w, pointer(load), pointer(zeros), pointer(found), w.multiplier)
            whole = 0.0
            for i in range(n):
                moves[rank, i] = found[i * width + lane]
                whole += moves[rank, i] * rows[rank, i]
            for r in range(rank):
                part = dot(rows[r], moves[rank]) / dot(rows[r], moves[r])
                for i in range(n):
                    moves[rank, i] -= part * moves[r, i]
            along = dot(rows[rank], moves[rank])
            if not along > 1e-10 * whole * (3.0 * pace / largest) ** 2:
                continue
            gap = target
            for i in range(n):
                gap -= rows[rank, i] * a[i * width + lane]
            for i in range(n):
                a[i * width + lane] += gap / along * moves[rank, i]
            rank += 1
