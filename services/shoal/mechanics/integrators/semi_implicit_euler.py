"""Semi-implicit (symplectic) Euler, the paper's step: the acceleration moves the rate, the new rate the position."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import dynamics
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.tile import Array, Tile
from shoal.scene import Solver


class SemiImplicitEuler(NamedTuple):
    """Settings."""

    rank_tolerance: float
    evaluations: Array


FACTS = Facts(
    order=1,
    explicit=True,
    good_for="repeating the paper; every other explicit method is more accurate at the same cost",
    stable_step_times_frequency=2.0,
    stable_step_times_decay=2.0,
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> SemiImplicitEuler:
    """Settings for one tile of lanes."""
    return SemiImplicitEuler(solver.rank_tolerance, np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: SemiImplicitEuler, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t: v += h a, q += h v."""
    scheme.evaluations[0] += 1
    for i in range(m.unknowns * len(tile)):
        w.zdot[i] += h * w.a[i]
        w.z[i] += h * w.zdot[i]
    dynamics.settle(tile, m, w, t + h, scheme.rank_tolerance)
    dynamics.acceleration(tile, m, w, t + h, w.z, w.zdot, scheme.rank_tolerance, w.a)
    return h


implement(SemiImplicitEuler, step, FACTS, cubic)
