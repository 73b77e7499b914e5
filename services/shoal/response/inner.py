"""Moments over the random parameters alone, at given values of the intervals: inner studies, and bounds of these.

One expansion over all parameters is off by a share of all that varies. Where the mean varies widely over the intervals
and random parameters have a small effect, the sum of squares of its coefficients is mostly that error. Runs at the
same interval values share their mean; what they differ by is the effect of the random parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.response.attained import bounds_of
from shoal.response.boxes import INNER, PLACES, Boxes, Ends, coarse, std_gap
from shoal.response.inputs import BoolArray, Inputs, IntArray
from shoal.response.kept import TimeIsUpError
from shoal.response.methods.bounds import bounds
from shoal.response.methods.quadrature import rule
from shoal.response.polynomials import size, total_degree
from shoal.response.runs import Answers, CachedModel, TooManyRunsError
from shoal.response.study import Study
from shoal.trajectory import Array

POINTS = {1: (4, 8, 16, 32), 2: (3, 6, 12)}
"""Points of a Gauss rule in each random parameter, by the number of these."""
DEGREES = 1, 2, 3, 4
"""Of an expansion where there are more, fitted to twice as many runs as it has terms."""
AGREE = 0.01
"""Share of a deviation by which two rules may differ."""
PROBES = 8
"""Quasi-random interval values, and the middle, at which rules are compared."""
SHARE = 40
"""One in so many of the runs that are left, at most, may be those of one rule."""
GAP = 0.01
"""Of the largest width of means and of variances, that is aimed at."""
HELD = 4_000_000
"""Numbers that are held at once."""


@dataclass(frozen=True)
class Rule:
    """germs: of the random parameters, (runs, parameters); mean: weights of its runs, (runs,); others: what the runs
    are multiplied by for the other coefficients of an orthonormal expansion, (terms, runs)
    """

    germs: Array
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
    if len(random) in POINTS:
        for count in POINTS[len(random)]:
            if min(random.highest(count)) >= count:
                germs, weights = rule(random, count)
                # The variance is the weighted mean of squares, which is never negative.
                roots = np.sqrt(weights)
                yield Rule(germs, weights, np.diag(roots) - np.outer(roots, weights))
        return
    for degree in DEGREES:
        terms = total_degree(len(random), degree)
        terms = terms[(terms <= random.highest(degree)).all(axis=1)]
        germs = random.sobol(2 * size(len(random), degree), seed)
        inverse = np.asarray(np.linalg.pinv(random.basis(germs, terms)), dtype=float)
        yield Rule(germs, inverse[0], inverse[1:])


class Inner:
    """Moments of some columns as a model of the intervals; its runs are counted as set aside.

    Call it with path -> values of the intervals, (places,): means and variances, (places, 2 columns).
    """

    def __init__(self, study: Study, columns: IntArray) -> None:
        self.study, self.columns = study, columns
        self.random = study.inputs.some(study.inputs.random)
        self.rule: Rule | None = None

    def settle(self, places: Mapping[str, Array], most: int) -> Array | None:
        """Choose the first rule that agrees with the one before it, of at most so many runs.

        places: path -> values of the intervals. Returns by how much means and deviations differ at most,
        (2 columns,), or None where no two rules agree.
        """
        count, before = len(self.columns), None
        for one in rules(self.random, self.study.seed):
            self.rule = one
            if len(one.germs) > most:
                return None
            told, good = self._moments(places)
            if not good.all():
                return None
            told[:, count:] = np.sqrt(told[:, count:])
            if before is not None:
                apart = np.asarray(np.abs(told - before).max(axis=0))
                if np.all(apart <= AGREE * np.tile(told[:, count:].max(axis=0), 2)):
                    return apart
            before = told
        return None

    def __call__(self, values: Mapping[str, Array]) -> Answers:
        """Make the runs of the rule at every place."""
        return Answers(*self._moments(values))

    def _moments(self, values: Mapping[str, Array]) -> tuple[Array, BoolArray]:
        assert self.rule is not None
        runs, each = self.study.runs, len(self.rule.germs)
        drawn, places = self.random.values(self.rule.germs), len(next(iter(values.values())))
        told, good = np.empty((places, 2 * len(self.columns))), np.ones(places, dtype=bool)
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
            told[part] = np.hstack(self.rule.moments(answers.values[:, self.columns].reshape(count, each, -1)))
            good[part] = answers.good.reshape(count, each).all(axis=1)
        return told, good


def resolved(study: Study, boxes: Boxes) -> tuple[Boxes, str]:
    """Find bounds of mean and deviation by inner studies where the expansion does not resolve the deviation.

    Returns the boxes, and how they were found in words, empty where nothing was to be done. Where inner studies fail or
    take too many runs, the bounds stay as they are, with their `std_gap`.
    """
    columns = np.flatnonzero(coarse(study, boxes.std) & (study.instants <= boxes.horizon))
    if not len(columns):
        return boxes, ""
    try:
        # Beyond the horizon, drawn runs are needed.
        mean, std, how = _bounded(study, columns, PLACES * INNER if np.isfinite(boxes.horizon) else 0)
    except (TooManyRunsError, TimeIsUpError, InputError, ComputationError):
        # What far places of a rule state may be impossible.
        return boxes, ""
    shares = None if boxes.shares is None else boxes.shares.copy()
    if shares is not None:
        shares[..., columns] = np.nan
    std = _within(boxes.std, columns, std)
    gap = std_gap(study, std, boxes.horizon)
    return replace(boxes, mean=_within(boxes.mean, columns, mean), std=std, shares=shares, std_gap=gap), how


def _bounded(study: Study, columns: IntArray, spared: int) -> tuple[Ends, Ends, str]:
    """Bound mean and deviation of some columns by a study of the intervals alone; also returns how, in words.

    spared: runs that are left for others. Raises TooManyRunsError, TimeIsUpError, InputError, ComputationError.
    """
    intervals, inner = study.inputs.some(~study.inputs.random), Inner(study, columns)
    tried = np.vstack([np.zeros(len(intervals)), intervals.sobol(PROBES, study.seed + 9)])
    apart = inner.settle(intervals.values(tried), (study.runs.left - spared) // SHARE)
    if apart is None or inner.rule is None:
        raise TooManyRunsError
    runs = CachedModel(inner, intervals, (study.runs.left - spared) // len(inner.rule.germs))
    # The variance is smooth where the deviation has a kink.
    groups = np.concatenate([study.groups[columns], study.groups[columns] + study.groups.max() + 1])
    outer = Study(runs, groups, np.tile(study.instants[columns], 2), study.seed, GAP)
    found = bounds_of(outer, bounds(outer))
    if runs.failed:
        raise ComputationError(runs.why)
    if np.isnan(found.lower_outer).any():
        raise TooManyRunsError
    count = len(columns)
    mean, square = (
        Ends(
            found.lower[part],
            found.upper[part],
            found.lower_outer[part],
            found.upper_outer[part],
            found.at_lower[part],
            found.at_upper[part],
        )
        for part in (slice(count), slice(count, None))
    )
    sides = ("lower", "upper", "lower_outer", "upper_outer")
    std = replace(square, **{side: np.sqrt(np.maximum(getattr(square, side), 0.0)) for side in sides})
    std = _wider(std, apart[count:])
    std = replace(std, lower_outer=np.maximum(std.lower_outer, 0.0))
    how = f"{runs.evaluations} interval values with {len(inner.rule.germs)} runs over the random parameters each"
    return _wider(mean, apart[:count]), std, how


def _wider(found: Ends, off: Array) -> Ends:
    return replace(found, lower_outer=found.lower_outer - off, upper_outer=found.upper_outer + off)


def _within(whole: Ends, columns: IntArray, part: Ends) -> Ends:
    """Replace some columns."""
    told = {name: np.array(of) for name, of in vars(whole).items()}
    for name, of in vars(part).items():
        told[name][columns] = of
    return Ends(**told)
