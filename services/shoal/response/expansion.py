"""A polynomial in the germs, fitted to runs: the surrogate of most methods."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

RANK = 1e-13
"""A direction that runs tell of less than this is left out."""
SOLE = 1e-6
"""Of one: a run with an influence above this share is taken for one with this share."""


@dataclass(frozen=True)
class Expansion:
    """Call it with germs, (places, parameters): the answers there, (places, columns).

    terms: degrees, (terms, parameters); coefficients: of the orthonormal products, (terms, columns); left_out: error at
    each run of the fit to all others, root of the mean square, (columns,); squares: the same of the squares of what
    differs from the mean, over twice the deviation, (columns,); whole: whether the runs tell all of its terms: if not,
    what is left out says nothing of what none of them tells
    """

    inputs: Inputs
    terms: Terms
    coefficients: Array
    left_out: Array
    squares: Array | None = None
    whole: bool = True

    def __call__(self, germs: Array) -> Array:
        """The answers at these germs."""
        return np.asarray(self.inputs.basis(germs, self.terms) @ self.coefficients)

    def each(self, germs: Array, columns: IntArray) -> Array:
        """One column at each germ, (places,): as cheap as one answer instead of all."""
        # Where nobody searches, the compiler is not loaded.
        from shoal.response.one_column import one_column

        highest, terms, coefficients = self._laid
        return np.asarray(one_column(self.inputs.table(germs, highest), terms, coefficients, columns))

    @cached_property
    def _laid(self) -> tuple[IntArray, Terms, Array]:
        """Highest degrees, (parameters,), terms and coefficients, as the compiled kernel wants them."""
        highest: IntArray = self.terms.max(axis=0)
        return highest, np.ascontiguousarray(self.terms), np.ascontiguousarray(self.coefficients)

    def where(self, better: BoolArray, other: Expansion) -> Expansion:
        """This one in some columns, (columns,), the other elsewhere; without terms that no column has."""
        terms, which = np.unique(np.vstack([self.terms, other.terms]), axis=0, return_inverse=True)
        coefficients = np.zeros((len(terms), len(better)))
        mine, others = np.split(which.ravel(), [len(self.terms)])
        coefficients[mine] = np.where(better, self.coefficients, 0.0)
        coefficients[others] += np.where(better, 0.0, other.coefficients)
        used = np.asarray(coefficients.any(axis=1))
        used[0] = True
        squares = None
        if self.squares is not None and other.squares is not None:
            squares = np.where(better, self.squares, other.squares)
        left_out = np.where(better, self.left_out, other.left_out)
        return Expansion(self.inputs, terms[used], coefficients[used], left_out, squares)

    @property
    def mean(self) -> Array:
        """Over all parameters, (columns,)."""
        return np.asarray(self.coefficients[0])

    @property
    def variance(self) -> Array:
        """Over all parameters, (columns,)."""
        return np.asarray((self.coefficients[1:] ** 2).sum(axis=0))


def fit(inputs: Inputs, germs: Array, values: Array, terms: Terms) -> Expansion:
    """The expansion nearest to these runs in the sense of least squares."""
    basis = inputs.basis(germs, terms)
    q, r = np.linalg.qr(basis)
    diagonal = np.abs(np.diag(r))
    whole = bool(len(germs) >= len(terms) and diagonal.min() > RANK * diagonal.max())
    coefficients = solve_triangular(r, q.T @ values) if whole else np.linalg.lstsq(basis, values, rcond=RANK)[0]
    # A run that decides about a term by itself has all of the influence on its own misfit.
    influence = (q**2).sum(axis=1, keepdims=True)
    left_out, squares = unexplained(values, (values - basis @ coefficients) / np.maximum(1 - influence, SOLE))
    return Expansion(inputs, terms, np.asarray(coefficients), left_out, squares, whole)


def unexplained(values: Array, missed: Array) -> tuple[Array, Array]:
    """`left_out` and `squares` of an expansion, from what fits to all other runs miss of each, (runs, columns)."""
    away = values - values.mean(axis=0)
    squares = np.sqrt(np.mean((away**2 - (away - missed) ** 2) ** 2, axis=0))
    deviation = np.sqrt(np.mean(away**2, axis=0))
    off = np.divide(squares, 2 * deviation, out=np.zeros_like(squares), where=deviation > 0)
    return np.sqrt(np.mean(missed**2, axis=0)), np.asarray(off)
