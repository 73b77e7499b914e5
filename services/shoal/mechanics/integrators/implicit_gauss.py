"""The implicit step of Gauss's principle: of all rates, take the one that the least constraint asks for.

v+ = argmin 1/2 |v - v~|_M^2 + U(q + h v) subject to C(q + h v) = 0, where v~ = v + h M^-1 (applied forces) is the rate
of the free motion and U the elastic energy. Its stationarity is M (v+ - v)/h + C_q' lambda = Q(q + h v+, v+):
backward Euler with position constraints. Newton's quadratic model has the metric M + h D + h^2 K.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import newton
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.newton import Newton, newton_room
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.tile import Array, Tile
from shoal.scene import Solver


class ImplicitGauss(NamedTuple):
    """Settings and room."""

    newton: Newton
    evaluations: Array


FACTS = Facts(
    order=1,
    explicit=False,
    good_for="coming to rest: it damps all vibrations, keeps joints closed and survives any step",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> ImplicitGauss:
    """Settings for one tile of lanes."""
    return ImplicitGauss(newton_room(solver, model, tile, lanes), np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: ImplicitGauss, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t."""
    for i in range(m.unknowns * len(tile)):
        w.z[i] += h * w.zdot[i]
        w.a[i] = 0.0
    scheme.evaluations[0] += newton.solve(tile, m, w, newton.raw(scheme.newton), t + h, 1.0 / (h * h), 1.0 / h)
    return h


implement(ImplicitGauss, step, FACTS, cubic)
