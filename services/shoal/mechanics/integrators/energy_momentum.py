"""The energy-momentum step: the midpoint rule with the force that does exactly the work of the elastic energy.

Gonzalez, Time integration and discrete Hamiltonian systems, 1996, and, with constraints, Mechanical systems subject to
holonomic constraints, 1999. M (v1 - v0) = h (F - C_q' lambda), q1 - q0 = h (v0 + v1)/2, C(q1) = 0. The constraints are
quadratic, so that C_q at the midpoint is their exact difference quotient and lambda does no work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import raw
from shoal.mechanics import constraints, dynamics, kernels
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import guess, newton
from shoal.mechanics.integrators.dense import cubic
from shoal.mechanics.integrators.newton import Newton, newton_room
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver

NOISE = 1e-15
"""Relative round-off of an energy: four to five rounding errors."""


class EnergyMomentum(NamedTuple):
    """Settings and room.

    middle: the midpoint, change: what the step changes, both (rows, lanes). elastic: energy at its beginning [J],
    (lanes,).
    """

    newton: Newton
    middle: Array
    change: Array
    elastic: Array
    evaluations: Array


FACTS = Facts(
    order=2,
    explicit=False,
    sparse_constraints=True,
    seconds_per_unknown=(6e-6, 6e-6),
    conserves=True,
    mean_power=True,
    good_for="long free motion of stiff elastic machines: their energy stays what it was at any step",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> EnergyMomentum:
    """Settings for one tile of lanes."""
    rows, width = model.rows * len(tile), len(tile)
    room = newton_room(solver, model, tile, lanes)
    return EnergyMomentum(room, np.zeros(rows), np.zeros(rows), np.zeros(width), np.zeros(1))


@njit(cache=True, error_model="numpy")
def mean_force(tile: Tile, scheme: EnergyMomentum, m: Arrays, w: Work, t: float, h: float, f: Array) -> None:
    """The force of the step that led from w.before to w.z, into f: at the midpoint, corrected along the step.

    The correction c M (q1 - q0) makes the elastic force do the work U(q0) - U(q1). The mass matrix in it gives every
    coordinate its own unit; it vanishes where elements know their exact mean force (Simo and Tarnow 1992).
    """
    width = len(tile)
    end = m.unknowns * width
    middle, change = scheme.middle, scheme.change
    _halve(tile, scheme, m, w)
    kernels.elastic_force(tile, m, w, middle, f, True)
    derive(tile, m.derived, w.before, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
    dynamics.add_mean_force(tile, m, w, w.before, w.z, f)
    kernels.energies(tile, m, w)
    dynamics.multiply_mass(tile, m, change, w.stage)
    for lane in range(width):
        work, square = 0.0, 0.0
        for i in range(lane, end, width):
            work += f[i] * change[i]
            square += w.stage[i] * change[i]
        after = w.energy[width + lane]
        excess = after - scheme.elastic[lane] + work
        noise = NOISE * (abs(after) + abs(scheme.elastic[lane]))
        factor = excess / square if abs(excess) > noise and square > 0 else 0.0
        for i in range(lane, end, width):
            f[i] -= factor * w.stage[i]
    # What has no potential acts as it does half-way: the whole force less its elastic part.
    for i in range(end):
        change[i] /= h
    kernels.force(tile, m, w, t + 0.5 * h, middle, change, w.stage)
    for i in range(end):
        change[i] *= h
        f[i] += w.stage[i]
    kernels.elastic_force(tile, m, w, middle, w.stage, False)
    for i in range(end):
        f[i] -= w.stage[i]


@njit(cache=True, error_model="numpy")
def _halve(tile: Tile, scheme: EnergyMomentum, m: Arrays, w: Work) -> None:
    """The midpoint of the step that led from w.before to w.z, and what it changed."""
    for i in range(m.unknowns * len(tile)):
        scheme.middle[i] = 0.5 * (w.before[i] + w.z[i])
        scheme.change[i] = w.z[i] - w.before[i]


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: EnergyMomentum, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t."""
    width = len(tile)
    end = m.unknowns * width
    room = raw(scheme)
    residual, change = room.newton.residual, room.change
    guess.start(tile, m, room.newton.guess, w.z, h)
    kernels.energies(tile, m, w)
    for lane in range(width):
        room.elastic[lane] = w.energy[width + lane]
    for i in range(end):
        w.before[i] = w.z[i]
        w.z[i] += h * w.zdot[i]
    newton.begin(tile, m, w, room.newton, 4.0 / (h * h), 2.0 / h, False)
    iterations, limit = 0, newton.ITERATIONS
    while iterations < limit:
        iterations += 1
        mean_force(tile, room, m, w, t, h, residual)
        for i in range(end):
            change[i] = 2.0 / (h * h) * (change[i] - h * w.zdot[i])
        dynamics.multiply_mass(tile, m, change, w.stage)
        for i in range(end):
            residual[i] -= w.stage[i]
        newton.add_reactions(tile, m, w, room.newton, room.middle)
        # The unknown is the midpoint, which moves half as far as the end.
        derive(tile, m.derived, w.z, m.unknowns, m.held_rows, False)
        constraints.residual(tile, m.constraints, m.functions, dynamics.instant(w, t + h), w.z, w.gauss.gap)
        for k in range(m.constraints.size * width):
            w.gauss.gap[k] *= 0.5
        newton.correct(tile, m, w, room.newton, room.middle, 4.0 / (h * h), 2.0 / h)
        for i in range(end):
            w.z[i] += 2.0 * residual[i]
        verdict = newton.judge(tile, m, w, room.newton, iterations, limit)
        if verdict == newton.CONVERGED:
            break
        if verdict == newton.LOST:
            limit = iterations + newton.ITERATIONS
    newton.finish(tile, m, w, room.newton)
    for i in range(end):
        w.zdot[i] = 2.0 * (w.z[i] - w.before[i]) / h - w.zdot[i]
    room.evaluations[0] += iterations + 1
    kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, room.newton.rank_tolerance, w.a)
    if dynamics.loaded(m):
        _halve(tile, room, m, w)
        for i in range(end):
            change[i] /= h
        kernels.force(tile, m, w, t + 0.5 * h, room.middle, change, w.stage)
        if m.driven:
            _count_drives(tile, m, w, room.newton, t, h)
    return h


@njit(cache=True, error_model="numpy")
def _count_drives(tile: Tile, m: Arrays, w: Work, newton: Newton, t: float, h: float) -> None:
    """Take from w.power [W] the mean of what the drives supply, lambda (c(t + h) - c(t)) / h."""
    width = len(tile)
    for k in range(m.constraints.size):
        begin = constraints.driven(m.constraints, m.functions, k, t, 0)
        rate = (constraints.driven(m.constraints, m.functions, k, t + h, 0) - begin) / h
        for lane in range(width):
            w.power[lane] -= newton.multiplier[k * width + lane] * rate


implement(EnergyMomentum, step, FACTS, cubic)
