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

from shoal.mechanics import constraints, dynamics, gauss, sparse
from shoal.mechanics import tangent as tangents
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.tangent import Tangent, tangent_tile
from shoal.mechanics.tile import Array, Tile
from shoal.mechanics.vector import pointer
from shoal.scene import Solver

ITERATIONS = 30


class GeneralizedAlpha(NamedTuple):
    """Settings, and the room that implicit steps need. auxiliary: the method's own acceleration, (unknowns, lanes)."""

    spectral_radius: float
    newton_tolerance: float
    rank_tolerance: float
    tangent: Tangent
    auxiliary: Array
    started: Array
    matrix: Array
    block: Array
    residual: Array
    multiplier: Array


FACTS = Facts(order=2, explicit=False, stable_step_times_frequency=np.inf, stable_step_times_decay=np.inf)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> GeneralizedAlpha:
    """Settings for one tile of lanes."""
    width = len(tile)
    tangent = tangent_tile(model, tile, lanes)
    return GeneralizedAlpha(
        solver.spectral_radius,
        solver.newton_tolerance,
        solver.rank_tolerance,
        tangent,
        np.zeros(model.unknowns * width),
        np.zeros(1),
        np.zeros(tangent.mass.size),
        np.zeros(max(1, 64 * model.elements) * width),
        np.zeros(model.rows * width),
        np.zeros(max(1, model.constraints.size) * width),
    )


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: GeneralizedAlpha, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step of h [s] from the time t; w.a holds the true acceleration at its beginning, and afterwards that at its end."""
    width = len(tile)
    end = m.unknowns * width
    radius = scheme.spectral_radius
    alpha_m, alpha_f = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    mass_factor = (1 - alpha_m) / (h * h * beta * (1 - alpha_f))
    damping_factor = gamma / (h * beta)

    stiffness = tangents.raw(scheme.tangent)
    auxiliary, matrix, block = pointer(scheme.auxiliary), pointer(scheme.matrix), pointer(scheme.block)
    residual, multiplier = pointer(scheme.residual), pointer(scheme.multiplier)
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

    for _ in range(ITERATIONS):
        _residual(tile, m, w, t + h, multiplier, residual)
        tangents.assemble(
            tile,
            m,
            stiffness,
            w,
            w.z,
            multiplier,
            mass_factor,
            damping_factor,
            block,
            matrix,
            scheme.matrix.size // width,
        )
        sparse.factor(tile, stiffness.pattern, matrix)
        sparse.solve(tile, stiffness.pattern, matrix, residual, 0)
        if m.constraints.size > 0:
            # H dq + C_q' dlambda = r, C_q dq = -C
            constraints.residual(tile, m.constraints, w.z, w.gauss.gap)
            gauss.prepare(tile, m, matrix, stiffness.pattern, w.z, w.gauss)
            gauss.add_rates(tile, m, w.gauss, residual)
            gauss.apply(tile, m, w.gauss, scheme.rank_tolerance, residual)
            for k in range(m.constraints.size * width):
                multiplier[k] += w.gauss.multiplier[k]
        largest = 0.0
        for i in range(end):
            w.z[i] += residual[i]
            w.zdot[i] += damping_factor * residual[i]
            w.a[i] += mass_factor * residual[i]
            if abs(residual[i]) > largest:  # a lane that is no number anymore does not keep the others waiting
                largest = abs(residual[i])
        if largest <= scheme.newton_tolerance:
            break
    for i in range(end):
        if not abs(residual[i]) <= 1e3 * scheme.newton_tolerance:
            w.z[i] = np.nan  # the iteration did not converge: the lane must not go on with a plausible number
    for i in range(end):
        auxiliary[i] += (1 - alpha_f) / (1 - alpha_m) * w.a[i]
    if m.constraints.size > 0:
        gauss.project_rates(tile, m, w.gauss, t + h, w.z, w.zdot, scheme.rank_tolerance)
    return h


@njit(cache=True, error_model="numpy")
def _residual(tile: Tile, m: Arrays, w: Work, t: float, multiplier: Array, out: Array) -> None:
    """out = Q - M a - C_q' lambda on the unknowns."""
    n = m.unknowns
    dynamics.force(tile, m, w, t, w.z, w.zdot, out)
    sparse.multiply(tile, m.pattern, m.mass, w.a, w.stage)
    for i in range(n * len(tile)):
        out[i] -= w.stage[i]
    if m.constraints.size > 0:
        constraints.jacobian(tile, m.constraints, n, w.z, w.gauss.jacobian)
        for k in range(m.constraints.size):
            for i in range(n):
                for lane in range(len(tile)):
                    out[i * len(tile) + lane] -= (
                        w.gauss.jacobian[(k * n + i) * len(tile) + lane] * multiplier[k * len(tile) + lane]
                    )


implement(GeneralizedAlpha, step)
