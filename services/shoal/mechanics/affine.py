"""Points and directions of bodies as affine functions of the coordinates.

A coordinate is a real unknown, its coefficient a vector of R^d. Constraints that are linear in them are eliminated by
substitution: a point shared by two bodies, a direction kept by a weld, a place on a fixed line (one unknown). They
need no multiplier and have no drift.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shoal.mechanics import plane
from shoal.mechanics.numerics.tile import Array, Index, Number

if TYPE_CHECKING:
    import scipy.sparse

NEGLIGIBLE = 1e-12
"""Coefficients of unit vectors, and places in parts of the machine's size, that are round-off: some thousand eps."""


def is_zero(value: Number) -> bool:
    """Return whether a coefficient vanishes in every lane."""
    return not np.any(value)


@dataclass(frozen=True)
class Affine:
    """constant + sum of coefficient * unknown; the unknowns are numbered.

    Coefficients and constant are vectors (d, lanes), or (d, 1) where they do not depend on the lane.
    """

    terms: Mapping[int, Array]
    constant: Array

    def __add__(self, other: Affine) -> Affine:
        terms = dict(self.terms)
        for unknown, coefficient in other.terms.items():
            terms[unknown] = terms[unknown] + coefficient if unknown in terms else coefficient
        kept = {unknown: coefficient for unknown, coefficient in terms.items() if not is_zero(coefficient)}
        return Affine(kept, self.constant + other.constant)

    def __mul__(self, factor: Number) -> Affine:
        return Affine({unknown: c * factor for unknown, c in self.terms.items()}, self.constant * factor)

    def __sub__(self, other: Affine) -> Affine:
        return self + other * -1.0

    @property
    def rests(self) -> bool:
        """Return whether the vector depends on the coordinates by no more than round-off."""
        return all(np.max(np.abs(coefficient)) <= NEGLIGIBLE for coefficient in self.terms.values())

    def turned(self, matrix: Array) -> Affine:
        """The vector mapped by a matrix, (d, d) or (d, d, lanes)."""
        matrix = matrix if matrix.ndim == 3 else matrix[..., None]
        return Affine({unknown: mapped(matrix, c) for unknown, c in self.terms.items()}, mapped(matrix, self.constant))

    @cached_property
    def own(self) -> tuple[int, ...] | None:
        """The d unknowns that are the components of this vector, if it is just that."""
        if len(self.terms) != len(self.constant) or not is_zero(self.constant):
            return None
        axes = np.eye(len(self.constant))[..., None]
        same = all(np.all(c == axis) for c, axis in zip(self.terms.values(), axes, strict=True))
        return tuple(self.terms) if same else None

    @cached_property
    def by_lane(self) -> tuple[list[int], Array, Array]:
        """The unknowns, their coefficients (lanes or 1, unknowns, d) and the constant (lanes or 1, d)."""
        parts = [self.constant, *self.terms.values()]
        lanes = max(part.shape[1] for part in parts)
        whole = np.stack([np.broadcast_to(part.T, (lanes, part.shape[0])) for part in parts], axis=1)
        return list(self.terms), whole[:, 1:], whole[:, 0]

    def at(self, q: Array) -> Array:
        """Its value at coordinates, (d,), of a machine of one lane."""
        return sum((c[:, 0] * q[unknown] for unknown, c in self.terms.items()), self.constant[:, 0])

    def rate(self, v: Array) -> Array:
        """Its rate of change at rates of the coordinates, (d,)."""
        return sum((c[:, 0] * v[unknown] for unknown, c in self.terms.items()), 0.0 * self.constant[:, 0])


def mapped(matrix: Array, u: Array) -> Array:
    """Return the product of a matrix (d, d, lanes) and a vector (d, lanes)."""
    return np.stack([sum(entry * part for entry, part in zip(row, u, strict=True)) for row in matrix])


