"""A study as methods see it, what they return, and the interface of surrogates: a plan of runs and a fit to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from shoal.errors import InputError
from shoal.response.extremes import Surrogate
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import size
from shoal.response.runs import CachedModel, Model
from shoal.trajectory import Array

FINE_GAP = 1e-6
"""The gap that is aimed at where none is asked for, as a share of the width: the last digit of printed bounds."""
ROUNDING = 1e-11
"""A spread below this share of the answers is none."""
LEAST = 18
"""Runs that a study may take without further reason, at least."""
FAIR = 1.4
"""And for every term of a polynomial of degree four. By `python -m shoal_validation.uncertain.fair`, 16 studies of two
to four intervals: with 1.0 or 1.2 the gap (quantile of 75 %) is seven to nine times as large for 5 to 8 % fewer runs,
with 2.0 it is 0.8 of it for a third more.
"""
SAFETY = 3.0
"""Factor on an error that was observed at a few runs (convention: three standard deviations)."""
CLEARLY = 0.5
"""Share of an error below which another one is clearly smaller (convention: a factor of two)."""
CONVERGED = 1e-4
"""Error, as a share of the standard deviation, at which a statistic has converged: the fourth digit."""
COARSE = 0.05
"""Error, as a share of the standard deviation, above which an expansion gives way to the runs themselves."""
RUNS = 300
"""Runs of a polynomial chaos unless it is coarse by then."""
PER_TERM = 1.25
"""Runs for every term of a polynomial at designed places, at least; with one parameter as many as terms will do."""


def share_of(part: Array, whole: Array) -> Array:
    """Return parts as shares of what they are parts of, elementwise; zero of nothing."""
    return np.divide(part, whole, out=np.zeros(np.broadcast_shapes(np.shape(part), np.shape(whole))), where=whole > 0)


def fair_runs(terms: int) -> int:
    """Return the runs that a study may take without further reason; terms: of a polynomial of degree four."""
    return max(LEAST, int(FAIR * terms))


@dataclass(frozen=True)
class Study:
    """A question to a method.

    gap: how far outer bounds may lie from attained ones, as a share of the largest width of their group, None: as
    little as a fair number of runs gives; degree, count: of a method that has one, None: its own choice; groups: of
    every column, which of them have one width (a marker's coordinate at all instants), (columns,); instants: of every
    column [s], (columns,); over_time: the same model at other instants, (samples,), with columns (samples, signals),
    where there is one; then the columns of the study are (instants, signals) too
    """

    runs: CachedModel
    groups: IntArray
    instants: Array
    seed: int = 0
    gap: float | None = None
    degree: int | None = None
    count: int | None = None
    over_time: Callable[[Array], Model] | None = None

    @cached_property
    def when(self) -> Array:
        """The different instants [s]."""
        return np.unique(self.instants)

    @property
    def inputs(self) -> Inputs:
        """The parameters."""
        return self.runs.inputs

    @property
    def has_events(self) -> bool:
        """Return whether runs have words of events."""
        return bool(getattr(self.runs.model, "touches", False))

    @property
    def fair(self) -> int:
        """Runs that a study may take without further reason: some more than a polynomial of degree four has terms."""
        return fair_runs(size(len(self.inputs), 4))

    def widths(self, values: Array) -> Array:
        """Return the largest width of the envelope of these answers in each group, (columns,)."""
        return self.largest(values.max(axis=0) - values.min(axis=0), values)

    def largest(self, spread: Array, values: Array) -> Array:
        """The largest of each group, (columns,); zero where it is the rounding of these answers."""
        largest, size = np.zeros((2, self.groups.max() + 1))
        np.maximum.at(largest, self.groups, spread)
        np.maximum.at(size, self.groups, np.abs(values).max(axis=0))
        return np.where(largest > ROUNDING * size, largest, 0.0)[self.groups]

    def with_neighbours(self, error: Array) -> Array:
        """The largest of each instant and its neighbours in the same group, (columns,).

        Where runs happen to be predicted well, others need not be.
        """
        found = error.copy()
        order = np.lexsort((self.instants, self.groups))
        one, next_one = order[:-1], order[1:]
        same = self.groups[one] == self.groups[next_one]
        one, next_one = one[same], next_one[same]
        found[one] = np.maximum(found[one], error[next_one])
        found[next_one] = np.maximum(found[next_one], error[one])
        return found

    def intervals_only(self, method: str) -> None:
        """Check that no parameter is random. Raises InputError."""
        self._only(method, ~self.inputs.random, "an interval", "PATH=LOW:HIGH")

    def random_only(self, method: str) -> None:
        """Check that no parameter is an interval. Raises InputError."""
        self._only(method, self.inputs.random, "a distribution", "PATH~normal(MEAN,SD)")

    def _only(self, method: str, fits: BoolArray, wanted: str, form: str) -> None:
        if not fits.all():
            name = self.inputs.names[int(np.argmin(fits))]
            raise InputError(f"vary: method {method} needs {wanted} for {name}, such as {form}")


class Other(Protocol):
    """Transformation that predicts some columns better than an expansion."""

    def __call__(self, xi: Array) -> Array:
        """Answers at any place without a run, (places, columns)."""
        ...

    def indices(self) -> Array:
        """First and total ones of Sobol, (2, parameters, columns), of parameters that do not correlate."""
        ...


class TransformedMoments(Protocol):
    """Moments of all columns, and transformations that predict some of them better than an expansion."""

    @property
    def links(self) -> Sequence[tuple[IntArray, Other]]:
        """These columns, (n,), and their transformations."""
        ...

    @property
    def mean(self) -> Array:
        """Mean of all columns, (columns,)."""
        ...

    @property
    def variance(self) -> Array:
        """Variance of all columns, (columns,)."""
        ...

    @property
    def left_out(self) -> Array:
        """Error at runs that are left out of the fit, root of the mean square, (columns,)."""
        ...

    @property
    def squares(self) -> Array:
        """The same of squares, see `Expansion`, (columns,)."""
        ...


@dataclass(frozen=True)
class Ends:
    """Extremes of answers, or of their statistics, over intervals.

    lower, upper: attained, (columns,); lower_outer, upper_outer: none is expected beyond, nan where that is not known,
    (columns,); at_lower, at_upper: values of the parameters there, (columns, parameters)
    """

    lower: Array
    upper: Array
    lower_outer: Array
    upper_outer: Array
    at_lower: Array
    at_upper: Array

    @property
    def widest(self) -> tuple[Array, Array]:
        """Return the outer bounds; the extremes of runs where none are known."""
        low, high = self.lower_outer, self.upper_outer
        return np.where(np.isnan(low), self.lower, low), np.where(np.isnan(high), self.upper, high)

    def widened(self, off: Array) -> Self:
        """Return the same with outer bounds that lie so much further out, (columns,)."""
        return replace(self, lower_outer=self.lower_outer - off, upper_outer=self.upper_outer + off)

    def columns(self, which: slice) -> Ends:
        """Return some of the columns."""
        return Ends(*(getattr(self, field.name)[which] for field in fields(Ends)))

    def with_columns(self, which: IntArray, part: Ends) -> Ends:
        """Return the same with other values in some columns, (n,)."""
        values = {name: np.array(of) for name, of in vars(self).items()}
        for name, of in vars(part).items():
            values[name][which] = of
        return Ends(**values)


@dataclass(frozen=True)
class Enclosure:
    """Attained and outer bounds, (columns,); gap: their distance as a share of the width of the group, (columns,)."""

    lower: Array
    upper: Array
    lower_outer: Array
    upper_outer: Array
    gap: Array

    @classmethod
    def of(cls, study: Study, low: Array, high: Array) -> Enclosure:
        """Return what the runs of a study attain within outer bounds, which hold at least these, (columns,) each."""
        values = study.runs.values
        lower, upper = values.min(axis=0), values.max(axis=0)
        low, high = np.minimum(lower, low), np.maximum(upper, high)
        return cls(lower, upper, low, high, share_of(np.maximum(lower - low, high - upper), study.widths(values)))


@dataclass(frozen=True)
class DatedEnclosure:
    """Bounds, and the number of runs that they follow from."""

    runs: int
    enclosure: Enclosure


@dataclass(frozen=True)
class Found:
    """Result of a method beside its runs.

    surrogate: of the answers, if it made one; error: what that is off by at runs it had not seen, (columns,); why: what
    it did, in words; indices: first and total Sobol indices by sampling, (2, parameters, columns);
    quantiles: that take the place of those of the runs, (levels, columns);
    errors: within which mean and deviation lie with 95 % confidence, (columns,) each;
    coarse: columns whose statistics are those of the runs, because the surrogate is not good enough there, (columns,);
    transformed: predicts some columns better than the surrogate; enclosed: its bounds, where the method knows them;
    drawn: of the last runs so many alone are drawn from the distributions, None: all are
    """

    why: str
    surrogate: Surrogate | None = None
    error: Array | None = None
    indices: Array | None = None
    coarse: BoolArray | None = None
    of_cycles: bool = False
    share: float = 0.0
    quantiles: Array | None = None
    errors: tuple[Array, Array] | None = None
    transformed: TransformedMoments | None = None
    enclosed: DatedEnclosure | None = None
    drawn: int | None = None


Method = Callable[[Study], Found]


@dataclass(frozen=True)
class Plan:
    """Runs of a surrogate and its fit.

    places: standardised variables of the runs, (runs, parameters), from -1 to 1; fit: to the runs that did not fail;
    about: both in words. The error of the surrogate is estimated from further runs, alike for all of them
    """

    places: Array
    fit: Callable[[Study], Surrogate]
    about: str


def fitted(name: str, plan: Callable[[Study], Plan]) -> Method:
    """Return the method of that name for intervals. It raises InputError and ComputationError."""

    def method(study: Study) -> Found:
        study.intervals_only(name)
        planned = plan(study)
        study.runs(planned.places)
        return Found(planned.about, planned.fit(study))

    return method
