"""Marginal knowledge of one parameter: an interval, or a distribution.

Methods work in the standardised variable s of a parameter: its place in [-1, 1] for intervals and uniform
distributions, the standard normal variable for normal and lognormal ones, the standardised value for others (arbitrary
polynomial chaos: Oladyshkin and Nowak, Reliability Engineering and System Safety 106, 2012).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy import special

from shoal.response.polynomials import HERMITE, LEGENDRE, Recurrence, of_measure
from shoal.trajectory import Array

QUADRATURE = 32, 64
"""Gauss points in each part, and parts of the probability, that a measure is integrated over."""


class Marginal(Protocol):
    """Interface of the knowledge of a parameter."""

    @property
    def random(self) -> bool:
        """Return whether it has a distribution."""
        ...

    @property
    def text(self) -> str:
        """Text as the user wrote it."""
        ...

    @property
    def basis(self) -> Recurrence:
        """Polynomials in the standardised variable that are orthonormal under its measure."""
        ...

    @property
    def tolerance(self) -> float:
        """Half the width of an interval, the standard deviation of a distribution."""
        ...

    def quantile(self, x: Array) -> Array:
        """The standardised variable at probabilities x in (0, 1)."""
        ...

    def value(self, s: Array) -> Array:
        """The parameter at standardised variables s."""
        ...


@dataclass(frozen=True)
class Interval:
    """Interval between two bounds, of which no more is known."""

    low: float
    high: float
    text: str = ""
    random = False
    basis = LEGENDRE

    @property
    def tolerance(self) -> float:
        """Half the width."""
        return 0.5 * (self.high - self.low)

    def quantile(self, x: Array) -> Array:
        """Return quantiles of the uniform distribution over [-1, 1]."""
        return np.asarray(2 * x - 1)

    def value(self, s: Array) -> Array:
        """The bounds at -1 and 1, to the last bit."""
        within = 0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * s
        return np.where(s == -1, self.low, np.where(s == 1, self.high, within))


@dataclass(frozen=True)
class Uniform(Interval):
    """Uniform distribution between two bounds."""

    random = True

    @property
    def tolerance(self) -> float:
        """The standard deviation."""
        return (self.high - self.low) / math.sqrt(12)


@dataclass(frozen=True)
class Normal:
    """A normal distribution of the value or, `logarithmic`, of its logarithm."""

    mean: float
    deviation: float
    text: str = ""
    logarithmic: bool = False
    random = True
    basis = HERMITE

    @property
    def tolerance(self) -> float:
        """The standard deviation of the value."""
        if not self.logarithmic:
            return self.deviation
        return math.exp(self.mean + 0.5 * self.deviation**2) * math.sqrt(math.expm1(self.deviation**2))

    def quantile(self, x: Array) -> Array:
        """The standard normal variable."""
        return np.asarray(special.ndtri(x))

    def value(self, s: Array) -> Array:
        """Mean and deviation are those of the normal variable."""
        normal = self.mean + self.deviation * s
        return np.exp(normal) if self.logarithmic else np.asarray(normal)


@dataclass(frozen=True)
class Frozen:
    """Any distribution of scipy, or another object with `ppf`, `mean` and `std`."""

    distribution: Any
    text: str = ""
    random = True

    @cached_property
    def _scale(self) -> tuple[float, float]:
        return float(self.distribution.mean()), float(self.distribution.std())

    @property
    def tolerance(self) -> float:
        """The standard deviation."""
        return self._scale[1]

    @cached_property
    def basis(self) -> Recurrence:
        """Orthonormal polynomials, by quadrature over the probability."""
        points, parts = QUADRATURE
        nodes, weights = np.polynomial.legendre.leggauss(points)
        # Finer towards both ends, where quantiles change fastest.
        edges = 0.5 * (1 + np.sin(0.5 * np.pi * np.linspace(-1, 1, parts + 1)))
        half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
        x = (middle[:, None] + half[:, None] * nodes).ravel()
        return of_measure(self.quantile(x), (half[:, None] * weights).ravel())

    def quantile(self, x: Array) -> Array:
        """The standardised value."""
        mean, deviation = self._scale
        return np.asarray((self._ppf(x) - mean) / deviation)

    def _ppf(self, x: Array) -> Array:
        return np.asarray(self.distribution.ppf(x))

    def value(self, s: Array) -> Array:
        """The value."""
        mean, deviation = self._scale
        return np.asarray(mean + deviation * s)


@dataclass(frozen=True)
class Empirical(Frozen):
    """Observed values, each as likely as another. distribution: the observations, (n,)."""

    @cached_property
    def basis(self) -> Recurrence:
        """Polynomials orthonormal over the observations."""
        mean, deviation = self._scale
        return of_measure(
            (self.distribution - mean) / deviation, np.full(len(self.distribution), 1 / len(self.distribution))
        )

    def _ppf(self, x: Array) -> Array:
        count = len(self.distribution)
        return np.asarray(np.sort(self.distribution)[np.minimum((np.asarray(x) * count).astype(int), count - 1)])


@dataclass(frozen=True)
class Scaled:
    """A distribution drawn together, or apart, about its median."""

    marginal: Marginal
    factor: float
    random = True

    @property
    def text(self) -> str:
        """Description."""
        return f"{self.marginal.text} scaled by {self.factor:g}"

    @property
    def basis(self) -> Recurrence:
        """Orthonormal polynomials of the distribution."""
        return self.marginal.basis

    @property
    def tolerance(self) -> float:
        """The standard deviation."""
        return self.factor * self.marginal.tolerance

    def quantile(self, x: Array) -> Array:
        """Return quantiles of the standardised distribution."""
        return self.marginal.quantile(x)

    def value(self, s: Array) -> Array:
        """The value."""
        median = self.marginal.value(self.marginal.quantile(np.array([0.5])))
        return np.asarray(median + self.factor * (self.marginal.value(s) - median))


def scaled(marginal: Marginal, factor: float) -> Marginal:
    """An interval or a distribution with its width, or that of the logarithm, multiplied about its middle."""
    if isinstance(marginal, Interval):
        middle, half = 0.5 * (marginal.low + marginal.high), 0.5 * (marginal.high - marginal.low) * factor
        low, high = middle - half, middle + half
        kind = "uniform({:g},{:g})" if marginal.random else "{:g}:{:g}"
        return replace(marginal, low=low, high=high, text=kind.format(low, high))
    if isinstance(marginal, Normal):
        name = "the logarithm normal" if marginal.logarithmic else "normal"
        deviation = marginal.deviation * factor
        return replace(marginal, deviation=deviation, text=f"{name}({marginal.mean:g},{deviation:g})")
    return Scaled(marginal, factor)
