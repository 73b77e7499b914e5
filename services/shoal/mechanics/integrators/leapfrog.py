"""Leapfrog (velocity Verlet): explicit, second order, one force per step, no energy drift in the long run.

Where accelerations depend on the rates, the rate at the end of the step is predicted from the old
acceleration, which keeps second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT, add_scaled, add_to, assign, load, store
from shoal.mechanics import dynamics, kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver


class Leapfrog(NamedTuple):
    """Settings."""

    rank_tolerance: float
    evaluations: Array


# The predicted rate makes decay a two-step recursion, which is stable up to one.
FACTS = Facts(
    order=2,
    explicit=True,
    constraint_forces=True,
    sparse_constraints=True,
    warm_lanes=True,
    good_for="elastic machines whose fast vibrations are resolved: the cheapest step, and no loss of energy",
    stable_step_times_frequency=2.0,
    stable_step_times_decay=1.0,
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Leapfrog:
    """Settings for one tile of lanes."""
    return Leapfrog(solver.rank_tolerance, np.zeros(1))


@njit(error_model="numpy", forceinline=True)
def _kick_and_drift(z: Array, zdot: Array, a: Array, h: float, count: int) -> None:
    """zdot += h/2 a, then z += h zdot, in one way through the memory. Pointers."""
    whole = count - count % len(EIGHT)
    for i in range(0, whole, len(EIGHT)):
        rate = load(EIGHT, zdot, i) + (0.5 * h) * load(EIGHT, a, i)
        store(zdot, i, rate)
        add_to(z, i, h * rate)
    for i in range(whole, count):
        zdot[i] += 0.5 * h * a[i]
        z[i] += h * zdot[i]


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: Leapfrog, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t."""
    end = m.unknowns * len(tile)
    scheme.evaluations[0] += 1
    _kick_and_drift(w.z, w.zdot, w.a, h, end)
    if m.constraints.size > 0 or dynamics.loaded(m):
        assign(w.stage, w.zdot, end)
        add_scaled(w.zdot, 0.5 * h, w.a, end)
        kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, scheme.rank_tolerance, w.a)
        assign(w.zdot, w.stage, end)
        add_scaled(w.zdot, 0.5 * h, w.a, end)
        kernels.settle(tile, m, w, t + h, scheme.rank_tolerance, found=True)
    else:
        kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, scheme.rank_tolerance, w.a)
        add_scaled(w.zdot, 0.5 * h, w.a, end)
    return h


implement(Leapfrog, step, FACTS)
