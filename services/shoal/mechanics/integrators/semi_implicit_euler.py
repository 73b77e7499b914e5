"""Semi-implicit (symplectic) Euler, the paper's step: the acceleration moves the rate, the new rate the position."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import constraints, dynamics, kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver


class SemiImplicitEuler(NamedTuple):
    """Settings. power: of the forces and drives in the last step [W], (lanes,)."""

    rank_tolerance: float
    power: Array
    evaluations: Array


FACTS = Facts(
    order=1,
    explicit=True,
    sparse_constraints=True,
    mean_power=True,
    good_for="repeating the paper; every other explicit method is more accurate at the same cost",
    stable_step_times_frequency=2.0,
    stable_step_times_decay=2.0,
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> SemiImplicitEuler:
    """Settings for one tile of lanes."""
    return SemiImplicitEuler(solver.rank_tolerance, np.zeros(len(tile)), np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: SemiImplicitEuler, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t: v += h a, q += h v."""
    width = len(tile)
    end = m.unknowns * width
    scheme.evaluations[0] += 1
    rubs = m.gaps.tangents > 0
    if rubs:
        kernels.acceleration(tile, m, w, t, w.z, w.zdot, scheme.rank_tolerance, w.stage)
        for lane in range(width):
            scheme.power[lane] = w.power[lane]
    elif dynamics.loaded(m):
        # The force at the beginning acts on the mean rates.
        for i in range(end):
            w.before[i] = w.zdot[i] + 0.5 * h * w.a[i]
        kernels.force(tile, m, w, t, w.z, w.before, w.stage)
        for lane in range(width):
            scheme.power[lane] = w.power[lane]
        _add_drives(tile, scheme, m, w, t)
    for i in range(end):
        w.zdot[i] += h * w.a[i]
        w.z[i] += h * w.zdot[i]
    kernels.settle(tile, m, w, t + h, scheme.rank_tolerance)
    kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, scheme.rank_tolerance, w.a)
    if rubs:
        # Friction of contacts is found with the acceleration: the mean of its power at both ends.
        for lane in range(width):
            w.power[lane] = 0.5 * (scheme.power[lane] + w.power[lane])
    elif dynamics.loaded(m):
        _add_drives(tile, scheme, m, w, t + h)
        for lane in range(width):
            w.power[lane] = scheme.power[lane]
    return h


@njit(cache=True, error_model="numpy")
def _add_drives(tile: Tile, scheme: SemiImplicitEuler, m: Arrays, w: Work, t: float) -> None:
    """Half of what the drives take at the time t of the acceleration that was found last."""
    if m.driven:
        width = len(tile)
        for lane in range(width):
            w.power[lane] = 0.0
        now = dynamics.instant(w, t)
        constraints.add_power(tile, m.constraints, m.functions, now, w.gauss.multiplier, w.power)
        for lane in range(width):
            scheme.power[lane] += 0.5 * w.power[lane]


implement(SemiImplicitEuler, step, FACTS, cubic)
