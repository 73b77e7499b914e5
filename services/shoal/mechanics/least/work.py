"""Room for the constraints of one tile, and what all ways to the acceleration do first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import carray, njit

from shoal.compile.vector import clear, copy
from shoal.mechanics import saddle
from shoal.mechanics.least import together
from shoal.mechanics.least.together import GroupWork
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.saddle import SaddleWork

HERE = 1.0
"""Of a lane that is at a singular position."""
UNENDED = -1.0
"""Of a lane that moves on: neither an instant nor the number of a constraint."""


class LaneWork(NamedTuple):
    """Room for one lane at a time.

    rows: (constraints, unknowns); triangle, norms, order, wanted, weights, shift: by constraint; y, row: (unknowns,).
    """

    rows: Array
    triangle: Array
    norms: Array
    order: Index
    wanted: Array
    weights: Array
    shift: Array
    y: Array
    row: Array


class GaussWork(NamedTuple):
    """Work space of one tile.

    jacobian, turning: C_q and dC_q/dt (entries, lanes). residual: C (constraints, lanes), near singular positions only.
    response: C_q' or H^-1 C_q' (constraints * unknowns, lanes). gram: (constraints^2, lanes).
    multiplier, gap: (constraints, lanes). extra, moved, lent: (unknowns, lanes), for the two last see `lent`.
    branch: tangent of the motion at a singular position, (rows, lanes). near: whether a lane is at a singular position,
    HERE, else 0, (lanes,). closeness: inverse square of the smallest distance from singular positions so far, the
    remainder of a row relative to its length, (lanes,); 0: not known. power: that of the rows by which third
    derivatives hold a motion on its branch [W], (lanes,). ended: by lane the instant [s] from which its motion is no
    number, then the constraint that could not be closed and the
    contact that could not be decided (`contact.coulomb.TROUBLES`), or UNENDED.
    """

    jacobian: Array
    turning: Array
    residual: Array
    response: Array
    gram: Array
    multiplier: Array
    gap: Array
    extra: Array
    moved: Array
    lent: Array
    branch: Array
    near: Array
    closeness: Array
    power: Array
    ended: Array
    lane: LaneWork
    group: GroupWork
    saddle: SaddleWork


def work_space(width: int, m: Arrays) -> GaussWork:
    """Room for the constraints of a model."""
    count, n, entries = m.constraints.size, m.unknowns, len(m.constraints.column)
    sizes = entries, entries, count, count * n, count * count, count, count
    jacobian, turning, residual, response, gram, multiplier, gap = (np.zeros(size * width) for size in sizes)
    extra, moved, lent, branch = (np.zeros(rows * width) for rows in (n, n, n, m.rows))
    near, closeness, power = (np.zeros(width) for _ in range(3))
    order = np.zeros(count, dtype=np.int64)
    wanted, weights, shift = (np.zeros(count) for _ in range(3))
    first = np.zeros((count, n)), np.zeros((count, count)), np.zeros(count), order, wanted, weights, shift
    lane = LaneWork(*first, np.zeros(n), np.zeros(n))
    group, room = together.room(width, count, n), saddle.room(m.saddle.size, m.saddle.slots, width)
    matrices = jacobian, turning, residual, response, gram
    vectors = multiplier, gap, extra, moved, lent, branch, near, closeness, power, np.full(3 * width, UNENDED)
    return GaussWork(*matrices, *vectors, lane, group, room)


@njit(cache=True, error_model="numpy")
def lane_work(m: Arrays, w: GaussWork) -> LaneWork:
    """The room for one lane as arrays."""
    count, n = m.constraints.size, m.unknowns
    return LaneWork(
        carray(w.lane.rows, (count, n)),
        carray(w.lane.triangle, (count, count)),
        carray(w.lane.norms, (count,)),
        carray(w.lane.order, (count,)),
        carray(w.lane.wanted, (count,)),
        carray(w.lane.weights, (count,)),
        carray(w.lane.shift, (count,)),
        carray(w.lane.y, (n,)),
        carray(w.lane.row, (n,)),
    )


@njit(cache=True, error_model="numpy")
def rows(tile: Tile, m: Arrays, w: GaussWork) -> None:
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
def load_lane(width: int, lane: int, m: Arrays, w: GaussWork, s: LaneWork, y: Array) -> None:
    """The rows and y of one lane."""
    for k in range(m.constraints.size):
        for i in range(m.unknowns):
            s.rows[k, i] = w.response[(k * m.unknowns + i) * width + lane]
    for i in range(m.unknowns):
        s.y[i] = y[i * width + lane]
