"""Bounds from the runs of a study: attained ones, outer ones by the error of its surrogate, and how long they hold."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from shoal.response import control
from shoal.response.enclosure import enclosure, foretold
from shoal.response.extremes import Extremes, Surrogate, extremes
from shoal.response.result import Bounds
from shoal.response.runs import TooManyRunsError
from shoal.response.study import FINE_GAP, Enclosure, Found, Study
from shoal.trajectory import Array

DRAWN = 93
"""Random runs between whose extremes 95 % of all lie with 95 % confidence: 1 - 0.95^n - n 0.05 0.95^(n-1) >= 0.95."""
TESTED, APART = 1, 0.05
"""Extremal points that are run for each parameter, and how far apart, where a surrogate of cycles tells the bounds."""
ATTAINING, AT_ONCE = 16, 64
"""Times the fair number of runs that are made at most to attain bounds of a surrogate of cycles, so many at once."""
ATTAINED = 0.1
"""Share of the gap by which a run may lie inside what is foretold and count as attaining it."""
STARTS = 8
"""Searches for the extremes of a surrogate of cycles."""
BELIEVED = 0.2
"""Of the width: the largest gap of bounds that are told. A surrogate that misses more has not seen what is there."""


def bounds_of(study: Study, found: Found) -> Bounds:
    """Attained bounds of all runs, after the extremal points of the surrogate are run, and outer ones by its error."""
    runs, error, surrogate = study.runs, found.error, found.surrogate
    named = None
    known = found.looked is not None and found.looked.runs == runs.evaluations
    if surrogate is not None and not known:
        # Over many cycles there are many extremes.
        how = (STARTS, error) if found.foretold else (1, None)
        named = extremes(surrogate, len(study.inputs), runs.values.shape[1], study.seed, *how)
        if error is None:
            error = _confirmed(study, surrogate, named)
        elif found.foretold:
            error = _tested(study, surrogate, named, error)
        if error is not None and not runs.controls:
            error = _controlled(study, surrogate, error)
        if found.foretold:
            _attain(study, surrogate, named)
    values, germs = runs.values, runs.germs
    at_lower, at_upper = germs[values.argmin(axis=0)], germs[values.argmax(axis=0)]
    lower, upper = values.min(axis=0), values.max(axis=0)
    unknown = np.full(len(lower), np.nan)
    told = Enclosure(lower, upper, unknown, unknown, unknown)
    if known and found.looked is not None:
        told = found.looked.told
    elif surrogate is not None and named is not None and error is not None:
        told = (foretold if found.foretold else enclosure)(study, surrogate, named, error)
    end = _horizon(study, told.gap)
    within = told.gap[study.instants <= end]
    return Bounds(
        told.lower,
        told.upper,
        told.lower_outer,
        told.upper_outer,
        study.inputs.named(at_lower),
        study.inputs.named(at_upper),
        float(within.max()) if within.size else math.nan,
        end,
    )


def likely(study: Study, bounds: Bounds) -> Bounds:
    """Beyond the horizon: between the least and the largest of 93 random runs lie, with 95 % confidence, 95 % of all.

    Whatever the distribution of the answers (Wilks, Determination of sample sizes for setting tolerance limits, Annals
    of Mathematical Statistics 12, 1941); the intervals are taken as evenly likely.
    """
    runs, made, failed = study.runs, len(study.runs.germs), study.runs.failed
    runs.all(study.inputs.drawn(DRAWN, study.seed + 1))
    if runs.failed > failed:
        return bounds
    drawn, germs = runs.values[made:], study.inputs.named(runs.germs[made:])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    lower, upper = low < bounds.lower, high > bounds.upper
    return replace(
        bounds,
        lower=np.where(lower, low, bounds.lower),
        upper=np.where(upper, high, bounds.upper),
        lower_outer=np.fmin(bounds.lower_outer, low),
        upper_outer=np.fmax(bounds.upper_outer, high),
        at_lower=np.where(lower[:, None], germs[drawn.argmin(axis=0)], bounds.at_lower),
        at_upper=np.where(upper[:, None], germs[drawn.argmax(axis=0)], bounds.at_upper),
        likely=np.stack([low, high]),
    )


def _confirmed(study: Study, surrogate: Surrogate, foretold: Extremes) -> Array | None:
    """The error of a surrogate at its own extremal points, which are run; None if there are no runs left for it.

    At least that at runs that are left out of it, where it knows that.
    """
    runs = study.runs
    wanted: Array = np.unique(np.round(np.vstack([foretold.at_lower, foretold.at_upper]), 2), axis=0)
    wanted = wanted[: max(0, min(len(wanted), runs.left, study.fair))]
    made = len(runs.germs)
    if not len(wanted) or runs(wanted) == 0:
        return None
    missed = np.abs(surrogate(runs.germs[made:]) - runs.values[made:]).max(axis=0, initial=0.0)
    return np.asarray(np.maximum(missed, getattr(surrogate, "left_out", 0.0)))


def _controlled(study: Study, surrogate: Surrogate, error: Array) -> Array:
    """The error of a surrogate, or what it misses of runs all over the box that contradict it."""
    with suppress(TooManyRunsError):
        missed = control.missed(study, surrogate)
        return np.where(control.contradict(study, missed, error), missed, error)
    return error


def _tested(study: Study, surrogate: Surrogate, named: Extremes, error: Array) -> Array:
    """The error of a surrogate of cycles, or its error at the extremal points that promise most, which are run.

    Elsewhere it may foretell well and still miss there: a ball that touches the ground has its least height in a cusp.
    """
    runs, count = study.runs, TESTED * len(study.inputs)
    values = runs.values
    width = np.tile(study.widths(values), 2)
    gains = np.concatenate([values.min(axis=0) - named.lower, named.upper - values.max(axis=0)])
    share = np.divide(gains, width, out=np.zeros_like(gains), where=width > 0)
    places: list[Array] = []
    for place in np.concatenate([named.at_lower, named.at_upper])[np.argsort(-share)]:
        if len(places) < count and all(np.abs(place - other).max() > APART for other in places):
            places.append(place)
    made = len(runs.germs)
    if runs.left < count or runs(np.array(places)) == 0:
        return error
    missed = np.abs(surrogate(runs.germs[made:]) - runs.values[made:]).max(axis=0)
    return np.maximum(error, study.largest(missed, runs.values))


def _attain(study: Study, surrogate: Surrogate, named: Extremes) -> None:
    """Make the runs at the arguments of the extremes: one attains all that the surrogate foretells no better elsewhere.

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
            told = surrogate(place[None])[0]
            left &= signs * np.tile(told, 2) > best + near
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
