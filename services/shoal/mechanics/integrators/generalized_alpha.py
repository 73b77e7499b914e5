"""Generalized-alpha: implicit, second order, with position constraints and the tangent stiffness.

Chung and Hulbert 1993; with constraints as in Arnold and Bruels, Convergence of the generalized-alpha
scheme for constrained mechanical systems, 2007. The spectral radius at infinity sets the damping of
frequencies that the step does not resolve. After each step the rates are projected onto C_q v = 0 in
the mass metric, which keeps a radius of one usable with constraints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import raw
from shoal.mechanics import dynamics, kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import guess, newton
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.newton import Newton, newton_room
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver


class GeneralizedAlpha(NamedTuple):
    """Settings and room. auxiliary: the method's own acceleration, (unknowns, lanes)."""

    spectral_radius: float
    newton: Newton
    auxiliary: Array
    started: Array
    evaluations: Array


FACTS = Facts(
    order=2,
    explicit=False,
    sparse_constraints=True,
    warm_lanes=True,
    seconds_per_unknown=(6e-6, 6e-6),
    good_for="stiff elastic machines at steps that do not resolve their fast vibrations, damped as one wishes",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> GeneralizedAlpha:
    """Settings for one tile of lanes."""
    room = newton_room(solver, model, tile, lanes)
    auxiliary = np.zeros(model.unknowns * len(tile))
    return GeneralizedAlpha(solver.spectral_radius, room, auxiliary, np.zeros(1), np.zeros(1))


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: GeneralizedAlpha, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t; w.a holds the true acceleration before and after."""
    end = m.unknowns * len(tile)
    radius = scheme.spectral_radius
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    mass_factor = (1 - alpha_m) / (h * h * beta * (1 - alpha_f))
    damping_factor = gamma / (h * beta)

    auxiliary, room = raw(scheme).auxiliary, raw(scheme.newton)
    guess.start(tile, m, room.guess, w.z, h)
    if scheme.started[0] == 0.0:
        scheme.started[0] = 1.0
        for i in range(end):
            auxiliary[i] = w.a[i]
    for i in range(end):
        predicted = (alpha_f * w.a[i] - alpha_m * auxiliary[i]) / (1 - alpha_m)
        w.z[i] += h * w.zdot[i] + h * h * ((0.5 - beta) * auxiliary[i] + beta * predicted)
        w.zdot[i] += h * ((1 - gamma) * auxiliary[i] + gamma * predicted)
        auxiliary[i] = predicted
        w.a[i] = 0.0
    scheme.evaluations[0] += newton.solve(tile, m, w, room, t + h, mass_factor, damping_factor)
    newton.take_power(tile, m, w, room, t + h)
    for i in range(end):
        auxiliary[i] += (1 - alpha_f) / (1 - alpha_m) * w.a[i]
    if m.constraints.size > 0:
        for i in range(end):
            w.before[i] = w.zdot[i]
        now = dynamics.instant(w, t + h)
        kernels.project_rates(tile, m, w, now, scheme.newton.rank_tolerance)
        if m.driven:
            _count_impulse(tile, m, w, h)
    return h


@njit(cache=True, error_model="numpy")
def _count_impulse(tile: Tile, m: Arrays, w: Work, h: float) -> None:
    """Take from w.power [W] what the drives supply where the rates w.before are projected: the change of v'Mv/2.

    The multipliers alone are off by the first order in h, and the projection makes up for it.
    """
    width = len(tile)
    end = m.unknowns * width
    for i in range(end):
        w.before[i] = w.zdot[i] - w.before[i]
    dynamics.multiply_mass(tile, m, w.before, w.stage)
    for i in range(end):
        w.power[i % width] -= (w.zdot[i] - 0.5 * w.before[i]) * w.stage[i] / h


@njit(cache=True, error_model="numpy")
def forget(scheme: GeneralizedAlpha) -> None:
    """The auxiliary acceleration begins as the true one."""
    scheme.started[0] = 0.0


implement(GeneralizedAlpha, step, FACTS, cubic, forget)