def fixed(value: Array) -> Affine:
    """Return a constant vector, (d, lanes)."""
    return Affine({}, value)


def combined(vectors: tuple[Affine, ...], factors: tuple[Number, ...]) -> Affine:
    """Return a linear combination of vectors, without the unknowns of those whose factor is zero."""
    total = fixed(0.0 * vectors[0].constant)
    for one, factor in zip(vectors, factors, strict=True):
        if np.any(factor):
            total = total + one * factor
    return total


@dataclass(frozen=True)
class Points:
    """Vectors that are affine in the coordinates: sparse rows (vectors * d, unknowns) and constant (vectors, d)."""

    rows: scipy.sparse.csr_array
    constant: Array

    @cached_property
    def matrix(self) -> Array:
        """The rows as an array, (vectors, d, unknowns)."""
        return np.asarray(self.rows.toarray().reshape(*self.constant.shape, -1))

    def at(self, q: Array) -> Array:
        """The vectors at the coordinates q, (vectors, d)."""
        return self.moved(q) + self.constant

    def moved(self, move: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """How the vectors change with a displacement of the coordinates, real or complex, (vectors, d)."""
        return np.asarray(self.rows @ move).reshape(self.constant.shape)

    def turning(self, q: Array) -> Array:
        """Return the derivatives of the angles [rad] of directions at q, about z, (vectors, unknowns)."""
        now = self.at(q)[:, :2]
        x, y = self.matrix.transpose(1, 0, 2)[:2]
        return np.asarray(plane.cross(now.T[..., None], (x, y)) / np.sum(now**2, axis=1)[:, None])


def points(vectors: Sequence[Affine], unknowns: int, lane: int = 0) -> Points:
    """Vectors of a placement as one matrix, in one of its lanes."""
    import scipy.sparse

    dimensions = len(vectors[0].constant) if vectors else plane.DIMENSIONS
    constant = np.zeros((len(vectors), dimensions))
    entries, columns, ends = [np.zeros((0, dimensions))], list[int](), [0]
    for k, vector in enumerate(vectors):
        constant[k] = vector.constant[:, lane % vector.constant.shape[1]]
        entries += [c[None, :, lane % c.shape[1]] for c in vector.terms.values()]
        columns += vector.terms
        ends.append(len(columns))
    # Entry p of vector k stands in d rows, one for each component.
    number = np.repeat(np.arange(len(vectors)), np.diff(ends))
    rows = dimensions * number[:, None] + np.arange(dimensions)
    where = rows.ravel(), np.repeat(np.array(columns, dtype=np.int64), dimensions)
    size = len(vectors) * dimensions, unknowns
    matrix = scipy.sparse.csr_array((np.concatenate(entries).ravel(), where), shape=size)
    matrix.eliminate_zeros()
    return Points(matrix, constant)


def matrices(vectors: Sequence[Affine], unknowns: int, lanes: Index) -> tuple[Array, Array]:
    """Return matrices (lanes or 1, vectors, d, unknowns) and constants (lanes or 1, vectors, d) of vectors.

    lanes: numbers of those of the placement that are wanted; 1 where all have the same
    """
    parts = [part.shape[1] for vector in vectors for part in (vector.constant, *vector.terms.values())]
    count = len(lanes) if max(parts, default=1) > 1 else 1
    dimensions = len(vectors[0].constant) if vectors else plane.DIMENSIONS
    matrix = np.zeros((count, len(vectors), dimensions, unknowns))
    constant = np.zeros((count, len(vectors), dimensions))
    for k, vector in enumerate(vectors):
        constant[:, k] = _of_lanes(vector.constant, lanes).T
        for unknown, coefficient in vector.terms.items():
            matrix[:, k, :, unknown] += _of_lanes(coefficient, lanes).T
    return matrix, constant


def _of_lanes(u: Array, lanes: Index) -> Array:
    return u if u.shape[1] == 1 else u[:, lanes % u.shape[1]]
