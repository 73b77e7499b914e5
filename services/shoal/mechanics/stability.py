"""The largest step an explicit integrator may take, from the highest frequency of the scene.

The frequency is that of the linearised system at the initial state, without the constraints (which
can only lower it: Rayleigh's interlacing).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from shoal.mechanics.dynamics import work_space
from shoal.mechanics.model import Model
from shoal.mechanics.sparse import Pattern
from shoal.mechanics.tangent import stiffness_at, tangent_tile
from shoal.mechanics.tile import SINGLE, Array, pack

_DENSE = 300


def highest_frequency(model: Model, lane: int = 0) -> float:
    """Highest eigenfrequency of one lane [rad/s]; 0 if nothing is elastic."""
    if model.elements == 0:
        return 0.0
    stiffness, mass = _matrices(model, lane, 0.0)
    return float(np.sqrt(max(0.0, _largest_eigenvalue(stiffness, mass))))


def highest_damping_rate(model: Model, lane: int = 0) -> float:
    """Largest decay rate of the friction at the initial state [1/s]; 0 without friction."""
    if len(model.frictions.rows) == 0:
        return 0.0
    undamped, mass = _matrices(model, lane, 0.0)
    damped, _ = _matrices(model, lane, 1.0)
    return max(0.0, _largest_eigenvalue(damped - undamped, mass))


def step_limit(model: Model, stable_step_times_frequency: float, lane: int = 0) -> float:
    """Largest stable step [s] of an explicit integrator; infinite if nothing limits it."""
    rate = max(highest_frequency(model, lane), highest_damping_rate(model, lane))
    return stable_step_times_frequency / rate if rate > 0 else np.inf


def _matrices(model: Model, lane: int, damping: float) -> tuple[scipy.sparse.csc_array, scipy.sparse.csc_array]:
    here = slice(lane, lane + 1)
    tangent = tangent_tile(model, SINGLE, here)
    arrays = model.tile(SINGLE, here)
    room = work_space(SINGLE, arrays)
    room.z[: model.unknowns] = pack(model.q0, here, SINGLE)
    values = stiffness_at(SINGLE, arrays, tangent, room, damping)
    return _symmetric(tangent.pattern, values), _symmetric(tangent.pattern, tangent.mass)


def _symmetric(pattern: Pattern, values: Array) -> scipy.sparse.csc_array:
    """The full matrix of lower-triangle slots."""
    n = pattern.size
    lower = scipy.sparse.csc_array((values[n:], pattern.row, pattern.column), shape=(n, n))
    return scipy.sparse.csc_array(lower + lower.T + scipy.sparse.diags_array(values[:n]))


def _largest_eigenvalue(matrix: scipy.sparse.csc_array, mass: scipy.sparse.csc_array) -> float:
    n = matrix.shape[0]
    if n <= _DENSE:
        top = scipy.linalg.eigh(matrix.toarray(), mass.toarray(), eigvals_only=True, subset_by_index=[n - 1, n - 1])
        return float(top[0])
    start = np.cos(np.arange(n))  # a fixed start vector, so that the same scene gives the same limit
    return float(scipy.sparse.linalg.eigsh(matrix, k=1, M=mass, which="LA", v0=start, return_eigenvectors=False)[0])
