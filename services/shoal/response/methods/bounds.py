"""Bounds over a box that runs attain: fit a polynomial, run its extremal points, enter them into the fit, go on.

Runs are made where the answer is decided; the difference between what the polynomial foretold there and what the run
says is its error. The degree grows until the foretold bounds and the attained ones meet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shoal.response.design import box_design
from shoal.response.enclosure import enclosure
from shoal.response.expansion import Expansion, fit
from shoal.response.extremes import Extremes, extremes
from shoal.response.polynomials import HIGHEST, size, total_degree
from shoal.response.runs import TooManyRunsError
from shoal.response.study import FAIR_GAP, FINE_GAP, Found, Study
from shoal.trajectory import Array

SHARE = 1.25
"""Runs for every term, at least."""
HOPELESS = 0.1
"""Instants whose gap is above this share of the width when a fair number of runs is made lie beyond the horizon."""
ENOUGH = 4
"""Times the fair number of runs after which it is looked for."""
FEW = 2
"""New extremal points after which the degree grows at once."""
MORE = 8
"""Times the fair number of runs: no study goes beyond that by itself."""


@dataclass(frozen=True)
class Round:
    """Where a study stands.

    surrogate: fitted to all runs; error: of the last one at runs that it had not seen, (columns,); gap: by which outer
    bounds lie beyond attained ones, as a share of the width, (columns,); found: extremal points that were run
    """

    surrogate: Expansion
    error: Array
    gap: Array
    found: int


def bounds(study: Study) -> Found:
    """Raises InputError."""
    runs, parameters = study.runs, len(study.inputs)
    unit = np.eye(parameters)
    runs(np.vstack([np.zeros((1, parameters)), unit, -unit]))
    first = _foretold(study, 1)
    _run_signs(study, first)
    here, degree, again = _round(study, 1), 1, 0
    try:
        while not _done(study, here):
            # New extremal points teach more than a higher degree, once.
            again = 0 if again or here.found <= FEW else 1
            degree = degree if again else _next(study, degree)
            here = _round(study, degree)
    except TooManyRunsError:
        pass
    top = int(here.surrogate.terms.sum(axis=1).max())
    why = f"polynomials of total degree {top}; their extremal points are run and entered into the fit"
    return Found(why, here.surrogate, here.error)


def _next(study: Study, degree: int) -> int:
    """The degree that the runs there are carry, at least one more. Raises TooManyRunsError."""
    parameters, made = len(study.inputs), len(study.runs.germs)
    wanted = degree + 1
    while SHARE * size(parameters, wanted + 1) <= made and wanted - degree < 3:
        wanted += 1
    if wanted >= HIGHEST or study.runs.evaluations > MORE * study.fair:
        raise TooManyRunsError
    missing = math.ceil(SHARE * size(parameters, wanted)) - made
    if made < study.fair:
        # Extremal points come after these, and the fair number holds both.
        missing = min(missing, study.fair - made - 1)
    if missing > 0:
        terms = total_degree(parameters, wanted)
        study.runs(box_design(study.inputs, study.runs.germs, terms, missing, study.seed + wanted))
    return wanted


def _foretold(study: Study, degree: int) -> Expansion:
    runs = study.runs
    return fit(study.inputs, runs.germs, runs.values, total_degree(len(study.inputs), degree))


def _run_signs(study: Study, linear: Expansion) -> None:
    """The corners that the signs of the gradients point to, the most frequent ones first."""
    parameters = len(study.inputs)
    slopes = linear.coefficients[1 : parameters + 1].T
    terms = linear.terms[1 : parameters + 1]
    signs = np.where(slopes @ terms >= 0, 1.0, -1.0)[np.abs(slopes).max(axis=1) > 0]
    if not len(signs):
        return
    ways, count = np.unique(np.vstack([signs, -signs]), axis=0, return_counts=True)
    most = max(2, min(2 * parameters, study.fair // 4))
    study.runs(ways[np.argsort(-count, kind="stable")[:most]])


def _round(study: Study, degree: int) -> Round:
    """Fit, find the extremal points, run those that promise most, fit again."""
    runs, parameters = study.runs, len(study.inputs)
    surrogate = _foretold(study, degree)
    found = extremes(surrogate, parameters, runs.values.shape[1], study.seed + degree)
    width = study.widths(runs.values)
    new = _promising(study, found, width)
    made = len(runs.germs)
    if runs(new) == 0:
        # Nothing new is foretold: a few places tell whether that can be believed.
        runs(study.inputs.sobol(parameters + 1, study.seed + 1, runs.evaluations))
    error = np.abs(surrogate(runs.germs[made:]) - runs.values[made:]).max(axis=0, initial=0.0)
    # New runs lie where the polynomial is known best; those left out of the fit lie everywhere.
    error = np.maximum(error, surrogate.left_out)
    if len(runs.germs) >= SHARE * size(parameters, degree):
        # What the new runs tell makes the polynomial better; its error is what it was without them.
        surrogate = _foretold(study, degree)
        found = extremes(surrogate, parameters, runs.values.shape[1], study.seed + degree)
    gap = enclosure(study, surrogate, found, error, rough=True).gap
    if gap.max() <= (study.gap or FAIR_GAP):
        gap = enclosure(study, surrogate, found, error).gap
    return Round(surrogate, error, gap, len(new))


def _promising(study: Study, found: Extremes, width: Array) -> Array:
    """Extremal points that are foretold to widen the attained bounds, apart from each other and from what was run."""
    runs, wanted = study.runs, study.gap or FINE_GAP
    gains = np.concatenate([runs.values.min(axis=0) - found.lower, found.upper - runs.values.max(axis=0)])
    places = np.concatenate([found.at_lower, found.at_upper])
    share = np.divide(gains, np.concatenate([width, width]), out=np.zeros_like(gains), where=np.tile(width, 2) > 0)
    apart = max(1e-3, min(0.1, math.sqrt(wanted)))
    most = max(2, min(3 * len(study.inputs), study.fair // 8))
    if runs.evaluations < study.fair:
        most = min(most, study.fair - runs.evaluations)
    chosen: list[Array] = []
    beside = runs.germs
    for k in np.argsort(-share):
        if share[k] < 0.25 * wanted or len(chosen) == most:
            break
        if np.min(np.max(np.abs(beside - places[k]), axis=1)) > apart:
            chosen.append(places[k])
            beside = np.vstack([beside, places[k]])
    return np.array(chosen).reshape(-1, len(study.inputs))


def _done(study: Study, here: Round) -> bool:
    """Whether the gap is as asked for or, where none was, as small as a fair number of runs makes it."""
    if study.gap is not None:
        if here.gap.max() <= study.gap:
            return True
        wanted = study.gap
    else:
        if here.gap.max() <= FINE_GAP:
            return True
        wanted = FAIR_GAP
    if study.runs.evaluations < study.fair:
        return False
    if study.runs.evaluations < ENOUGH * study.fair:
        return bool(here.gap.max() <= wanted)
    # Beyond the horizon no number of runs helps.
    return bool(np.all((here.gap <= wanted) | (study.instants >= horizon(study, here.gap))))


def horizon(study: Study, gap: Array) -> float:
    """The first instant with a gap beyond hope [s], infinite if there is none."""
    hopeless = study.instants[gap > HOPELESS]
    return float(hopeless.min()) if hopeless.size else math.inf
