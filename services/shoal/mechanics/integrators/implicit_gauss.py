"""The implicit step of Gauss's principle: of all rates, take the one that the least constraint asks for.

v+ = argmin 1/2 |v - v~|_M^2 + U(q + h v) subject to C(q + h v) = 0, where v~ = v + h M^-1 (applied forces) is the rate
of the free motion and U the elastic energy. Its stationarity is M (v+ - v)/h + C_q' lambda = Q(q + h v+, v+):
backward Euler with position constraints. Newton's quadratic model has the metric M + h D + h^2 K.

It loses energy at the rate h (a'Q / 2 + lambda'C_qq v v), h a'Ma / 2 where nothing is constrained, which its energy
balance shows: forces and drives are counted with the mean rates of the step, by which the kinetic energy changes, so
that nothing but this loss is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import raw
from shoal.mechanics import dynamics, kernels
from shoal.mechanics.constraints import driven
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import guess, newton
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.newton import Newton, newton_room
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver


class ImplicitGauss(NamedTuple):
    """Settings and room.

    rate: of every drive in the last step, (constraints,); started: whether there was one, (1,).
    """

    newton: Newton
    rate: Array
    started: Array
    evaluations: Array


FACTS = Facts(
    order=1,
    explicit=False,
    sparse_constraints=True,
    seconds_per_unknown=(6e-6, 6e-6),
    mean_power=True,
    good_for="coming to rest: it damps all vibrations, keeps joints closed and survives any step",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> ImplicitGauss:
    """Settings for one tile of lanes."""
    rate = np.zeros(max(1, model.constraints.size))
    return ImplicitGauss(newton_room(solver, model, tile, lanes), rate, np.zeros(1), np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: ImplicitGauss, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t."""
    end, room = m.unknowns * len(tile), raw(scheme.newton)
    guess.start(tile, m, room.guess, w.z, h)
    for i in range(end):
        w.before[i] = w.zdot[i]
        w.z[i] += h * w.zdot[i]
        w.a[i] = 0.0
    scheme.evaluations[0] += newton.solve(tile, m, w, room, t + h, 1.0 / (h * h), 1.0 / h)
    if dynamics.loaded(m):
        for i in range(end):
            w.before[i] = 0.5 * (w.before[i] + w.zdot[i])
        kernels.force(tile, m, w, t + h, w.z, w.before, w.stage)
        if m.driven:
            _count_drives(tile, scheme, m, w, t, h)
    return h


@njit(cache=True, error_model="numpy")
def _count_drives(tile: Tile, scheme: ImplicitGauss, m: Arrays, w: Work, t: float, h: float) -> None:
    """Take from w.power [W] what the drives supply at the mean of their rates in the last step and in this one."""
    width, c, drives = len(tile), m.constraints, m.functions
    for k in range(c.size):
        begin, finish = driven(c, drives, k, t, 0), driven(c, drives, k, dynamics.instant(w, t + h), 0)
        last = driven(c, drives, k, t, 1) if scheme.started[0] == 0.0 else scheme.rate[k]
        scheme.rate[k] = (finish - begin) / h
        for lane in range(width):
            w.power[lane] -= scheme.newton.multiplier[k * width + lane] * 0.5 * (last + scheme.rate[k])
    scheme.started[0] = 1.0


@njit(cache=True, error_model="numpy")
def forget(scheme: ImplicitGauss) -> None:
    """The drives begin with the rates that they have by then."""
    scheme.started[0] = 0.0


implement(ImplicitGauss, step, FACTS, cubic, forget)
