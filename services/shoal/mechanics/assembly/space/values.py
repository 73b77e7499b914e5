"""Affine vectors in one lane, and the scale of a constraint row."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.terms import Term


def of_lane(rows: Array, lane: int) -> Array:
    """A column of (rows, lanes) or (rows, 1)."""
    return np.asarray(rows[:, lane if rows.shape[1] > 1 else 0])


def at(vector: Affine, q: Array, lane: int) -> Array:
    """A vector at the coordinates (unknowns,) or (unknowns, lanes) of a lane, (3,)."""
    column = q if q.ndim == 1 else of_lane(q, lane)
    unknowns, coefficients, constants = vector.by_lane
    own = min(lane, len(constants) - 1)
    return np.asarray(constants[own] + column[unknowns] @ coefficients[own])


def uncancelled(term: Term, q: Array) -> float:
    """The length that the row of a constraint would have in the first lane if nothing in it were at right angles."""
    u, w = (at(vector, q, 0) for vector in (term.u, term.w))
    squares = 0.0
    for vector, other in ((term.u, term.form @ w), (term.w, term.form.T @ u)):
        squares += float(np.sum(vector.by_lane[1][0] ** 2) * (other @ other))
    return float(np.sqrt(squares)) + 1e-300
