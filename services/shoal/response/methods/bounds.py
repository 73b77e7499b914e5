"""Bounds over a box that runs attain: fit a polynomial, run its extremal points, enter them into the fit, go on.

Runs are made where the answer is decided; the difference between what the polynomial predicted there and what the run
says is its error. The degree grows until the predicted bounds and the attained ones meet.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from shoal.response.design import APART, Screened, box_design, screened
from shoal.response.enclosure import contradicts, control_misses, enclose, enclosure, with_controls
from shoal.response.expansion import Expansion, fit
from shoal.response.extremes import Extremes, extremes
from shoal.response.polynomials import HIGHEST
from shoal.response.regularised import Decay, likeliest, regularised, trimmed
from shoal.response.runs import TooManyRunsError
from shoal.response.study import CLEARLY, FINE_GAP, PER_TERM, DatedEnclosure, Found, Study
from shoal.trajectory import Array

HOPELESS = 0.4
"""Instants whose gap is above this share of the width when a fair number of runs is made lie beyond the horizon."""
ENOUGH = 4
"""Times the fair number of runs after which it is looked for."""
FEW = 2
"""New extremal points after which the degree grows at once."""
ROUNDS = 12
"""Parts of the fair number of runs: as many extremal points are run at once, at most."""
SPARED = 20
"""One in so many of the fair number of runs is kept for extremal points of the last degree."""
MISSED = {2: 0.1, 4: 0.01}
"""More terms than runs are tried where a polynomial of so many degrees or more misses so much of the width."""
MORE = 8
"""Times the fair number of runs: no study goes beyond that by itself."""


@dataclass(frozen=True)
class StudyState:
    """State of a study.

    surrogate: fitted to all runs; error: of the last one at runs that it had not seen, (columns,); gap: by which outer
    bounds lie at least beyond attained ones, as a share of the width, (columns,); found: extremal points that were run;
    looked: the bounds, where they may end the study; decay: of coefficients, where it is known
    """

    surrogate: Expansion
    error: Array
    gap: Array
    found: int
    enclosed: DatedEnclosure | None = None
    decay: Decay | None = None


def bounds(study: Study) -> Found:
    """Bound the answers. Raises InputError."""
    runs, parameters = study.runs, len(study.inputs)
    unit = np.eye(parameters)
    runs(np.vstack([np.zeros((1, parameters)), unit, -unit]))
    plan = screened(study)
    _run_signs(plan, _fit_columns(plan, 1))
    here, degree = _grown(plan, _round(plan, 1), 1)
    with suppress(TooManyRunsError):
        missed = control_misses(study, here.surrogate)
        surprising = contradicts(study, missed, here.error) & (study.instants < horizon(study, here.gap))
        here = replace(here, enclosed=with_controls(study, here.enclosed))
        if surprising.any():
            here = replace(here, error=study.with_neighbours(np.maximum(here.error, missed)), enclosed=None)
            here, _ = _grown(plan, _round(plan, degree, here.decay), degree)
    top = int(here.surrogate.terms.sum(axis=1).max())
    kind = "regularised " if len(here.surrogate.terms) > len(runs.xi) / PER_TERM else ""
    why = f"{kind}polynomials of total degree {top}; their extremal points are run and entered into the fit{plan.why}"
    return Found(why, here.surrogate, here.error, enclosed=here.enclosed)


def _grown(plan: Screened, here: StudyState, degree: int) -> tuple[StudyState, int]:
    """Grow the degree until outer and attained bounds meet, or no more runs help; also returns the degree."""
    again = 0
    with suppress(TooManyRunsError):
        while not _done(plan, here):
            # New extremal points teach more than a higher degree, once.
            again = 0 if again or here.found <= FEW else 1
            degree = degree if again else _next(plan, degree)
            here = _round(plan, degree, here.decay)
    return here, degree


def _next(plan: Screened, degree: int) -> int:
    """The degree that the runs there are carry, after some for one more at least. Raises TooManyRunsError."""
    study = plan.study
    made = len(study.runs.xi)
    wanted = degree + 1
    while PER_TERM * plan.size(wanted + 1) <= made and wanted - degree < 3:
        wanted += 1
    if wanted >= HIGHEST or study.runs.own > MORE * plan.fair:
        raise TooManyRunsError
    missing = math.ceil(PER_TERM * plan.size(wanted)) - made
    if made < plan.fair:
        # Extremal points come after these, and the fair number holds both.
        missing = min(missing, plan.fair - made - max(1, plan.fair // SPARED))
    if missing > 0:
        terms = plan.terms(wanted)
        study.runs(box_design(study.inputs, study.runs.xi, terms, missing, study.seed + wanted))
    return wanted if _carried(plan, wanted) else degree


def _carried(plan: Screened, degree: int) -> bool:
    """Return whether the good runs there are carry that degree."""
    return len(plan.study.runs.xi) >= PER_TERM * plan.size(degree)


def _fit_columns(plan: Screened, degree: int) -> Expansion:
    """Fit every column by this degree, or by a lower one of much smaller leave-one-out error."""
    inputs, runs = plan.study.inputs, plan.study.runs
    best = fit(inputs, runs.xi, runs.values, plan.terms(degree))
    for lower in range(degree - 1, 0, -1):
        other = fit(inputs, runs.xi, runs.values, plan.terms(lower))
        better = (other.left_out < CLEARLY * best.left_out) | (not best.whole)
        if better.any():
            fewer = np.zeros_like(best.coefficients)
            fewer[: len(other.terms)] = other.coefficients
            coefficients = np.where(better, fewer, best.coefficients)
            left_out = np.where(better, other.left_out, best.left_out)
            best = Expansion(inputs, best.terms, coefficients, left_out, whole=best.whole or other.whole)
    return best


def _falling(plan: Screened, found: Expansion, degree: int, before: Decay | None) -> Decay | None:
    """Return the decay of coefficients in the worst column of every group; None where all are predicted well.

    before: of fewer runs
    """
    study, runs = plan.study, plan.study.runs
    widths, least = study.widths(runs.values), min((share for d, share in MISSED.items() if degree >= d), default=1.0)
    coarse = (widths > 0) & (np.ptp(runs.values, axis=0) > 0) & (found.left_out > least * widths)
    missed = np.where(coarse, found.left_out, -1.0)
    worst = [int(np.where(study.groups == group, missed, -1.0).argmax()) for group in np.unique(study.groups[coarse])]
    return likeliest(study.inputs, runs.xi, runs.values[:, worst], before) if worst else None


def _with_more_terms(plan: Screened, found: Expansion, decay: Decay | None) -> Expansion:
    """Return each column with more terms than runs, unless the leave-one-out error of the other is clearly smaller."""
    if decay is None:
        return found
    runs = plan.study.runs
    other = regularised(plan.study.inputs, runs.xi, runs.values, decay)
    better = CLEARLY * other.left_out < found.left_out
    return trimmed(other.where(better, found)) if better.any() else found


def _run_signs(plan: Screened, linear: Expansion) -> None:
    """The corners that the signs of the gradients point to, the most frequent ones first."""
    study = plan.study
    parameters = len(study.inputs)
    slopes = linear.coefficients[1 : parameters + 1].T
    terms = linear.terms[1 : parameters + 1]
    signs = np.where(slopes @ terms >= 0, 1.0, -1.0)[np.abs(slopes).max(axis=1) > 0]
    if not len(signs):
        return
    ways, count = np.unique(np.vstack([signs, -signs]), axis=0, return_counts=True)
    most = max(2, min(2 * parameters, plan.fair // 4))
    study.runs(ways[np.argsort(-count, kind="stable")[:most]])


def _round(plan: Screened, degree: int, before: Decay | None = None) -> StudyState:
    """Fit, find the extremal points, run those that promise most, fit again."""
    study, runs, parameters = plan.study, plan.study.runs, len(plan.study.inputs)
    surrogate, columns = _fit_columns(plan, degree), runs.values.shape[1]
    decay = _falling(plan, surrogate, degree, before)
    surrogate = _with_more_terms(plan, surrogate, decay)
    found = extremes(surrogate, parameters, columns, study.seed + degree, rough=True, known=runs.attaining)
    new = _promising(plan, surrogate, found)
    made = len(runs.xi)
    if runs(new) == 0:
        # Nothing new is predicted: a few places test that.
        runs(study.inputs.sobol(parameters + 1, study.seed + 1, runs.evaluations))
    error = np.abs(surrogate(runs.xi[made:]) - runs.values[made:]).max(axis=0, initial=0.0)
    # New runs lie where the polynomial is known best; those left out of the fit lie everywhere.
    error = study.with_neighbours(np.maximum(error, surrogate.left_out))
    if _carried(plan, degree):
        # The new runs make the polynomial better; its error is what it was without them.
        surrogate = _with_more_terms(plan, _fit_columns(plan, degree), decay)
    # What shows at once that a study is not done saves the rest, unless the horizon is looked for.
    enclosed = None
    gap = enclosure(study, surrogate, found, error, look="there").gap
    if gap.max() <= _enough(plan) or _late(plan):
        gap = enclosure(study, surrogate, found, error, look="scanned").gap
    if gap.max() <= _enough(plan):
        # If this ends the study it is the answer.
        enclosed = enclose(study, surrogate, error)
        gap = enclosed.enclosure.gap
    return StudyState(surrogate, error, gap, len(new), enclosed, decay)


def _promising(plan: Screened, surrogate: Expansion, found: Extremes) -> Array:
    """Extremal points that are predicted to widen the attained bounds most, beside what those chosen before do.

    Groups take turns, so that one that is hard to fit does not take all runs from those that few more would settle.
    """
    study, runs = plan.study, plan.study.runs
    least = 0.25 * (study.gap or FINE_GAP)
    low, high = runs.values.min(axis=0), runs.values.max(axis=0)
    width = np.tile(study.widths(runs.values), 2)
    places = np.concatenate([found.at_lower, found.at_upper])
    predicted = surrogate(places)
    most = max(2, plan.fair // ROUNDS)
    if runs.own < plan.fair:
        most = min(most, plan.fair - runs.own)
    names, varies = np.unique(study.groups), width > 0
    member = np.tile(study.groups, 2) == names[:, None]
    turns = dict.fromkeys(range(len(names)), 0)
    known, chosen = runs.xi, list[Array]()
    share: Array | None = None
    while len(chosen) < most:
        if share is None:
            gains = np.concatenate([low - found.lower, found.upper - high])
            share = np.divide(gains, width, out=np.zeros_like(gains), where=varies)
            share[share < least] = 0.0
            mine = np.where(member, share, 0.0)
        best = mine.argmax(axis=1).tolist()
        left = [group for group, k in enumerate(best) if share[k] > 0]
        if not left:
            break
        # Of the groups that were served least the one that gains most.
        group = min(left, key=lambda one: (turns[one], -mine[one, best[one]]))
        k, turns[group] = best[group], turns[group] + 1
        varies[k], share[k], mine[:, k] = False, 0.0, 0.0
        if np.min(np.max(np.abs(known - places[k]), axis=1)) > APART:
            chosen.append(places[k])
            known, share = np.vstack([known, places[k]]), None
            low, high = np.minimum(low, predicted[k]), np.maximum(high, predicted[k])
    return np.array(chosen).reshape(-1, len(study.inputs))


def _enough(plan: Screened) -> float:
    """Gap that ends a study: that of the request, else the one that a fair number of runs gives."""
    study = plan.study
    if study.gap is not None:
        return study.gap
    return FINE_GAP if study.runs.own < plan.fair else HOPELESS


def _late(plan: Screened) -> bool:
    """Return whether enough runs are made to look for the horizon."""
    return plan.study.runs.own >= ENOUGH * plan.fair


def _done(plan: Screened, here: StudyState) -> bool:
    study, wanted = plan.study, _enough(plan)
    if here.gap.max() <= wanted:
        return True
    if not _late(plan):
        return False
    # Beyond the horizon no number of runs helps.
    return bool(np.all((here.gap <= wanted) | (study.instants >= horizon(study, here.gap))))


def horizon(study: Study, gap: Array) -> float:
    """The first instant with a gap beyond hope [s], infinite if there is none."""
    hopeless = study.instants[gap > HOPELESS]
    return float(hopeless.min()) if hopeless.size else math.inf
