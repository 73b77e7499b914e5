"""Attained and outer bounds of the answers, from runs and a surrogate.

The error of a surrogate is known at runs; far from them it is as large as it was at runs that it had not seen. So it is
taken to grow with the distance from the nearest run, as fast as an error of the surrogate's degree can: a polynomial of
total degree n that is at most e on the box changes by at most n e for every radian between the places arccos(u) of two
points (Bernstein's inequality). Where a bound is attained by a run, and the answer falls off from there faster than
that, the attained bound is the bound.

Few runs are fitted by a polynomial of low degree irrespective of what lies between them, and extremal points of that
polynomial are where it is evaluated. Control runs, which do not depend on it, lie all over the box.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from shoal.response.expansion import Expansion
from shoal.response.extremes import Extremes, Surrogate, extremes, in_parts, places
from shoal.response.inputs import BoolArray, IntArray
from shoal.response.runs import TooManyRunsError
from shoal.response.study import FINE_GAP, SAFETY, DatedEnclosure, Enclosure, Ends, Found, Study, share_of
from shoal.trajectory import Array

CONTROLS = 64
"""Control runs, a power of two: along each axis one lies in every 64th, so that none misses a band of 3 % across the
box."""
UNSEEN = 0.05
"""Complement of the confidence of 95 % of `unseen`."""


def unseen(count: int) -> float:
    """Share of the box that `count` runs all over it miss with a probability of 5 %: about 3 / count.

    With independent runs (1 - share)^count = 0.05; evenly spread ones see a part that hangs together sooner.
    """
    return float(1 - UNSEEN ** (1 / count)) if count else 1.0


def control_misses(study: Study, surrogate: Surrogate) -> Array:
    """Make the runs, as many as may be made, and return the largest error of a surrogate there, (columns,).

    Raises TooManyRunsError, InputError.
    """
    runs, made = study.runs, len(study.runs.xi)
    count = min(CONTROLS, runs.left)
    if count:
        runs.controls += runs.all(study.inputs.sobol(count, study.seed + 5, runs.controls))
    return np.asarray(np.abs(surrogate(runs.xi[made:]) - runs.values[made:]).max(axis=0, initial=0.0))


def contradicts(study: Study, missed: Array, error: Array) -> BoolArray:
    """Return where errors at runs exceed the known error, and matter, (columns,)."""
    return np.asarray(missed > SAFETY * error + FINE_GAP * study.widths(study.runs.values))


def with_controls(study: Study, enclosed: DatedEnclosure | None) -> DatedEnclosure | None:
    """Bounds with runs that they predicted."""
    if enclosed is None:
        return None
    outer = enclosed.enclosure.lower_outer, enclosed.enclosure.upper_outer
    return DatedEnclosure(study.runs.evaluations, Enclosure.of(study, *outer))


Look = Literal["there", "scanned", "everywhere"]
ARMS = 1.0, 0.3, 0.1
"""Of the search for widened extremes, in lengths over which the margin grows to its full size."""
ROUGH = 50
"""Change of the error of a surrogate that is no polynomial, in margins for every radian."""


def enclosure(
    study: Study, surrogate: Surrogate, found: Extremes, error: Array, *, look: Look = "everywhere"
) -> Enclosure:
    """error: of the surrogate at runs that it had not seen, (columns,); found: its extremes; look: where the margin is
    evaluated: there only, where the surrogate is scanned as well, or in between too: each may reach farther
    """
    slope = 1 + int(surrogate.terms.sum(axis=1).max()) if isinstance(surrogate, Expansion) else ROUGH
    return Enclosure.of(study, *_widened(study, surrogate, found, SAFETY * error, slope, look))


def enclose(study: Study, surrogate: Surrogate, error: Array) -> DatedEnclosure:
    """Bounds by all runs there are; error: see `enclosure`."""
    named = extremes(surrogate, len(study.inputs), len(error), study.seed, known=study.runs.attaining)
    return DatedEnclosure(study.runs.evaluations, enclosure(study, surrogate, named, error))


def enclosure_of_cycles(study: Study, _: Surrogate, found: Extremes, error: Array) -> Enclosure:
    """Bounds that runs attain, and outer ones by what a surrogate predicts at its extremes.

    error: of the surrogate at runs that it had not seen, (columns,)
    """
    margin = SAFETY * (error + found.doubt)
    return Enclosure.of(study, found.lower - margin, found.upper + margin)


def _widened(
    study: Study, surrogate: Surrogate, found: Extremes, margin: Array, slope: int, look: Look
) -> tuple[Array, Array]:
    """Return the extremes of a surrogate that is off by its margin at the most, (columns,) each.

    The margin grows away from runs, so that an extreme may move off the surrogate's own: sought along the axes.
    """
    xi, columns = study.runs.xi, len(margin)
    every, runs = np.arange(columns), cKDTree(np.arccos(xi))
    misfit = np.abs(surrogate(xi) - study.runs.values)
    which, signs = np.tile(every, 2), np.repeat([1.0, -1.0], columns)

    def away(at: Array) -> tuple[Array, IntArray]:
        """Share of the margin at each place, and the nearest run."""
        distance, nearest = runs.query(np.arccos(at), p=np.inf)
        return np.minimum(slope * distance, 1.0), np.asarray(nearest, dtype=np.int64)

    def objective(at: Array) -> Array:
        """Return the widened lower side of all columns, then the upper one, negative."""
        share, run = away(at)
        return signs * surrogate.each(at, which) - margin[which] * share - misfit[run, which]

    own = np.concatenate([found.at_lower, found.at_upper])
    best, place = objective(own), own.copy()
    if look == "there":
        return best[:columns], -best[columns:]
    rough = look == "scanned"
    scanned = places(xi.shape[1], study.seed, rough=rough)
    share, run = away(scanned)
    for some, answers in in_parts(surrogate, scanned, columns):
        wide = share[some, None] * margin
        wide += misfit[run[some]]
        for side, of in enumerate((answers - wide, answers + wide)):
            every_place = np.ascontiguousarray(of.T)
            extreme = every_place.argmax(axis=1) if side else every_place.argmin(axis=1)
            value = (-1 if side else 1) * every_place[every, extreme]
            mine = slice(side * columns, (side + 1) * columns)
            better = value < best[mine]
            best[mine][better], place[mine][better] = value[better], scanned[some][extreme][better]
    starts = [place] if rough else [place, own]
    for at in starts:
        value = best.copy() if at is place else objective(at)
        for step in () if rough else (arm / slope for arm in ARMS):
            for axis in range(xi.shape[1]):
                for way in (-step, step):
                    beside = at.copy()
                    beside[:, axis] = np.cos(np.clip(np.arccos(beside[:, axis]) + way, 0, np.pi))
                    now = objective(beside)
                    better = now < value
                    value[better], at[better] = now[better], beside[better]
        best = np.minimum(best, value)
    return best[:columns], -best[columns:]


WILKS = 93
"""Random runs between whose extremes 95 % of all lie with 95 % confidence: 1 - 0.95^n - n 0.05 0.95^(n-1) >= 0.95."""
TESTED, TEST_SPACING = 1, 0.05
"""Extremal points that are run for each parameter, and how far apart, where a surrogate of cycles gives the bounds."""
ATTAINING, AT_ONCE = 16, 64
"""Times the fair number of runs that are made at most to attain bounds of a surrogate of cycles, so many at once."""
ATTAINED = 0.1
"""Share of the gap by which a run may lie inside what is predicted and count as attaining it."""
SEARCHES = 8
"""Searches for the extremes of a surrogate of cycles."""
BELIEVED = 0.2
"""Share of the width: the largest gap of bounds that are reported. A larger error shows a feature that was missed."""


@dataclass(frozen=True, eq=False)
class Bounds(Ends):
    """Bounds of every column: attained by runs or, at long times, to within the error of the surrogate of cycles.

    gap: largest distance between outer and attained ones as a share of the width within the horizon, nan where it is
    not known; horizon: last instant up to which they meet [s], infinite if they always do; likely: where, with 95 %
    confidence, 95 % of all runs lie if each value of the parameters is as likely as another, (2, columns), None within
    the horizon
    """

    gap: float
    horizon: float
    likely: Array | None = None


def bounds_of(study: Study, found: Found) -> Bounds:
    """Attained bounds of all runs, after the extremal points of the surrogate are run, and outer ones by its error."""
    runs, error, surrogate = study.runs, found.error, found.surrogate
    named = None
    known = found.enclosed is not None and found.enclosed.runs == runs.evaluations
    if surrogate is not None and not known:
        # Over many cycles there are many extremes.
        how = (SEARCHES, error) if found.of_cycles else (1, None)
        named = extremes(surrogate, len(study.inputs), runs.values.shape[1], study.seed, *how)
        if error is None:
            error = _confirmed(study, surrogate, named)
        elif found.of_cycles:
            error = _tested(study, surrogate, named, error)
        if error is not None and not runs.controls:
            error = _controlled(study, surrogate, error)
        if found.of_cycles:
            _attain(study, surrogate, named)
    values, xi = runs.values, runs.xi
    at_lower, at_upper = xi[values.argmin(axis=0)], xi[values.argmax(axis=0)]
    lower, upper = values.min(axis=0), values.max(axis=0)
    unknown = np.full(len(lower), np.nan)
    answers = Enclosure(lower, upper, unknown, unknown, unknown)
    if known and found.enclosed is not None:
        answers = found.enclosed.enclosure
    elif surrogate is not None and named is not None and error is not None:
        answers = (enclosure_of_cycles if found.of_cycles else enclosure)(study, surrogate, named, error)
    end = _horizon(study, answers.gap)
    within = answers.gap[study.instants <= end]
    return Bounds(
        answers.lower,
        answers.upper,
        answers.lower_outer,
        answers.upper_outer,
        study.inputs.named(at_lower),
        study.inputs.named(at_upper),
        float(within.max()) if within.size else math.nan,
        end,
    )


def likely(study: Study, bounds: Bounds) -> Bounds:
    """Add a tolerance interval beyond the horizon: 95 % of all runs lie between the extremes of 93, with 95 %
    confidence.

    Whatever the distribution of the answers (Wilks, Determination of sample sizes for setting tolerance limits, Annals
    of Mathematical Statistics 12, 1941); the intervals are taken as evenly likely.
    """
    runs, made, failed = study.runs, len(study.runs.xi), study.runs.failed
    runs.all(study.inputs.drawn(WILKS, study.seed + 1))
    if runs.failed > failed:
        return bounds
    drawn, xi = runs.values[made:], study.inputs.named(runs.xi[made:])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    lower, upper = low < bounds.lower, high > bounds.upper
    return replace(
        bounds,
        lower=np.where(lower, low, bounds.lower),
        upper=np.where(upper, high, bounds.upper),
        lower_outer=np.fmin(bounds.lower_outer, low),
        upper_outer=np.fmax(bounds.upper_outer, high),
        at_lower=np.where(lower[:, None], xi[drawn.argmin(axis=0)], bounds.at_lower),
        at_upper=np.where(upper[:, None], xi[drawn.argmax(axis=0)], bounds.at_upper),
        likely=np.stack([low, high]),
    )


def _confirmed(study: Study, surrogate: Surrogate, named: Extremes) -> Array | None:
    """The error of a surrogate at its own extremal points, which are run; None if there are no runs left for it.

    At least that at runs that are left out of it, where it knows that.
    """
    runs = study.runs
    wanted: Array = np.unique(np.round(np.vstack([named.at_lower, named.at_upper]), 2), axis=0)
    wanted = wanted[: max(0, min(len(wanted), runs.left, study.fair))]
    made = len(runs.xi)
    if not len(wanted) or runs(wanted) == 0:
        return None
    missed = np.abs(surrogate(runs.xi[made:]) - runs.values[made:]).max(axis=0, initial=0.0)
    return np.asarray(np.maximum(missed, getattr(surrogate, "left_out", 0.0)))


def _controlled(study: Study, surrogate: Surrogate, error: Array) -> Array:
    """The error of a surrogate, or what it misses of runs all over the box that contradict it."""
    with suppress(TooManyRunsError):
        missed = control_misses(study, surrogate)
        return np.where(contradicts(study, missed, error), missed, error)
    return error


def _tested(study: Study, surrogate: Surrogate, named: Extremes, error: Array) -> Array:
    """The error of a surrogate of cycles, or its error at the extremal points that promise most, which are run.

    Elsewhere it may predict well and still miss there: a ball that touches the ground has its least height in a cusp.
    """
    runs, count = study.runs, TESTED * len(study.inputs)
    values = runs.values
    width = np.tile(study.widths(values), 2)
    gains = np.concatenate([values.min(axis=0) - named.lower, named.upper - values.max(axis=0)])
    share = share_of(gains, width)
    places: list[Array] = []
    for place in np.concatenate([named.at_lower, named.at_upper])[np.argsort(-share)]:
        if len(places) < count and all(np.abs(place - other).max() > TEST_SPACING for other in places):
            places.append(place)
    made = len(runs.xi)
    if runs.left < count or runs(np.array(places)) == 0:
        return error
    missed = np.abs(surrogate(runs.xi[made:]) - runs.values[made:]).max(axis=0)
    return np.maximum(error, study.largest(missed, runs.values))


def _attain(study: Study, surrogate: Surrogate, named: Extremes) -> None:
    """Make the runs at the arguments of the extremes: one attains all that the surrogate predicts no better elsewhere.

    Of all arguments that one is next whose run attains most; as many as the gap that is asked for takes, or `ATTAINING`
    times the fair number of runs.
    """
    runs, values = study.runs, study.runs.values
    most = runs.left if study.gap is not None else min(runs.left, ATTAINING * study.fair)
    near = ATTAINED * (study.gap or FINE_GAP) * study.widths(values)
    best = np.concatenate([named.lower, -named.upper])
    signs, near = np.repeat([1.0, -1.0], len(named.lower)), np.tile(near, 2)
    open_sides = np.concatenate([values.min(axis=0), -values.max(axis=0)]) > best + near
    places = np.concatenate([named.at_lower, named.at_upper])
    made = 0
    while open_sides.any() and made < most:
        chosen: list[Array] = []
        left = open_sides.copy()
        while left.any() and len(chosen) < min(AT_ONCE, most - made):
            place = places[np.flatnonzero(left)[left.sum() // 2]]
            chosen.append(place)
            answers = surrogate(place[None])[0]
            left &= signs * np.tile(answers, 2) > best + near
            left[np.all(places == place, axis=1)] = False
        runs.named += runs(np.array(chosen))
        made += len(chosen)
        open_sides = left


def _horizon(study: Study, gap: Array) -> float:
    """The last instant up to which outer and attained bounds meet [s]; infinite if they do at all, or are unknown."""
    first = study.instants[np.nan_to_num(gap) > max(study.gap or 0.0, BELIEVED)].min(initial=math.inf)
    if math.isinf(first):
        return math.inf
    return float(study.instants[study.instants < first].max(initial=0.0))
