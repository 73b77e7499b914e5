"""What an expansion over intervals and random parameters says of the random ones alone, at given interval values.

Its coefficients of the random parameters' polynomials are polynomials of the intervals; from them mean and deviation
follow in closed form and quantiles by evaluation (Eldred, Swiler and Tang, Mixed aleatory-epistemic uncertainty
quantification with stochastic expansions and optimization-based interval estimation, Reliability Engineering and System
Safety 96, 2011).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.response.expansion import Expansion
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import Terms
from shoal.trajectory import Array

BLOCK = 4_000_000
"""Numbers that are held at once."""


@dataclass(frozen=True)
class Conditional:
    """An expansion whose interval germs are given, (places, intervals)."""

    expansion: Expansion

    @cached_property
    def intervals(self) -> Inputs:
        """The parameters that are given."""
        return self.expansion.inputs.some(~self.expansion.inputs.random)

    @cached_property
    def random(self) -> Inputs:
        """The others."""
        return self.expansion.inputs.some(self.expansion.inputs.random)

    @cached_property
    def _sorted(self) -> tuple[Terms, Terms, Array, IntArray]:
        """Terms in the random germs, each once, the constant first; those in the intervals, and the coefficients, in
        their order; where each begins.
        """
        random = self.expansion.inputs.random
        different, which = np.unique(self.expansion.terms[:, random], axis=0, return_inverse=True)
        order = np.argsort(which.ravel(), kind="stable")
        starts = np.searchsorted(which.ravel()[order], np.arange(len(different)))
        given: Terms = self.expansion.terms[:, ~random][order]
        return different, given, self.expansion.coefficients[order], starts

    @property
    def terms(self) -> Terms:
        """Degrees of the polynomials of the random germs, the constant first, (terms, random parameters)."""
        return self._sorted[0]

    def parts(self, given: Array) -> list[Array]:
        """Coefficients of these polynomials at every place, (places, columns) each."""
        _, terms, coefficients, starts = self._sorted
        basis = self.intervals.basis(given, terms)
        ends = [*starts[1:], len(terms)]
        return [basis[:, a:b] @ coefficients[a:b] for a, b in zip(starts, ends, strict=True)]

    def each(self, given: Array, columns: IntArray) -> Array:
        """Coefficients of one column at each place, (places, terms)."""
        _, terms, coefficients, starts = self._sorted
        product = self.intervals.basis(given, terms) * coefficients[:, columns].T
        return np.asarray(np.add.reduceat(product, starts, axis=1))


@dataclass(frozen=True)
class Mean:
    """The mean at interval germs."""

    of: Conditional

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        return self.of.parts(germs)[0]

    def each(self, germs: Array, columns: IntArray) -> Array:
        """(places,)."""
        return np.asarray(self.of.each(germs, columns)[:, 0])


@dataclass(frozen=True)
class Above:
    """So many standard deviations from the mean; the deviation itself where `mean` is 0."""

    of: Conditional
    deviations: float = 1.0
    mean: float = 0.0

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        first, *others = self.of.parts(germs)
        square = np.zeros_like(first)
        for part in others:
            square += part**2
        return np.asarray(self.mean * first + self.deviations * np.sqrt(square))

    def each(self, germs: Array, columns: IntArray) -> Array:
        """(places,)."""
        found = self.of.each(germs, columns)
        return np.asarray(self.mean * found[:, 0] + self.deviations * np.sqrt((found[:, 1:] ** 2).sum(axis=1)))


@dataclass(frozen=True)
class Share:
    """Share that some terms have of the variance of the random parameters at interval germs: a Sobol index.

    counted: the terms, without the constant, (terms - 1,); nothing: a variance beside which there is none to share,
    (columns,); other: the share that is told where that is so, (columns,)
    """

    of: Conditional
    counted: BoolArray
    nothing: Array
    other: Array

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        squares = np.array([part**2 for part in self.of.parts(germs)[1:]])
        return self._share(squares[self.counted].sum(axis=0), squares.sum(axis=0), slice(None))

    def each(self, germs: Array, columns: IntArray) -> Array:
        """(places,)."""
        squares = self.of.each(germs, columns)[:, 1:] ** 2
        return self._share(squares[:, self.counted].sum(axis=1), squares.sum(axis=1), columns)

    def _share(self, part: Array, whole: Array, columns: IntArray | slice) -> Array:
        nothing = self.nothing[columns]
        return np.asarray((part + nothing * self.other[columns]) / (whole + nothing))


@dataclass(frozen=True)
class Quantile:
    """A quantile at interval germs, from the same random germs everywhere; drawn: basis there, (draws, terms)."""

    of: Conditional
    share: float
    drawn: Array

    def each(self, germs: Array, columns: IntArray) -> Array:
        """(places,)."""
        found = self.of.each(germs, columns)
        block = max(1, BLOCK // len(self.drawn))
        parts = [
            np.quantile(self.drawn @ found[k : k + block].T, self.share, axis=0) for k in range(0, len(found), block)
        ]
        return np.concatenate(parts)
