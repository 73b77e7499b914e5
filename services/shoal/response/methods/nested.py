"""Intervals and distributions together: one expansion over all of them, with runs where its statistics are extreme.

Eldred, Swiler and Tang, Mixed aleatory-epistemic uncertainty quantification with stochastic expansions and
optimization-based interval estimation, Reliability Engineering and System Safety 96, 2011.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shoal.errors import InputError
from shoal.response import degrees
from shoal.response.boxes import HOPELESS, scatter
from shoal.response.conditional import Above, Conditional, Mean
from shoal.response.expansion import Expansion
from shoal.response.extremes import MOST_CORNERS, Extremes, corners, extremes
from shoal.response.inputs import Inputs
from shoal.response.outermost import hidden, outwards
from shoal.response.polynomials import size
from shoal.response.runs import TooManyRunsError
from shoal.response.study import SAFETY, Found, Study
from shoal.trajectory import Array

SHARE = 1.6
"""Runs for every term, at least."""
FIRST = 64
"""Runs to begin with, see `control`; they are doubled."""
RUNS = 300
"""That are made unless the expansion is coarse by then."""
COARSE, MORE = 1e-2, 6
"""Above this gap more runs are made: so many times."""
FINE = 1e-4
"""The gap that is aimed at where none is asked for: a share of the scatter."""
INNER = 8
"""Runs at each of the interval values that decide, and one more for each random parameter."""
APART = 0.15
"""Interval germs that are nearer to each other are one place."""
ENOUGH = 1
"""Times the fair number of runs after which the horizon is looked for."""


def nested(study: Study) -> Found:
    """Of `degree`, or of the degree that foretells best what is left out of its fit. Raises InputError."""
    inputs, runs = study.inputs, study.runs
    if not inputs.mixed:
        raise InputError("vary: method nested needs an interval and a distribution; auto takes either alone")
    fair, wanted = study.count or RUNS, study.gap or FINE
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
            before = len(runs.germs)
            # What it foretells of these runs, which it was not fitted to, tells how far off it is.
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


def _towards_ends(inputs: Inputs, germs: Array) -> Array:
    """Denser towards the ends of the intervals, where polynomials need runs."""
    return np.where(inputs.random, germs, np.sin(0.5 * np.pi * germs))


def best(study: Study) -> Expansion:
    """In every column of the degree that tells most."""
    return degrees.best(study, SHARE, lambda found: _reaching(study, found))


def _reaching(study: Study, found: Expansion) -> Expansion:
    """With the error further out than runs tell, at the middle and the ends of the intervals."""
    if not study.inputs.mixed:
        return found
    found, count = outwards(study.runs.germs, study.runs.values, found), int((~study.inputs.random).sum())
    ends = corners(count) if count < MOST_CORNERS // 2 else np.vstack([np.eye(count), -np.eye(count)])
    of, columns = Conditional(found), study.runs.values.shape[1]
    for place in (np.zeros(count), *ends):
        found = replace(found, left_out=np.maximum(found.left_out, _hidden(of, np.tile(place, (columns, 1)))))
    return found


def _hidden(of: Conditional, given: Array) -> Array:
    """Of every column at interval germs of its own, (columns, intervals)."""
    return hidden(of.each(given, np.arange(len(given))), of.random, of.terms)


def _extremes(study: Study, found: Expansion) -> list[Extremes]:
    """Of mean and deviation."""
    of, columns = Conditional(found), study.runs.values.shape[1]
    return [extremes(one, len(of.intervals), columns, study.seed) for one in (Mean(of), Above(of))]


def _deciding(sides: list[Extremes]) -> Array:
    """Interval germs where most statistics are extreme, apart from each other, (places, intervals)."""
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
    each = INNER + int(random.sum())
    germs = np.empty((len(where) * each, len(inputs)))
    germs[:, ~random] = np.repeat(where, each, axis=0)
    germs[:, random] = inputs.some(random).sobol(len(germs), seed)
    return germs


def _unseen(study: Study, found: Expansion, where: Array, before: int) -> Array:
    """Error at the runs since then, the largest over interval values, roots of mean squares, (columns,)."""
    germs, values = study.runs.germs[before:], study.runs.values[before:]
    squares, given = (found(germs) - values) ** 2, germs[:, ~study.inputs.random]
    groups = [squares[(given == place).all(axis=1)] for place in where]
    return np.asarray(np.sqrt(np.max([group.mean(axis=0) for group in groups if len(group)], axis=0)))


def _gap(study: Study, error: Array, sides: list[Extremes], late: bool) -> float:
    """The largest; late: before the horizon, beyond which no number of runs helps."""
    scale = scatter(study, *sides)
    gaps = np.divide(SAFETY * error, scale, out=np.zeros_like(error), where=scale > 0)
    end = study.instants[gaps > HOPELESS].min(initial=math.inf) if late else math.inf
    return float(gaps[study.instants < end].max(initial=0.0))
