"""Vectors and constraints of a machine in space at its coordinates, before they have rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.terms import Mesh, Term
from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.numerics.tile import Array


def of_lane(rows: Array, lane: int) -> Array:
    """A column of (rows, lanes) or (rows, 1)."""
    return np.asarray(rows[:, lane if rows.shape[1] > 1 else 0])


def at(vector: Affine, q: Array, lane: int) -> Array:
    """A vector at the coordinates (unknowns,) or (unknowns, lanes) of a lane, (3,)."""
    column = q if q.ndim == 1 else of_lane(q, lane)
    unknowns, coefficients, constants = vector.by_lane
    own = min(lane, len(constants) - 1)
    return np.asarray(constants[own] + column[unknowns] @ coefficients[own])


def everywhere(vector: Affine, q: Array) -> Array:
    """A vector in all lanes, (3, lanes)."""
    total = vector.constant
    for unknown, coefficient in vector.terms.items():
        total = total + coefficient * q[unknown]
    return total


def slopes(term: Term | Mesh, q: Array, lane: int) -> Iterator[tuple[int, float]]:
    """Unknowns and derivatives of a constraint at the coordinates of a lane; those of an unknown add up."""
    if isinstance(term, Mesh):
        for factor, vector in term.parts:
            x, y, _ = at(vector, q, lane)
            yield from _along(vector, factor / float(x * x + y * y) * np.array([-y, x, 0.0]), lane)
        return
    u, w = (at(vector, q, lane) for vector in (term.u, term.w))
    for vector, other in ((term.u, term.form @ w), (term.w, term.form.T @ u)):
        yield from _along(vector, other, lane)


def jacobian(terms: Sequence[Term | Mesh], q: Array, lane: int) -> Array:
    """Derivatives of constraints by the coordinates (unknowns,) or (unknowns, lanes) of a lane, (terms, unknowns)."""
    found = np.zeros((len(terms), len(q)))
    for row, term in zip(found, terms, strict=True):
        for unknown, slope in slopes(term, q, lane):
            row[unknown] += slope
    return found


def uncancelled(term: Term, q: Array) -> float:
    """The length that the row of a constraint would have in the first lane if nothing in it were at right angles."""
    u, w = (at(vector, q, 0) for vector in (term.u, term.w))
    squares = 0.0
    for vector, other in ((term.u, term.form @ w), (term.w, term.form.T @ u)):
        squares += float(np.sum(vector.by_lane[1][0] ** 2) * (other @ other))
    return float(np.sqrt(squares)) + 1e-300


def _along(vector: Affine, direction: Array, lane: int) -> Iterator[tuple[int, float]]:
    """Unknowns of a vector, and what each of them moves it along a direction (3,)."""
    unknowns, coefficients, _ = vector.by_lane
    return zip(unknowns, (coefficients[min(lane, len(coefficients) - 1)] @ direction).tolist(), strict=True)


def values_of(term: Term, q: Array) -> Array:
    """A constraint at time zero in all lanes, (lanes,)."""
    u, w = everywhere(term.u, q), everywhere(term.w, q)
    drive = 0.0 if term.drive is None else start_value(term.drive)
    return np.atleast_1d(np.sum(u * (term.form @ w), axis=0) + term.constant + drive)


def value_of(term: Term, q: Array, lane: int) -> float:
    """A constraint at time zero at the coordinates (unknowns,) of a lane."""
    constant = np.atleast_1d(term.constant)
    drive = 0.0 if term.drive is None else start_value(term.drive)
    u, w = at(term.u, q, lane), at(term.w, q, lane)
    return float(u @ term.form @ w + constant[min(lane, constant.size - 1)] + drive)


def drive_rate(term: Term | Mesh) -> float:
    """The rate of a constraint's function of time at time zero."""
    return 0.0 if term.drive is None else start_slope(term.drive)
