"""The removal of drift: the smallest change in the metric of the mass matrix that closes the constraints again.

Drift is small, and so is the way back. By the sparse saddle point problem the factors of the last accelerations serve
for all of it, places and rates (chord method), and are renewed only where a change has left more than a hundredth of a
gap.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT
from shoal.compile.vector import clear
from shoal.mechanics import constraints, saddle
from shoal.mechanics.derived import derive
from shoal.mechanics.least import lent, many, projection, together
from shoal.mechanics.least.work import GaussWork, lane_work, load_lane, rows
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile

SETTLING = 100.0
"""Drift is removed along fewer directions than accelerations are held: those this much farther from singular."""
CLOSED = 1e-15
"""A gap of round-off."""
SLOW, SMALL = 1e-2, 1e-10
"""What is left of a gap after a change along directions that still serve; a gap that is near round-off."""
LITTLE = 1e-13
"""A gap of rates that the next step may remove."""


@njit(cache=True, error_model="numpy", forceinline=True)
def project(
    tile: Tile,
    m: Arrays,
    w: GaussWork,
    t: float,
    q: Array,
    v: Array,
    tolerance: float,
    iterations: int,
    ready: bool,
) -> None:
    """Move q and v back onto C = 0 and C_q v = -C_t by the smallest change in the mass metric.

    ready: whether accelerations have just been found at q or near it by the projection, whose directions are at hand.
    Where no position closes the constraints, as no drive beyond the reach of the joints does, the motion ends.
    """
    ready = ready and w.saddle.weak[0] == 0.0 and w.saddle.opened[0] == 0.0
    factored, now = _close(tile, m, w, t, q, tolerance, iterations, ready)
    if now > SMALL and factored and m.saddle.rows < m.constraints.size:
        w.saddle.opened[0] = 1.0
        factored, now = _close(tile, m, w, t, q, tolerance, iterations, False)
    if now > SMALL:
        _leave_open(tile, m, w, t, q, v)
    _project_rates(tile, m, w, t, q, v, tolerance, factored)


@njit(cache=True, error_model="numpy")
def _close(
    tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, tolerance: float, iterations: int, ready: bool
) -> tuple[bool, float]:
    """Move q onto C = 0; returns whether there are factors of a place near q, and the largest gap before the last move.

    ready: whether there are at the beginning
    """
    factored, before, now = ready and m.saddle.size > 0, np.inf, 0.0
    for _ in range(iterations):
        derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
        constraints.residual(tile, m.constraints, m.functions, t, q, w.gap)
        now = _largest(tile, m, w)
        if now < CLOSED:
            break
        if not (factored and (now < SLOW * before or now < SMALL)):
            constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
            factored = _prepare(tile, m, w)
        _correct(tile, m, w, q, tolerance, factored)
        before = now
    return factored, now


@njit(cache=True, error_model="numpy")
def _leave_open(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array) -> None:
    """End the motion of lanes whose constraints the change has not closed: t and the most open one go into w.ended."""
    width, c = len(tile), m.constraints
    derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
    constraints.residual(tile, c, m.functions, t, q, w.gap)
    for lane in range(width):
        worst, most = -1, 1.0
        for k in range(c.size):
            part = abs(w.gap[k * width + lane]) / c.open[k * width + lane]
            if part > most:
                worst, most = k, part
        if worst >= 0:
            w.ended[lane], w.ended[width + lane] = t, worst
            for i in range(lane, m.unknowns * width, width):
                q[i], v[i] = np.nan, np.nan


@njit(cache=True, error_model="numpy")
def project_rates(tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float) -> None:
    """Move v back onto C_q v = -C_t by the smallest change in the mass metric."""
    _project_rates(tile, m, w, t, q, v, tolerance, False)


@njit(cache=True, error_model="numpy")
def _project_rates(
    tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float, ready: bool
) -> None:
    """The same; ready: whether there are factors of a place near q. Again with those, as a change leaves a little."""
    derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
    constraints.jacobian(tile, m.constraints, q, 1.0, w.jacobian)
    factored, before = ready or _prepare(tile, m, w), np.inf
    for again in range(3 if ready else 1):
        constraints.rates(tile, m.constraints, m.functions, t, w.gap)
        constraints.add_product(tile, m.constraints, w.jacobian, v, w.gap)
        now = _largest(tile, m, w)
        if again and now < LITTLE:
            break
        if not (now < SLOW * before or now < SMALL):
            factored = _prepare(tile, m, w)
        _correct(tile, m, w, v, tolerance, factored)
        before = now


@njit(cache=True, error_model="numpy", forceinline=True)
def _largest(tile: Tile, m: Arrays, w: GaussWork) -> float:
    """The largest gap of all lanes; of those that are numbers."""
    largest = 0.0
    for k in range(m.constraints.size * len(tile)):
        largest = max(largest, abs(w.gap[k]))
    return largest


@njit(cache=True, error_model="numpy")
def _prepare(tile: Tile, m: Arrays, w: GaussWork) -> bool:
    """Take the directions of `_correct` from C_q in w.jacobian; whether they are factors of `saddle`."""
    if m.saddle.size > 0 and w.saddle.opened[0] == 0.0:
        tolerance = saddle.SETTLED if m.saddle.many else saddle.REGULAR
        if saddle.factor(tile, m.saddle, w.jacobian, w.saddle, tolerance, w.closeness) == 0 or m.saddle.many:
            return True
    rows(tile, m, w)
    return False


@njit(cache=True, error_model="numpy")
def _correct(tile: Tile, m: Arrays, w: GaussWork, x: Array, tolerance: float, factored: bool) -> None:
    """Change x by the smallest d in the mass metric with C_q d = -gap, along prepared directions."""
    width = len(tile)
    for row in range(m.unknowns):
        clear(tile, w.extra, row)
    if factored:
        many.solve(tile, m, w, w.extra, w.gap, w.extra, w.multiplier)
    else:
        _move(tile, m, w, tolerance)
        sparse.backward(tile, m.pattern, m.mass_factor, m.mass_root, w.extra, 0)
    for i in range(m.unknowns * width):
        x[i] += w.extra[i]


@njit(cache=True, error_model="numpy")
def _move(tile: Tile, m: Arrays, w: GaussWork, tolerance: float) -> None:
    """The change into w.extra, as D^1/2 L' d."""
    width, count, n = len(tile), m.constraints.size, m.unknowns
    s, alone = lane_work(m, w), 0
    for lane in range(width):
        if width % len(EIGHT) == 0 and lane % len(EIGHT) == 0:
            rank = together.orthonormalise(w.group, count, n, width, lane, w.response, SETTLING * tolerance)
            if rank != together.ALONE:
                together.move(w.group, rank, count, n, width, lane, w.gap, w.extra)
                lent.take_back_from_group(tile, m, w, lane, rank, w.extra)
                alone = lane + len(EIGHT)
        if lane < alone:
            continue
        load_lane(width, lane, m, w, s, w.extra)
        for k in range(m.constraints.size):
            s.weights[k] = -w.gap[k * width + lane]
        rank = projection.orthonormalise(s.rows, s.triangle, s.norms, s.order, SETTLING * tolerance)
        projection.components(rank, s.triangle, s.norms, s.order, s.weights, s.wanted)
        projection.move(rank, s.rows, s.wanted, s.y)
        lent.take_back_from_lane(tile, m, w, s, lane, rank, np.bool_(True))
        for i in range(m.unknowns):
            w.extra[i * width + lane] = s.y[i]
