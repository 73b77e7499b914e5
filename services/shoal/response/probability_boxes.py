"""Statistics that are known between bounds only, because some parameters are intervals: probability boxes.

Ferson, Kreinovich, Ginzburg, Myers and Sentz, Constructing probability boxes and Dempster-Shafer structures, Sandia
National Laboratories SAND2002-4015, 2003. An expansion over intervals and random parameters has, at given interval
values, coefficients of the random parameters' polynomials that are polynomials of the intervals; from them mean and
standard deviation follow in closed form and quantiles by evaluation (Eldred, Swiler and Tang, Mixed aleatory-epistemic
uncertainty quantification with stochastic expansions and optimization-based interval estimation, Reliability
Engineering and System Safety 96, 2011).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from shoal.response.expansion import Expansion
from shoal.response.extremes import HELD, MOST_CORNERS, Each, Extremes, along, corners, extremes
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.polynomials import Terms
from shoal.response.runs import TimeIsUpError
from shoal.response.statistics import DRAWN, QUANTILES
from shoal.response.study import COARSE, FINE_GAP, SAFETY, Ends, Found, Study, share_of
from shoal.trajectory import Array


@dataclass(frozen=True)
class Conditional:
    """An expansion whose interval variables are given, (places, intervals)."""

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
        """Terms in the random variables, each once, the constant first; those in the intervals, and the
        coefficients, in their order; where each begins.
        """
        random = self.expansion.inputs.random
        different, which = np.unique(self.expansion.terms[:, random], axis=0, return_inverse=True)
        order = np.argsort(which.ravel(), kind="stable")
        starts = np.searchsorted(which.ravel()[order], np.arange(len(different)))
        given: Terms = self.expansion.terms[:, ~random][order]
        return different, given, self.expansion.coefficients[order], starts

    @property
    def terms(self) -> Terms:
        """Degrees of the polynomials of the random variables, the constant first, (terms, random parameters)."""
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
    """The mean at interval variables."""

    of: Conditional

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        return self.of.parts(xi)[0]

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        return np.asarray(self.of.each(xi, columns)[:, 0])


@dataclass(frozen=True)
class Above:
    """Multiple of the standard deviation above the mean; the deviation itself where `mean` is 0."""

    of: Conditional
    deviations: float = 1.0
    mean: float = 0.0

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        first, *others = self.of.parts(xi)
        square = np.zeros_like(first)
        for part in others:
            square += part**2
        return np.asarray(self.mean * first + self.deviations * np.sqrt(square))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        found = self.of.each(xi, columns)
        return np.asarray(self.mean * found[:, 0] + self.deviations * np.sqrt((found[:, 1:] ** 2).sum(axis=1)))


@dataclass(frozen=True)
class Share:
    """Share that some terms have of the variance of the random parameters at interval xi: a Sobol index.

    counted: the terms, without the constant, (terms - 1,); nothing: a variance beside which there is none to share,
    (columns,); other: the share to return where that is so, (columns,)
    """

    of: Conditional
    counted: BoolArray
    nothing: Array
    other: Array

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        squares = np.array([part**2 for part in self.of.parts(xi)[1:]])
        return self._share(squares[self.counted].sum(axis=0), squares.sum(axis=0), slice(None))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        squares = self.of.each(xi, columns)[:, 1:] ** 2
        return self._share(squares[:, self.counted].sum(axis=1), squares.sum(axis=1), columns)

    def _share(self, part: Array, whole: Array, columns: IntArray | slice) -> Array:
        nothing = self.nothing[columns]
        return np.asarray((part + nothing * self.other[columns]) / (whole + nothing))


@dataclass(frozen=True)
class Quantile:
    """A quantile at given intervals, from the same random variables everywhere; drawn: basis there, (draws, terms)."""

    of: Conditional
    share: float
    drawn: Array

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        found = self.of.each(xi, columns)
        block = max(1, HELD // len(self.drawn))
        parts = [
            np.quantile(self.drawn @ found[k : k + block].T, self.share, axis=0) for k in range(0, len(found), block)
        ]
        return np.concatenate(parts)


SEARCHED = 1024
"""Places at which an expansion is evaluated while extremes of its quantiles are sought."""
GRID = {1: 33, 2: 9, 3: 5}
"""Places along each axis at which quantiles are evaluated, by the number of intervals."""
ELSE = 64
"""Quasi-random ones where there are more intervals."""
STEPS = 0.1, 0.02
"""Of the search from the best of them."""
BEYOND_HOPE = 0.1
"""Instants whose gap is above this share of the scatter lie beyond the horizon."""
NOTHING = 0.01
"""Of the largest deviation: at interval values with less, the shares of that are not evaluated."""
LITTLE = 0.1
"""Share of the largest deviation to which its error is related at instants where it is smaller."""
INTERVAL_VALUES, RUNS_EACH = 8, 128
"""Interval values that are sampled beyond it, and runs at each."""


@dataclass(frozen=True, eq=False)
class ProbabilityBoxes:
    """names: of the intervals; mean, std, quantiles: of every column, where those of quantiles are what the expansion
    estimates, so that only their outer bounds are to be printed; gap: the largest distance between outer bounds
    and extremes within the horizon, as a share of the scatter (the largest spread of the mean and deviation together);
    horizon: the last instant up to which they are known [s], infinite if they always are; places, inner: interval
    values that were sampled beyond it, and runs at each; shares: of each random parameter the least and the largest
    first and total Sobol index, (2 indices, 2 sides, random parameters, columns), nan beyond the horizon, where nothing
    varies, of parameters that correlate, and where inner studies give the deviation; std_gap: the same distance as
    `gap` for the deviation alone, as a share of the deviation (see `std_gap`)
    """

    names: tuple[str, ...]
    mean: Ends
    std: Ends
    quantiles: tuple[Ends, ...]
    gap: float
    horizon: float
    places: int = 0
    inner: int = 0
    shares: Array | None = None
    std_gap: float = 0.0

    def named(self) -> dict[str, Ends]:
        """Return every statistic by its name."""
        return {"mean": self.mean, "std": self.std, **dict(zip(map(_level, QUANTILES), self.quantiles, strict=True))}


def _level(share: float) -> str:
    return f"q{share:g}"


def boxes_of(study: Study, found: Found) -> ProbabilityBoxes:
    """Return the boxes of an expansion over all parameters and its error. Raises TimeIsUpError where there is none."""
    if not isinstance(found.surrogate, Expansion) or found.error is None:
        raise TimeIsUpError
    of, error = Conditional(found.surrogate), SAFETY * found.error
    count = len(error)
    sides = [extremes(one, len(of.intervals), count, study.seed) for one in (Mean(of), Above(of))]
    sides[1] = replace(sides[1], lower=np.maximum(sides[1].lower, 0.0))
    mean, std = (_ends(of.intervals, one, error) for one in sides)
    std = replace(std, lower_outer=np.maximum(std.lower_outer, 0.0))
    ends_of = _quantiles(of, sides, error, study.seed)
    scale = scatter(study, *sides)
    gap = share_of(error, scale)
    first = study.instants[gap > max(study.gap or 0.0, BEYOND_HOPE)].min(initial=math.inf)
    end = math.inf if math.isinf(first) else float(study.instants[study.instants < first].max(initial=0.0))
    within = gap[study.instants <= end]
    largest = float(within.max()) if within.size else math.nan
    shares = _shares(of, study, sides[1])
    shares[..., study.instants > end] = np.nan
    apart = std_gap(study, std, end)
    return ProbabilityBoxes(
        tuple(of.intervals.names), mean, std, tuple(ends_of), largest, end, shares=shares, std_gap=apart
    )


def _std_gaps(study: Study, std: Ends) -> Array:
    """Distance of outer bounds of the deviation from attained ones, as a share of the deviation, (columns,)."""
    off = np.maximum(std.lower - std.lower_outer, std.upper_outer - std.upper)
    scale = np.maximum(std.upper, LITTLE * study.largest(std.upper, study.runs.values))
    # A deviation that is nothing compared with what the answers differ by is none.
    some = std.upper_outer > FINE_GAP * study.widths(study.runs.values)
    return np.divide(off, scale, out=np.zeros_like(off), where=(scale > 0) & some)


def coarse(study: Study, std: Ends) -> BoolArray:
    """Return where the error of the deviation is too large a share of it, (columns,)."""
    return np.asarray(_std_gaps(study, std) > COARSE)


def std_gap(study: Study, std: Ends, horizon: float) -> float:
    """The largest distance of outer bounds from attained ones within the horizon, as a share of the deviation."""
    return float(_std_gaps(study, std)[study.instants <= horizon].max(initial=0.0))


def _shares(of: Conditional, study: Study, std: Extremes) -> Array:
    """Least and largest Sobol indices, see `ProbabilityBoxes`.

    Where the deviation is next to nothing beside its largest they are those over all interval values together.
    """
    random, columns = of.random, len(std.upper)
    found = np.full((2, 2, len(random), columns), np.nan)
    varies = study.largest(std.upper, study.runs.values) > 0
    if random.correlations:
        return found
    expansion, nothing = of.expansion, (NOTHING * std.upper) ** 2
    among = expansion.terms[:, expansion.inputs.random]
    whole = np.maximum(_variance(expansion, np.asarray(among.any(axis=1))), 1e-300)
    for k in range(len(random)):
        own = of.terms[1:, k] > 0
        alone = own & (np.delete(of.terms[1:], k, axis=1).sum(axis=1) == 0)
        own_all = among[:, k] > 0
        alone_all = own_all & (np.delete(among, k, axis=1).sum(axis=1) == 0)
        for index, (counted, all_of) in enumerate(((alone, alone_all), (own, own_all))):
            if not counted.any():
                continue
            one = Share(of, counted, np.maximum(nothing, 1e-300), _variance(expansion, all_of) / whole)
            ends = extremes(one, len(of.intervals), columns, study.seed, rough=True)
            found[index, 0, k, varies], found[index, 1, k, varies] = ends.lower[varies], ends.upper[varies]
    return found


def _variance(found: Expansion, counted: BoolArray) -> Array:
    """Return the variance of some terms, (columns,)."""
    return np.asarray((found.coefficients[counted] ** 2).sum(axis=0))


def scatter(study: Study, mean: Extremes, std: Extremes) -> Array:
    """Return the largest spread of mean and deviation over the intervals in each group, (columns,)."""
    return study.largest(mean.upper - mean.lower + np.maximum(std.upper, 0.0), study.runs.values)


def _ends(intervals: Inputs, found: Extremes, off: Array) -> Ends:
    return Ends(
        *(found.lower, found.upper, found.lower - off, found.upper + off),
        *(intervals.named(found.at_lower), intervals.named(found.at_upper)),
    )


def _quantiles(of: Conditional, sides: list[Extremes], error: Array, seed: int) -> list[Ends]:
    intervals, random, count = of.intervals, of.random, len(error)
    few = random.basis(random.sobol(SEARCHED, seed + 1), of.terms)
    many = random.basis(random.sobol(DRAWN, seed + 2), of.terms)
    best = np.full((len(QUANTILES), 2, count), np.inf)
    at = np.zeros((len(QUANTILES), 2, count, len(intervals)))
    signs = np.array([1.0, -1.0])[:, None]
    every = np.arange(count)
    block = max(1, HELD // SEARCHED)
    for place in _looked_at(len(intervals), seed):
        parts = np.concatenate(of.parts(place[None]))
        found = [np.quantile(few @ parts[:, k : k + block], QUANTILES, axis=0) for k in range(0, count, block)]
        _improve(best, at, np.concatenate(found, axis=1)[:, None] * signs, np.broadcast_to(place, at.shape))
    ends_of = []
    for k, share in enumerate(QUANTILES):
        one = Quantile(of, share, few)
        for side in sides:
            for place in (side.at_lower, side.at_upper):
                _improve(best[k], at[k], one.each(place, every) * signs, np.broadcast_to(place, at[k].shape))
        _search(one, best[k], at[k])
        both = np.concatenate(at[k])
        # Each half of the sequence is spread as evenly as the whole; every second place is not.
        halves = [Quantile(of, share, half).each(both, np.tile(every, 2)) for half in np.split(many, 2)]
        low, high = (0.5 * (halves[0] + halves[1])).reshape(2, -1)
        # The difference of two halves of the places estimates the error of all.
        off = error + SAFETY * np.abs(halves[0] - halves[1]).reshape(2, -1).max(axis=0)
        swapped = low > high
        low, high = np.where(swapped, high, low), np.where(swapped, low, high)
        ends = np.where(swapped[:, None], at[k][::-1], at[k])
        ends_of.append(_ends(intervals, Extremes(low, high, ends[0], ends[1], np.zeros(len(low))), off))
    return ends_of


def _looked_at(parameters: int, seed: int) -> Array:
    if parameters in GRID:
        return np.array(list(product(np.linspace(-1, 1, GRID[parameters]), repeat=parameters)))
    random = np.random.default_rng(seed).uniform(-1, 1, (ELSE, parameters))
    some = corners(parameters) if parameters <= MOST_CORNERS - 4 else np.sign(random)
    return np.concatenate([np.zeros((1, parameters)), some, random])


def _improve(best: Array, at: Array, value: Array, place: Array) -> None:
    better = value < best
    best[better], at[better] = value[better], place[better]


def _search(one: Each, best: Array, at: Array) -> None:
    """Search the extremes of one quantile from the best places so far; best: (2, columns), the upper side negative."""
    every = np.arange(best.shape[1])
    for side, sign in enumerate((1.0, -1.0)):
        for step in STEPS:
            for axis in range(at.shape[-1]):
                along(one, sign, axis, step, best[side], at[side], every)


def sampled(study: Study, boxes: ProbabilityBoxes) -> ProbabilityBoxes:
    """Return boxes with extremes over a few interval values beyond the horizon, whose outer bounds are not known."""
    inputs, runs = study.inputs, study.runs
    intervals, random = inputs.some(~inputs.random), inputs.some(inputs.random)
    count = len(intervals)
    unit = np.eye(count)
    some = corners(count) if 2**count < INTERVAL_VALUES else np.vstack([unit, -unit])
    given = np.concatenate([np.zeros((1, count)), some])[:INTERVAL_VALUES]
    inner = min(RUNS_EACH, runs.left // len(given))
    if inner < RUNS_EACH // 2:
        return boxes
    drawn, made, failed = random.sobol(inner, study.seed + 3), len(runs.xi), runs.failed
    xi = np.empty((len(given) * inner, len(inputs)))
    xi[:, ~inputs.random] = np.repeat(given, inner, axis=0)
    xi[:, inputs.random] = np.tile(drawn, (len(given), 1))
    runs.all(xi)
    if runs.failed > failed:
        return boxes
    values = runs.values[made:].reshape(len(given), inner, -1)
    named, late = intervals.named(given), study.instants > boxes.horizon

    def instead(known: Ends, ends_of: Array) -> Ends:
        """Return a statistic with values beyond the horizon. ends_of: (places, columns)."""
        low, high, nothing = ends_of.argmin(axis=0), ends_of.argmax(axis=0), np.full(ends_of.shape[1], np.nan)
        new = Ends(ends_of.min(axis=0), ends_of.max(axis=0), nothing, nothing, named[low], named[high])
        return Ends(
            **{
                name: np.where(late if of.ndim == 1 else late[:, None], of, getattr(known, name))
                for name, of in vars(new).items()
            }
        )

    quantiles = np.quantile(values, QUANTILES, axis=1)
    return replace(
        boxes,
        mean=instead(boxes.mean, values.mean(axis=1)),
        std=instead(boxes.std, values.std(axis=1, ddof=1)),
        quantiles=tuple(instead(known, ends_of) for known, ends_of in zip(boxes.quantiles, quantiles, strict=True)),
        places=len(given),
        inner=inner,
    )
