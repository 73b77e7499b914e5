"""The linear equations of a machine with its signals: unsymmetric parts of stiffness and damping, and their poles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from shoal.compile import function_pointers, structures
from shoal.compile.pointers import pointer
from shoal.mechanics import signals
from shoal.mechanics.dynamics import Work, derived_rows
from shoal.mechanics.independent import linearised
from shoal.mechanics.model import Arrays, Model, seen
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import SINGLE, Array, Tile
from shoal.mechanics.tangent import damping_at, stiffness_at, tangent_tile
from shoal.mechanics.workspace import at_start

_LANE = slice(0, 1)


def feedback_at(arrays: Arrays, room: Work, t: float) -> Array:
    """Return force and derivatives of every strength at the state in `room`, see `signals.feedback`; of one lane."""
    derived_rows(SINGLE, arrays, room)
    structures.write(arrays.storage, seen(arrays))
    structures.write(room.storage, room)
    _follow(arrays.table.signals, SINGLE, arrays.signals, arrays.storage, room.storage, t, room.z, room.zdot)
    return signals.feedback(arrays.followed, room.signals, arrays.force_rows)


@njit(cache=True)
def _follow(address: int, tile: Tile, s: Array, m: Array, w: Array, t: float, z: Array, zdot: Array) -> None:
    state = pointer(z), pointer(zdot), pointer(z)
    function_pointers.call(address, (tile, pointer(s), pointer(m), pointer(w), t, *state, signals.LINEARISE))


def poles(model: Model) -> npt.NDArray[np.complex128]:
    """Return the poles [1/s] of the first lane about its start, with damping by the rates that it has there.

    nan where formulas have no value there.
    """
    import scipy.linalg

    arrays, room = at_start(model, SINGLE, _LANE)
    tangent, n = tangent_tile(model, SINGLE, _LANE), model.unknowns
    stiffness, damping = (
        sparse.dense(tangent.pattern, make(SINGLE, arrays, tangent, room)) for make in (stiffness_at, damping_at)
    )
    blocks = feedback_at(arrays, room, 0.0)[:, :, :n]
    stiffness -= blocks[:, signals.FORCE].T @ blocks[:, signals.BY_PLACE]
    damping -= blocks[:, signals.FORCE].T @ blocks[:, signals.BY_RATE]
    # In the metric of the mass: states of the user have nearly none.
    inverse = np.linalg.inv(np.linalg.cholesky(sparse.dense(arrays.pattern, arrays.mass)))
    free = np.eye(n)
    if model.constraints.size:
        slopes, _ = linearised(model.constraints, model.derived, model.q0[:, 0])
        free = scipy.linalg.null_space(slopes @ inverse.T)
    stiffness, damping = (free.T @ inverse @ one @ inverse.T @ free for one in (stiffness, damping))
    nothing, one = np.zeros_like(stiffness), np.eye(len(stiffness))
    if not (np.all(np.isfinite(stiffness)) and np.all(np.isfinite(damping))):
        return np.full(2 * len(one), np.nan, dtype=complex)
    return np.asarray(np.linalg.eigvals(np.block([[nothing, one], [-stiffness, -damping]])), dtype=complex)
