"""Stability limit of explicit integrators: the largest step, from the highest frequency and decay rate of the machine.

They are those of the equations linearised at the initial state (Hughes, The Finite Element Method, 2000, section
9.1), without the constraints, which can only lower them (Rayleigh's interlacing theorem).
"""

from __future__ import annotations

import numpy as np

from shoal.mechanics.closed_loop import poles
from shoal.mechanics.dynamics import work_space
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.model import Model
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.sparse import Pattern
from shoal.mechanics.numerics.tile import Array, pack, tiles, unpack
from shoal.mechanics.tangent import damping_at, stiffness_at, tangent_tile

_DENSE = 200
"""Unknowns up to which the dense eigenproblem is solved, as the import of Lanczos's method takes longer."""
_ACCURACY = 1e-6
"""Relative error of an eigenvalue by Lanczos's method: along the motion it changes by more."""
_SAME = 1e-5
"""Relative difference of the matrices of two lanes that count as one."""


def highest_frequency(model: Model) -> float:
    """Highest eigenfrequency over all lanes [rad/s]; 0 if nothing is elastic."""
    if not model.elastic:
        return 0.0
    return float(np.sqrt(max(0.0, _largest_eigenvalue(model, damping=False))))


def highest_damping_rate(model: Model) -> float:
    """Largest decay rate of friction and damping at the initial state, over all lanes [1/s]."""
    if model.forces.size == 0 and not any(family.damped for family in model.elements):
        return 0.0
    return max(0.0, _largest_eigenvalue(model, damping=True))


def step_limit(model: Model, facts: Facts) -> float:
    """Largest stable step [s] of an integrator for every lane; infinite if nothing limits it."""
    if not facts.explicit:
        return np.inf
    frequency, decay = highest_frequency(model), highest_damping_rate(model)
    oscillation = facts.stable_step_times_frequency / frequency if frequency > 0 else np.inf
    passive = min(oscillation, facts.stable_step_times_decay / decay if decay > 0 else np.inf)
    return min(passive, _closed_loop(model, facts)) if model.signals and model.unknowns <= _DENSE else passive


def _closed_loop(model: Model, facts: Facts) -> float:
    """Largest stable step [s] for the poles of the machine with its feedback, in the first lane.

    Regions of stability are about ellipses with half axes along the frequencies and the rates of decay.
    """
    found = poles(model)
    if not np.all(np.isfinite(found)):
        return np.inf  # a formula without a value at the start, which the run tells
    decay = np.minimum(found.real, 0.0) / facts.stable_step_times_decay
    fastest = np.max(np.hypot(decay, found.imag / facts.stable_step_times_frequency), initial=0.0)
    return float(1.0 / fastest) if fastest > 0.0 else np.inf


def _largest_eigenvalue(model: Model, damping: bool) -> float:
    """Largest eigenvalue of K (or of the damping D) against M, over all lanes that differ in more than their start."""
    tile, parts = tiles(model.lanes if model.varies else 1)
    largest = 0.0
    for part in parts:
        tangent = tangent_tile(model, tile, part)
        arrays = model.tile(tile, part)
        room = work_space(tile, arrays)
        room.z[: model.unknowns * len(tile)] = pack(model.q0, part, tile)
        values = (damping_at if damping else stiffness_at)(tile, arrays, tangent, room)
        matrix, mass = unpack(values, part, tile), unpack(tangent.mass, part, tile)
        lanes = _different(matrix, mass)
        largest = max(largest, _top(tangent.pattern, matrix[:, lanes], mass[:, lanes]))
    return largest


def _different(matrix: Array, mass: Array) -> list[int]:
    """Return one lane of each group with nearly equal matrices, as those of finite differences are."""
    both = np.concatenate(
        [matrix / np.max(np.abs(matrix), initial=1e-300), mass / np.max(np.abs(mass), initial=1e-300)]
    )
    found: list[int] = []
    for lane in range(both.shape[1]):
        if np.all(np.max(np.abs(both[:, found] - both[:, [lane]]), axis=0, initial=0.0) > _SAME):
            found.append(lane)
    return found


def _top(pattern: Pattern, matrix: Array, mass: Array) -> float:
    """Largest eigenvalue of A x = lambda M x over lanes, both symmetric in the slots of a pattern, (slots, lanes)."""
    n, lanes = pattern.size, np.flatnonzero(np.any(matrix, axis=0))
    if not lanes.size:
        return 0.0
    if n <= _DENSE:
        stiff, heavy = (np.array([sparse.dense(pattern, one[:, k]) for k in lanes]) for one in (matrix, mass))
        lower = np.linalg.inv(np.linalg.cholesky(heavy))
        return float(np.max(np.linalg.eigvalsh(lower @ stiff @ lower.transpose(0, 2, 1))[:, -1]))
    import scipy.sparse.linalg

    start = np.cos(np.arange(n))  # a fixed start vector, so that the same scene gives the same limit
    tops = [
        scipy.sparse.linalg.eigsh(
            sparse.matrix(pattern, matrix[:, k]),
            k=1,
            M=sparse.matrix(pattern, mass[:, k]),
            which="LA",
            v0=start,
            tol=_ACCURACY,
            return_eigenvectors=False,
        )[0]
        for k in lanes
    ]
    return float(max(tops))
