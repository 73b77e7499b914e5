"""Intervals and distributions together: one expansion over all of them, with runs where its statistics are extreme.

Eldred, Swiler and Tang, Mixed aleatory-epistemic uncertainty quantification with stochastic expansions and
optimization-based interval estimation, Reliability Engineering and System Safety 96, 2011.

One expansion over all parameters is off by a share of all that varies. Where the mean varies widely over the intervals
and random parameters have a small effect, the sum of squares of its coefficients is mostly that error. Runs at the same
interval values share their mean; what they differ by is the effect of the random parameters. Inner studies over the
random parameters alone, whose moments are bounded over the intervals, resolve it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.response.enclosure import bounds_of
from shoal.response.expansion import Expansion, choose_degree, hidden, outwards
from shoal.response.extremes import HELD, MOST_CORNERS, Extremes, corners, extremes
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.methods.bounds import bounds
from shoal.response.methods.quadrature import rule
from shoal.response.polynomials import size, total_degree
from shoal.response.probability_boxes import (
    BEYOND_HOPE,
    INTERVAL_VALUES,
    RUNS_EACH,
    Above,
    Conditional,
    Mean,
    ProbabilityBoxes,
    coarse,
    scatter,
    std_gap,
)
from shoal.response.runs import Answers, CachedModel, TimeIsUpError, TooManyRunsError
from shoal.response.study import CONVERGED, RUNS, SAFETY, Ends, Found, Study, share_of
from shoal.trajectory import Array

SHARE = 1.6
"""Runs for every term, at least."""
FIRST = 64
"""Runs to begin with, see `control`; they are doubled."""
COARSE, MORE = 1e-2, 6
"""Above this gap more runs are made: so many times."""
DECIDING_RUNS = 8
"""Runs at each of the interval values that decide, and one more for each random parameter."""
APART = 0.15
"""Values of the interval variables that are nearer to each other are one place."""
ENOUGH = 1
"""Times the fair number of runs after which the horizon is looked for."""


def nested(study: Study) -> Found:
    """Expand in `degree`, or in the degree of the least leave-one-out error. Raises InputError."""
    inputs, runs = study.inputs, study.runs
    if not inputs.mixed:
        raise InputError("vary: method nested needs an interval and a distribution; auto takes either alone")
    fair, wanted = study.count or RUNS, study.gap or CONVERGED
    most = fair if study.count else MORE * fair
    made, decided = 0, 0
    count = max(FIRST, math.ceil(SHARE * size(len(inputs), study.degree or 1)))
    found: Expansion | None = None
    error = np.array([])
    try:
        while True:
            runs(_towards_ends(inputs, inputs.sobol(count - made, study.seed, made)))
            made, found = count, best(study)
            sides = _extremes(study, found)
            where = _deciding(sides)
            before = len(runs.xi)
            # Its predictions of these runs, which it was not fitted to, show how far off it is.
            runs.all(_at(inputs, where, study.seed + 7 + decided))
            decided += len(where)
            error = np.maximum(found.left_out, _unseen(study, found, where, before))
            for given in (sides[1].at_lower, sides[1].at_upper):
                error = np.maximum(error, _hidden(Conditional(found), given))
            gap = _gap(study, error, sides, made > ENOUGH * fair)
            if gap <= wanted or made >= most or (made >= fair and gap <= max(COARSE, wanted)):
                break
            count = min(2 * made, most if made >= fair else fair)
    except TooManyRunsError:
        if found is None or not error.size:
            raise
    found = best(study)
    degree = int(found.terms.sum(axis=1).max())
    why = (
        f"polynomial chaos of degree {degree} over distributions and intervals together, fitted to {runs.evaluations} "
        f"runs, those at {decided} interval values where its mean or deviation is least or largest among them"
    )
    return Found(why, found, error)


def _towards_ends(inputs: Inputs, xi: Array) -> Array:
    """Denser towards the ends of the intervals, where polynomials need runs."""
    return np.where(inputs.random, xi, np.sin(0.5 * np.pi * xi))


def best(study: Study) -> Expansion:
    """Fit every column by its best degree."""
    return choose_degree(study, SHARE, lambda found: _reaching(study, found))


def _reaching(study: Study, found: Expansion) -> Expansion:
    """Return an expansion whose error includes that beyond the runs, at the middle and the ends of the intervals."""
    if not study.inputs.mixed:
        return found
    found, count = outwards(study.runs.xi, study.runs.values, found), int((~study.inputs.random).sum())
    ends = corners(count) if count < MOST_CORNERS // 2 else np.vstack([np.eye(count), -np.eye(count)])
    of, columns = Conditional(found), study.runs.values.shape[1]
    for place in (np.zeros(count), *ends):
        found = replace(found, left_out=np.maximum(found.left_out, _hidden(of, np.tile(place, (columns, 1)))))
    return found


def _hidden(of: Conditional, given: Array) -> Array:
    """Return the hidden part of the deviation of every column at its own intervals, (columns, intervals)."""
    return hidden(of.each(given, np.arange(len(given))), of.random, of.terms)


def _extremes(study: Study, found: Expansion) -> list[Extremes]:
    """Return the extremes of mean and standard deviation over the intervals."""
    of, columns = Conditional(found), study.runs.values.shape[1]
    return [extremes(one, len(of.intervals), columns, study.seed) for one in (Mean(of), Above(of))]


def _deciding(sides: list[Extremes]) -> Array:
    """Values of the intervals where most statistics are extreme, apart from each other, (places, intervals)."""
    every = np.concatenate([place for one in sides for place in (one.at_lower, one.at_upper)])
    different, count = np.unique(np.round(every, 1), axis=0, return_counts=True)
    chosen: list[Array] = []
    for place in different[np.argsort(-count, kind="stable")]:
        if all(np.abs(place - other).max() > APART for other in chosen):
            chosen.append(place)
        if len(chosen) == 2 + 2 * every.shape[1]:
            break
    return np.array(chosen)


def _at(inputs: Inputs, where: Array, seed: int) -> Array:
    """Germs at these interval values, some of the random parameters at each."""
    random = inputs.random
    each = DECIDING_RUNS + int(random.sum())
    xi = np.empty((len(where) * each, len(inputs)))
    xi[:, ~random] = np.repeat(where, each, axis=0)
    xi[:, random] = inputs.some(random).sobol(len(xi), seed)
    return xi


def _unseen(study: Study, found: Expansion, where: Array, before: int) -> Array:
    """Error at the runs since then, the largest over interval values, roots of mean squares, (columns,)."""
    xi, values = study.runs.xi[before:], study.runs.values[before:]
    squares, given = (found(xi) - values) ** 2, xi[:, ~study.inputs.random]
    groups = [squares[(given == place).all(axis=1)] for place in where]
    return np.asarray(np.sqrt(np.max([group.mean(axis=0) for group in groups if len(group)], axis=0)))


def _gap(study: Study, error: Array, sides: list[Extremes], late: bool) -> float:
    """The largest; late: before the horizon, beyond which no number of runs helps."""
    scale = scatter(study, *sides)
    gaps = share_of(SAFETY * error, scale)
    end = study.instants[gaps > BEYOND_HOPE].min(initial=math.inf) if late else math.inf
    return float(gaps[study.instants < end].max(initial=0.0))


GAUSS_POINTS = {1: (4, 8, 16, 32), 2: (3, 6, 12)}
"""Points of a Gauss rule in each random parameter, by the number of these."""
DEGREES = 1, 2, 3, 4
"""Of an expansion where there are more, fitted to twice as many runs as it has terms."""
AGREE = 0.01
"""Share of a deviation by which two rules may differ."""
PROBES = 8
"""Quasi-random interval values, and the middle, at which rules are compared."""
ONE_IN = 40
"""One in so many of the runs that are left, at most, may be those of one rule."""
INNER_GAP = 0.01
"""Of the largest width of means and of variances, that is aimed at."""


@dataclass(frozen=True)
class Rule:
    """xi: of the random parameters, (runs, parameters); mean: weights of its runs, (runs,); others: what the runs
    are multiplied by for the other coefficients of an orthonormal expansion, (terms, runs)
    """

    xi: Array
    mean: Array
    others: Array

    def moments(self, values: Array) -> tuple[Array, Array]:
        """Mean and variance, of values (places, runs, columns), both (places, columns)."""
        # Rounding of the mean is none of the deviation.
        middle = values[:, :1]
        parts = self.others @ (values - middle)
        return middle[:, 0] + np.einsum("r,prc->pc", self.mean, values - middle), (parts**2).sum(axis=1)


def rules(random: Inputs, seed: int) -> Iterator[Rule]:
    """Yield rules from cheap to fine, those with more points than a distribution carries left out."""
    if len(random) in GAUSS_POINTS:
        for count in GAUSS_POINTS[len(random)]:
            if min(random.highest(count)) >= count:
                xi, weights = rule(random, count)
                # The variance is the weighted mean of squares, which is never negative.
                roots = np.sqrt(weights)
                yield Rule(xi, weights, np.diag(roots) - np.outer(roots, weights))
        return
    for degree in DEGREES:
        terms = total_degree(len(random), degree)
        terms = terms[(terms <= random.highest(degree)).all(axis=1)]
        xi = random.sobol(2 * size(len(random), degree), seed)
        inverse = np.asarray(np.linalg.pinv(random.basis(xi, terms)), dtype=float)
        yield Rule(xi, inverse[0], inverse[1:])


class Inner:
    """Moments of some columns as a model of the intervals; its runs are counted as set aside.

    Call it with path -> values of the intervals, (places,): means and variances, (places, 2 columns).
    """

    def __init__(self, study: Study, columns: IntArray) -> None:
        self.study, self.columns = study, columns
        self.random = study.inputs.some(study.inputs.random)
        self.rule: Rule | None = None

    def settle(self, places: Mapping[str, Array], most: int) -> Array | None:
        """Choose the first rule that agrees with the one before it, of at most `most` runs.

        places: path -> values of the intervals. Returns by how much means and deviations differ at most,
        (2 columns,), or None where no two rules agree.
        """
        count, before = len(self.columns), None
        for one in rules(self.random, self.study.seed):
            self.rule = one
            if len(one.xi) > most:
                return None
            values_of, good = self._moments(places)
            if not good.all():
                return None
            values_of[:, count:] = np.sqrt(values_of[:, count:])
            if before is not None:
                apart = np.asarray(np.abs(values_of - before).max(axis=0))
                if np.all(apart <= AGREE * np.tile(values_of[:, count:].max(axis=0), 2)):
                    return apart
            before = values_of
        return None

    def __call__(self, values: Mapping[str, Array]) -> Answers:
        """Make the runs of the rule at every place."""
        return Answers(*self._moments(values))

    def _moments(self, values: Mapping[str, Array]) -> tuple[Array, BoolArray]:
        assert self.rule is not None
        runs, each = self.study.runs, len(self.rule.xi)
        drawn, places = self.random.values(self.rule.xi), len(next(iter(values.values())))
        values_of, good = np.empty((places, 2 * len(self.columns))), np.ones(places, dtype=bool)
        block = max(1, HELD // (each * len(self.study.instants)))
        for k in range(0, places, block):
            part = slice(k, min(k + block, places))
            count = part.stop - k
            if runs.left < count * each:
                raise TooManyRunsError
            lanes = {path: np.repeat(at[part], each) for path, at in values.items()}
            answers = runs.model({**lanes, **{path: np.tile(at, count) for path, at in drawn.items()}})
            runs.aside += count * each
            if runs.progress is not None:
                runs.progress(runs.evaluations)
            values_of[part] = np.hstack(self.rule.moments(answers.values[:, self.columns].reshape(count, each, -1)))
            good[part] = answers.good.reshape(count, each).all(axis=1)
        return values_of, good


def resolved(study: Study, boxes: ProbabilityBoxes) -> tuple[ProbabilityBoxes, str]:
    """Find bounds of mean and deviation by inner studies where the expansion does not resolve the deviation.

    Returns the boxes, and how they were found in words, empty where nothing was to be done. Where inner studies fail or
    take too many runs, the bounds stay as they are, with their `std_gap`.
    """
    columns = np.flatnonzero(coarse(study, boxes.std) & (study.instants <= boxes.horizon))
    if not len(columns):
        return boxes, ""
    try:
        # Beyond the horizon, drawn runs are needed.
        mean, std, how = _bounded(study, columns, INTERVAL_VALUES * RUNS_EACH if np.isfinite(boxes.horizon) else 0)
    except (TooManyRunsError, TimeIsUpError, InputError, ComputationError):
        # What far places of a rule state may be impossible.
        return boxes, ""
    shares = None if boxes.shares is None else boxes.shares.copy()
    if shares is not None:
        shares[..., columns] = np.nan
    std = boxes.std.with_columns(columns, std)
    gap = std_gap(study, std, boxes.horizon)
    return replace(boxes, mean=boxes.mean.with_columns(columns, mean), std=std, shares=shares, std_gap=gap), how


def _bounded(study: Study, columns: IntArray, spared: int) -> tuple[Ends, Ends, str]:
    """Bound mean and deviation of some columns by a study of the intervals alone; also returns how, in words.

    spared: runs that are left for others. Raises TooManyRunsError, TimeIsUpError, InputError, ComputationError.
    """
    intervals, inner = study.inputs.some(~study.inputs.random), Inner(study, columns)
    tried = np.vstack([np.zeros(len(intervals)), intervals.sobol(PROBES, study.seed + 9)])
    apart = inner.settle(intervals.values(tried), (study.runs.left - spared) // ONE_IN)
    if apart is None or inner.rule is None:
        raise TooManyRunsError
    runs = CachedModel(inner, intervals, (study.runs.left - spared) // len(inner.rule.xi))
    # The variance is smooth where the deviation has a kink.
    groups = np.concatenate([study.groups[columns], study.groups[columns] + study.groups.max() + 1])
    outer = Study(runs, groups, np.tile(study.instants[columns], 2), study.seed, INNER_GAP)
    found = bounds_of(outer, bounds(outer))
    if runs.failed:
        raise ComputationError(runs.why)
    if np.isnan(found.lower_outer).any():
        raise TooManyRunsError
    count = len(columns)
    mean, square = (found.columns(part) for part in (slice(count), slice(count, None)))
    sides = ("lower", "upper", "lower_outer", "upper_outer")
    std = replace(square, **{side: np.sqrt(np.maximum(getattr(square, side), 0.0)) for side in sides})
    std = std.widened(apart[count:])
    std = replace(std, lower_outer=np.maximum(std.lower_outer, 0.0))
    how = f"{runs.evaluations} interval values with {len(inner.rule.xi)} runs over the random parameters each"
    return mean.widened(apart[:count]), std, how
