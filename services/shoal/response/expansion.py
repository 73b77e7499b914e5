"""Polynomial expansions in the standardised variables, fitted to runs by least squares: the surrogate of most methods.

The degree is that of the least leave-one-out error, column by column. Hermite polynomials of high
degree have most of their variance further out than any run, where nothing else constrains them: the outermost runs,
which the others predict, show some of it, and the standard deviation at places as far out as runs go shows the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import Terms, size, total_degree
from shoal.response.study import Study, share_of
from shoal.trajectory import Array

RANK = 1e-13
"""Relative singular value below which a direction is left out: rounding of a least-squares fit."""
SOLE = 1e-6
"""Complement of the leverage of a run that determines a term by itself, at least."""


@dataclass(frozen=True)
class Expansion:
    """Call it with standardised variables, (places, parameters): the answers there, (places, columns).

    terms: degrees, (terms, parameters); coefficients: of the orthonormal products, (terms, columns); left_out: error at
    each run of the fit to all others, root of the mean square, (columns,); squares: the same of the squares of what
    differs from the mean, over twice the deviation, (columns,); whole: whether the runs determine all of its terms: if
    not, what is left out says nothing of the undetermined ones
    """

    inputs: Inputs
    terms: Terms
    coefficients: Array
    left_out: Array
    squares: Array | None = None
    whole: bool = True

    def __call__(self, xi: Array) -> Array:
        """The answers at these places."""
        return np.asarray(self.inputs.basis(xi, self.terms) @ self.coefficients)

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,): as cheap as one answer instead of all."""
        # Without a search, the compiler is not loaded.
        from shoal.response.one_column import one_column

        highest, terms, coefficients = self._laid
        return np.asarray(one_column(self.inputs.table(xi, highest), terms, coefficients, columns))

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
        """Mean over all parameters, (columns,)."""
        return np.asarray(self.coefficients[0])

    @property
    def variance(self) -> Array:
        """Variance over all parameters, (columns,)."""
        return np.asarray((self.coefficients[1:] ** 2).sum(axis=0))


def fit(inputs: Inputs, xi: Array, values: Array, terms: Terms) -> Expansion:
    """The expansion nearest to these runs in the sense of least squares."""
    basis = inputs.basis(xi, terms)
    q, r = np.linalg.qr(basis)
    diagonal = np.abs(np.diag(r))
    whole = bool(len(xi) >= len(terms) and diagonal.min() > RANK * diagonal.max())
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
    return np.sqrt(np.mean(missed**2, axis=0)), share_of(squares, 2 * deviation)


HIGHEST_TRIED = 20
"""Degree up to which expansions are tried."""
WORSE = 2
"""Degrees in a row that no column gains by, after which no higher one is tried."""


def choose_degree(study: Study, share: float, assess: Callable[[Expansion], Expansion]) -> Expansion:
    """Fit an expansion of `degree`, or of each column's best degree that the runs carry.

    judged: an expansion with what else is known of its error
    """
    runs, parameters = study.runs, len(study.inputs)
    highest = study.inputs.highest(HIGHEST_TRIED)
    known: Expansion | None = None
    worse = 0
    for degree in [study.degree] if study.degree else range(1, HIGHEST_TRIED + 1):
        if known is not None and share * size(parameters, degree) > len(runs.xi):
            break
        terms = total_degree(parameters, degree)
        found = assess(fit(study.inputs, runs.xi, runs.values, terms[(terms <= highest).all(axis=1)]))
        if known is None:
            known = found
            continue
        better = found.left_out < known.left_out
        known = found.where(better, known)
        worse = 0 if better.any() else worse + 1
        if worse == WORSE:
            break
    assert known is not None
    return known


OUTER = 0.06
"""Share of the runs that are taken for the outermost."""
PROBED = 1024
"""Places at which the deviation is evaluated."""
MISSED = 0.05
"""Share of a deviation that so few places may miss."""


def outermost(inputs: Inputs, xi: Array) -> BoolArray:
    """Return which runs lie outermost, (runs,); none where all variables are bounded, or all runs lie as far out."""
    far = np.abs(xi[:, inputs.unbounded]).max(axis=1, initial=0.0)
    outer = np.asarray(far >= np.sort(far)[-max(1, int(OUTER * len(far)))])
    return outer & inputs.unbounded.any() & ~outer.all()


def outwards(xi: Array, values: Array, found: Expansion) -> Expansion:
    """Return an expansion whose error includes that of the outermost runs, predicted by a fit to all others."""
    outer = outermost(found.inputs, xi)
    if not outer.any():
        return found
    basis = found.inputs.basis(xi, found.terms)
    coefficients_inside = np.linalg.lstsq(basis[~outer], values[~outer], rcond=None)[0]
    missed = basis[outer] @ coefficients_inside - values[outer]
    beyond = np.sqrt((missed**2).sum(axis=0) / len(xi))
    return replace(found, left_out=np.maximum(found.left_out, beyond))


def hidden(coefficients: Array, inputs: Inputs, terms: Terms) -> Array:
    """Part of the deviation in closed form that places as far out as runs go do not show, (columns,); 0 where it is no
    more than these places may miss.

    coefficients: of the terms, the constant first, (columns, terms)
    """
    seen = (inputs.basis(inputs.sobol(PROBED, 0), terms) @ coefficients.T).std(axis=0)
    apart = np.abs(np.sqrt((coefficients[:, 1:] ** 2).sum(axis=1)) - seen)
    return np.where(apart > MISSED * seen, apart, 0.0)
