"""Newton's iteration of the implicit steps: the sparsely factored tangent, constraints by their multipliers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import constraints, dynamics, gates
from shoal.mechanics import tangent as tangents
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.least import implicit
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.tangent import Tangent, tangent_tile
from shoal.scene import Solver

ITERATIONS = 30
SLACK = 1e3
"""A step that misses the tolerance by more than this factor has failed."""


class Newton(NamedTuple):
    """Settings and room. tolerance: last change of a coordinate [m].

    matrix: the factored tangent, (slots, lanes). block: tangents of the elements. residual: the force that is out
    of balance, then the change of the coordinates, (rows, lanes). multiplier: lambda, kept from step to step,
    (constraints, lanes). The kernels take it with pointers (`raw`).
    """

    tolerance: float
    rank_tolerance: float
    tangent: Tangent
    slots: int
    matrix: Array
    block: Array
    residual: Array
    multiplier: Array


def newton_room(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Newton:
    """Settings and room for one tile of lanes."""
    width = len(tile)
    tangent = tangent_tile(model, tile, lanes)
    return Newton(
        solver.newton_tolerance,
        solver.rank_tolerance,
        tangent,
        tangent.pattern.slots,
        np.zeros(tangent.mass.size),
        np.zeros(2 * tangent.blocks * width + 1),
        np.zeros(model.rows * width),
        np.zeros(max(1, model.constraints.size) * width),
    )


@njit(cache=True, error_model="numpy")
def add_reactions(tile: Tile, m: Arrays, w: Work, newton: Newton, z: Array) -> None:
    """residual -= C_q(z)' lambda. Leaves C_q in w.gauss.jacobian."""
    if m.constraints.size > 0:
        derive(tile, m.derived, z, m.unknowns, m.held_rows, False)
        constraints.jacobian(tile, m.constraints, z, 1.0, w.gauss.jacobian)
        constraints.subtract_transposed(tile, m.constraints, w.gauss.jacobian, newton.multiplier, newton.residual)


@njit(cache=True, error_model="numpy")
def correct(
    tile: Tile, m: Arrays, w: Work, newton: Newton, z: Array, mass_factor: float, damping_factor: float
) -> None:
    """Solve H dq + C_q' dlambda = residual, C_q dq = -gap: the residual becomes dq, the multipliers are updated.

    H = mass_factor M + damping_factor D + K + curvature of the constraints at z, whose derived rows are filled;
    gap: w.gauss.gap.
    """
    pattern = newton.tangent.pattern
    tangents.assemble(
        tile,
        m,
        newton.tangent,
        w,
        z,
        newton.multiplier,
        mass_factor,
        damping_factor,
        newton.block,
        newton.matrix,
        newton.slots,
    )
    sparse.factor(tile, pattern, newton.matrix)
    sparse.solve(tile, pattern, newton.matrix, newton.residual, 0)
    if m.constraints.size > 0:
        implicit.prepare(tile, m, newton.matrix, pattern, z, w.gauss)
        implicit.add_rates(tile, m, w.gauss, newton.residual)
        implicit.apply(tile, m, w.gauss, newton.rank_tolerance, newton.residual)
        for k in range(m.constraints.size * len(tile)):
            newton.multiplier[k] += w.gauss.multiplier[k]


@njit(cache=True, error_model="numpy")
def largest_change(tile: Tile, m: Arrays, newton: Newton) -> float:
    """Largest change of a coordinate in any lane; a lane that is no number anymore does not keep the others waiting."""
    largest = 0.0
    for i in range(m.unknowns * len(tile)):
        if abs(newton.residual[i]) > largest:
            largest = abs(newton.residual[i])
    return largest


@njit(cache=True, error_model="numpy")
def mark_failures(tile: Tile, m: Arrays, w: Work, newton: Newton) -> None:
    """A lane whose iteration did not converge must not go on with a plausible number: it becomes nan."""
    for i in range(m.unknowns * len(tile)):
        if not abs(newton.residual[i]) <= SLACK * newton.tolerance:
            w.z[i] = np.nan


@njit(cache=True, error_model="numpy")
def solve(tile: Tile, m: Arrays, w: Work, newton: Newton, t: float, mass_factor: float, damping_factor: float) -> int:
    """Find the end of a step at the time t: M a + C_q' lambda = Q(q, v, t), C(q) = 0; returns the iterations.

    The method ties rates and accelerations to coordinates: dv = damping_factor dq, da = mass_factor dq. w holds the
    first guess, then the solution. The power that is left in w is that of the last guess; see `take_power`.
    """
    residual = newton.residual
    end = m.unknowns * len(tile)
    iterations = 0
    t = dynamics.instant(w, t)
    while iterations < ITERATIONS:
        iterations += 1
        gates.force(tile, m, w, t, w.z, w.zdot, residual)
        sparse.multiply(tile, m.pattern, m.mass, w.a, w.stage)
        for i in range(end):
            residual[i] -= w.stage[i]
        add_reactions(tile, m, w, newton, w.z)
        constraints.residual(tile, m.constraints, m.functions, t, w.z, w.gauss.gap)
        correct(tile, m, w, newton, w.z, mass_factor, damping_factor)
        for i in range(end):
            w.z[i] += residual[i]
            w.zdot[i] += damping_factor * residual[i]
            w.a[i] += mass_factor * residual[i]
        if largest_change(tile, m, newton) <= newton.tolerance:
            break
    mark_failures(tile, m, w, newton)
    return iterations


@njit(cache=True, error_model="numpy")
def take_power(tile: Tile, m: Arrays, w: Work, newton: Newton, t: float) -> None:
    """w.power [W] of loads and drives at the end of a step at the time t; uses w.stage.

    The last correction, however small beside the machine, may be all that small forces did in a short step.
    """
    if dynamics.loaded(m):
        t = dynamics.instant(w, t)
        gates.force(tile, m, w, t, w.z, w.zdot, w.stage)
        if m.driven:
            constraints.add_power(tile, m.constraints, m.functions, t, newton.multiplier, w.power)
