"""A polynomial in the germs, fitted to runs: the surrogate of most methods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.inputs import Inputs
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

RANK = 1e-13
"""A direction that runs tell of less than this is left out."""
SOLE = 1e-6
"""Of one: a run with an influence above this share is taken for one with this share."""


@dataclass(frozen=True)
class Expansion:
    """Call it with germs, (places, parameters): the answers there, (places, columns).

    terms: degrees, (terms, parameters); coefficients: of the orthonormal products, (terms, columns); left_out: error at
    each run of the fit to all others, root of the mean square, (columns,)
    """

    inputs: Inputs
    terms: Terms
    coefficients: Array
    left_out: Array

    def __call__(self, germs: Array) -> Array:
        """The answers at these germs."""
        return np.asarray(self.inputs.basis(germs, self.terms) @ self.coefficients)

    def each(self, germs: Array, columns: IntArray) -> Array:
        """One column at each germ, (places,): as cheap as one answer instead of all."""
        return np.asarray(np.einsum("ij,ji->i", self.inputs.basis(germs, self.terms), self.coefficients[:, columns]))

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
    if len(germs) >= len(terms) and diagonal.min() > RANK * diagonal.max():
        coefficients = solve_triangular(r, q.T @ values)
    else:
        coefficients = np.linalg.lstsq(basis, values, rcond=RANK)[0]
    # A run that decides about a term by itself has all of the influence on its own misfit.
    influence = (q**2).sum(axis=1, keepdims=True)
    left_out = (values - basis @ coefficients) / np.maximum(1 - influence, SOLE)
    return Expansion(inputs, terms, np.asarray(coefficients), np.sqrt(np.mean(left_out**2, axis=0)))
