"""The removal of drift: the smallest change in the metric of the mass matrix that closes the constraints again."""

from __future__ import annotations

from numba import njit

from shoal.mechanics import constraints, saddle
from shoal.mechanics.derived import derive
from shoal.mechanics.least import many, projection
from shoal.mechanics.least.work import GaussWork, lane_work, load_lane, rows
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.numerics.vector import clear

SETTLING = 100.0
"""Drift is removed along fewer directions than accelerations are held: those this much farther from singular."""


@njit(cache=True, error_model="numpy", inline="always")
def project(
    tile: Tile, m: Arrays, w: GaussWork, t: float, q: Array, v: Array, tolerance: float, iterations: int
) -> None:
    """Move q and v back onto C = 0 and C_q v = -C_t by the smallest change in the mass metric."""
    for _ in range(iterations):
        derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
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
    derive(tile, m.derived, q, m.unknowns, m.held_rows, False)
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
        many.solve(tile, m, w, w.extra, w.gap, w.extra, w.multiplier)
        for i in range(m.unknowns * width):
            x[i] += w.extra[i]
        return
    s = lane_work(m, w)
    rows(tile, m, w)
    for lane in range(width):
        for i in range(m.unknowns):
            w.extra[i * width + lane] = 0.0
        load_lane(width, lane, m, w, s, w.extra)
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
