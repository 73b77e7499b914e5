"""The classical explicit Runge-Kutta method of order 4."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver


class Rk4(NamedTuple):
    """Settings."""

    rank_tolerance: float
    evaluations: Array


FACTS = Facts(
    order=4,
    explicit=True,
    constraint_forces=True,
    sparse_constraints=True,
    warm_lanes=True,
    good_for="smooth motion at a fixed step, where a known step matters more than a known error",
    stable_step_times_frequency=2.828,
    stable_step_times_decay=2.785,
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Rk4:
    """Settings for one tile of lanes."""
    return Rk4(solver.rank_tolerance, np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: Rk4, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t; w.a holds the acceleration before and after."""
    end = m.unknowns * len(tile)
    scheme.evaluations[0] += 4
    v, q_sum, v_sum = end, 2 * end, 3 * end
    for i in range(end):
        w.stage[i] = w.z[i]
        w.stage[v + i] = w.zdot[i]
        w.stage[q_sum + i] = w.zdot[i]
        w.stage[v_sum + i] = w.a[i]
    for stage in range(3):
        part = h if stage == 2 else 0.5 * h
        weight = 1.0 if stage == 2 else 2.0
        for i in range(end):
            w.z[i] = w.stage[i] + part * w.zdot[i]
            w.zdot[i] = w.stage[v + i] + part * w.a[i]
        kernels.acceleration(tile, m, w, t + part, w.z, w.zdot, scheme.rank_tolerance, w.a)
        for i in range(end):
            w.stage[q_sum + i] += weight * w.zdot[i]
            w.stage[v_sum + i] += weight * w.a[i]
    for i in range(end):
        w.z[i] = w.stage[i] + h / 6.0 * w.stage[q_sum + i]
        w.zdot[i] = w.stage[v + i] + h / 6.0 * w.stage[v_sum + i]
    kernels.settle(tile, m, w, t + h, scheme.rank_tolerance, found=True)
    kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, scheme.rank_tolerance, w.a)
    return h


implement(Rk4, step, FACTS)
