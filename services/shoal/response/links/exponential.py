"""The exponential of an expansion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import qmc

from shoal.response.expansion import Expansion
from shoal.response.indices import designs, jansen
from shoal.response.inputs import BoolArray, IntArray, inside
from shoal.response.links.combined import REACH, nodes
from shoal.response.links.link import Fitted, of, some
from shoal.response.study import Study
from shoal.trajectory import Array

TILTED = 2**13
"""Places at which what has no closed form is sampled for a moment."""
DRAWN = 2**12
"""And for shares, for every parameter."""
REACHED = 5.0
"""Deviations of a normal variable; what is further out is told by no run."""
BEYOND = 1e-3
"""Share of the deviation that may lie there."""


@dataclass(frozen=True)
class Exponential:
    """exp of an expansion, with a sign, (columns,); seed: of what is sampled."""

    logarithm: Expansion
    signs: Array
    seed: int
    text = "an expansion of their logarithm"

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        return np.asarray(self.signs * np.exp(self.logarithm(germs)))

    def again(self, study: Study, fitted: Fitted) -> Exponential:
        """For other runs."""
        return _exponential(study, fitted)

    @property
    def mean(self) -> Array:
        """(columns,)."""
        return np.asarray(self.signs * self._moments[0])

    @property
    def variance(self) -> Array:
        """(columns,)."""
        return self._moments[1]

    @property
    def beyond(self) -> Array:
        """What places far out along a parameter add, (columns,), if it is something."""
        whole, near = (np.sqrt(second / first**2 - 1) for first, second in map(self._products, (REACH, REACHED)))
        apart = np.sqrt(self.variance) * np.abs(1 - np.divide(near, whole, out=np.ones_like(near), where=whole > 0))
        return np.where(apart > BEYOND * np.sqrt(self.variance), apart, 0.0)

    def some(self, which: BoolArray) -> Exponential:
        """In some of its columns."""
        of = self.logarithm
        squares = None if of.squares is None else of.squares[which]
        logarithm = replace(of, coefficients=of.coefficients[:, which], left_out=of.left_out[which], squares=squares)
        return Exponential(logarithm, self.signs[which], self.seed)

    def indices(self) -> Array:
        """In closed form for the functions of one parameter each; what others add is sampled."""
        inputs, (first, second) = self.logarithm.inputs, self._parts(REACH)
        own = second / first**2
        whole = np.prod(own, axis=0)
        variance = np.maximum(whole - 1, 1e-300)
        found = np.array([(own - 1) / variance, 1 - (whole / own - 1) / variance])
        if self._cross.any():
            places = designs(inputs, DRAWN, self.seed)
            parts = [self._split(part) for part in np.split(places, len(inputs) + 2)]
            alone, together = (np.concatenate(one) for one in zip(*parts, strict=True))
            found += jansen(together, len(inputs)) - jansen(alone, len(inputs))
        return found

    @cached_property
    def _moments(self) -> tuple[Array, Array]:
        """Mean and variance without the sign."""
        first, second = self._products(REACH)
        if self._cross.any():
            first, second = first * self._others(1), second * self._others(2)
        size = np.exp(self.logarithm.coefficients[0])
        return size * first, size**2 * np.maximum(second - first**2, 0.0)

    def _products(self, reach: float) -> Array:
        """Mean and mean square of the exponential of all functions of one parameter, (2, columns)."""
        return np.asarray(np.prod(self._parts(reach), axis=1))

    def _others(self, order: int) -> Array:
        """By how much terms of several parameters multiply the mean of this power, (columns,).

        It is sampled where the functions of one parameter have most of that mean.
        """
        of, found = self.logarithm, np.empty(len(self.signs))
        x = inside(qmc.Sobol(len(of.inputs), rng=self.seed).random(TILTED))
        plain = of.inputs.germs(x)
        for column in range(len(found)):
            germs = plain.copy()
            for k in range(len(of.inputs)):
                if (own := self._own(k)).any():
                    at, weights = nodes(of.inputs, k, REACH)
                    weights = weights * np.exp(order * self._basis(k, at) @ of.coefficients[own, column])
                    # The middle of each step, so that places lie on either side of its node.
                    germs[:, k] = np.interp(x[:, k], (np.cumsum(weights) - 0.5 * weights) / weights.sum(), at)
            cross = of.inputs.basis(germs, of.terms[self._cross]) @ of.coefficients[self._cross, column]
            found[column] = np.exp(order * cross).mean()
        return found

    def _parts(self, reach: float) -> Array:
        """Mean and mean square of the exponentials of the functions of one parameter, (2, parameters, columns)."""
        inputs = self.logarithm.inputs
        found = np.ones((2, len(inputs), len(self.signs)))
        for k in range(len(inputs)):
            if (own := self._own(k)).any():
                germs, weights = nodes(inputs, k, reach)
                part = np.exp(self._basis(k, germs) @ self.logarithm.coefficients[own])
                found[:, k] = weights @ part, weights @ part**2
        return found

    def _own(self, k: int) -> BoolArray:
        """Terms of parameter k alone."""
        return np.asarray(self._alone & (self.logarithm.terms[:, k] > 0))

    def _basis(self, k: int, germs: Array) -> Array:
        """Polynomials of these terms at germs of parameter k, (germs, terms)."""
        degrees = self.logarithm.terms[self._own(k), k]
        return self.logarithm.inputs.polynomials(k, germs, int(degrees.max()))[:, degrees]

    def _split(self, places: Array) -> tuple[Array, Array]:
        """The exponential of the functions of one parameter, and of all but the constant, (places, columns) each."""
        of = self.logarithm
        alone, cross = (
            of.inputs.basis(places, of.terms[which]) @ of.coefficients[which] for which in (self._alone, self._cross)
        )
        return np.exp(alone), np.exp(alone + cross)

    @property
    def _alone(self) -> BoolArray:
        """Terms of one parameter."""
        return np.asarray((self.logarithm.terms > 0).sum(axis=1) == 1)

    @property
    def _cross(self) -> BoolArray:
        """Terms of several."""
        return np.asarray((self.logarithm.terms > 0).sum(axis=1) > 1)


def _exponential(study: Study, fitted: Fitted) -> Exponential:
    values = study.runs.values
    logarithms = of(study, study.inputs, study.runs.germs, np.log(np.abs(values)))
    return Exponential(fitted(logarithms), np.sign(values[0]), len(values))


def exponentials(
    study: Study, found: Expansion, wanted: IntArray, fitted: Fitted
) -> Sequence[tuple[IntArray, Exponential]]:
    """Of the columns with one sign."""
    values = study.runs.values[:, wanted]
    columns = wanted[(values > 0).all(axis=0) | (values < 0).all(axis=0)]
    return [(columns, _exponential(some(study, columns), fitted))] if len(columns) else []
