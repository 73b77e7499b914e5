"""The probability that a limit is exceeded where some parameters are random and others intervals: between which two.

The reliability index beta is a smooth function of the intervals. It is bounded as places of markers are: few runs of a
reliability analysis at each of some interval values, a polynomial through their indices, whose extremal values are
looked at and entered into the fit. Where the index is least and largest, all runs tell the probability.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy import special

from shoal.response.enclosure import enclosure
from shoal.response.extremes import extremes
from shoal.response.inputs import Inputs
from shoal.response.limits import Limit, LimitResult, VerifiedRun, judge
from shoal.response.limits.choice import probability
from shoal.response.limits.judge import watched
from shoal.response.limits.margins import FAR, Margins
from shoal.response.limits.result import ProbabilityBounds
from shoal.response.machine import ResponseModel
from shoal.response.methods.nested import best
from shoal.response.respond import ModelResponse, respond
from shoal.response.runs import Answers, CachedModel
from shoal.response.study import Study
from shoal.trajectory import Array

SHARE, LEAST = 5, 500
"""One in so many of the runs that a probability takes, but this number at least, tells the index while it is sought."""
PLACES, MORE = 12, 6
"""Interval values that are looked at, and more for each interval, at most."""
SHARED = 2
"""Times as many indices as a plane through them has terms, at least, if some are left out of a fit."""
GAP = 0.05
"""Share of the spread of the index that is good enough."""


def between(
    limit: Limit,
    machine: ResponseModel,
    inputs: Inputs,
    *,
    way: str,
    most: int,
    seed: int,
    verify: bool,
    progress: Callable[[int], None] | None,
) -> LimitResult:
    """The least and the largest probability, with the interval values there. Raises InputError, ComputationError."""
    given, random = inputs.some(~inputs.random), inputs.some(inputs.random)
    few = min(most, max(LEAST, most // SHARE))
    answer, made, failed = searched(limit, machine, inputs, way=way, few=few, seed=seed, progress=progress)
    bounds = answer.bounds
    assert bounds is not None
    ends = []
    for k, named in enumerate((bounds.at_upper[0], bounds.at_lower[0])):
        values = given.at(named)
        # Other seeds than while it was sought: what was least by chance is not told as the least.
        here, on, other = machine.at(values), _on(progress, made), seed + 101 + k
        one = judge(limit, here, random, _no_reach, way=way, most=most, seed=other, verify=verify, progress=on)
        made, failed = made + one.evaluations, failed + one.failed
        ends.append((one, dict(zip(given.names, named.tolist(), strict=True)), values))
    (lower, at_lower, _), (upper, at_upper, there) = ends
    beyond = _beyond(answer.runs, seed)
    found = ProbabilityBounds(lower, upper, at_lower, at_upper, beyond, answer.runs.evaluations)
    return LimitResult(
        *(limit, way, inputs, machine.times, None, None, float("nan"), float("nan")),
        *(_with(upper.shown, at_upper, there), made, failed, upper.reason or lower.reason, found),
    )


def searched(
    limit: Limit,
    machine: ResponseModel,
    inputs: Inputs,
    *,
    way: str,
    few: int,
    seed: int,
    progress: Callable[[int], None] | None = None,
) -> tuple[ModelResponse, int, int]:
    """Bounds of the reliability index over the intervals, runs made, and how many failed.

    few: runs at each interval value, at most. Raises InputError, ComputationError.
    """
    given, random, made, failed = inputs.some(~inputs.random), inputs.some(inputs.random), 0, 0

    def index(values: Mapping[str, Array]) -> Answers:
        """Of every place."""
        nonlocal made, failed
        found = np.full((len(next(iter(values.values()))), 1), np.nan)
        why = ""
        for k in range(len(found)):
            here = machine.at({path: float(at[k]) for path, at in values.items()})
            margins = Margins(watched(here, limit), random, few, _on(progress, made))
            passing = probability(margins, way, seed)
            found[k] = np.clip(-special.ndtri(passing.estimate.probability), -FAR, FAR)
            made, failed = made + margins.evaluations, failed + margins.failed
            why = why or (passing.why if np.isnan(found[k, 0]) else "")
        return Answers(found, np.isfinite(found[:, 0]), 0, why)

    answer = respond(index, given, 1, gap=GAP, seed=seed, most=PLACES + MORE * len(given))
    return answer, made, failed


def _beyond(runs: CachedModel, seed: int) -> tuple[float, float]:
    """By how much the index may be above the largest one that is known, and below the least.

    Indices are known to the scatter of few runs: of all polynomials the one that foretells left-out ones best tells. Of
    those that are FAR nothing else is known, and beyond them lies no probability to tell: they stay out of the fit.
    """
    near = runs.values[:, 0] < FAR
    some = not near.all() and near.sum() > SHARED * (len(runs.inputs) + 1)
    runs = runs.part(near) if some else runs
    study = Study(runs, np.zeros(1, dtype=np.int64), np.zeros(1), seed)
    surrogate = best(study)
    found = extremes(surrogate, len(runs.inputs), 1, seed)
    told = enclosure(study, surrogate, found, surrogate.left_out)
    return 0.0 if some else float(told.upper_outer[0] - told.upper[0]), float(told.lower[0] - told.lower_outer[0])


def _on(progress: Callable[[int], None] | None, made: int) -> Callable[[int], None] | None:
    return None if progress is None else lambda runs: progress(made + runs)


def _with(shown: VerifiedRun | None, named: dict[str, float], values: dict[str, float]) -> VerifiedRun | None:
    """A run with the values of the intervals as well."""
    if shown is None:
        return None
    return replace(shown, parameters={**named, **shown.parameters}, values={**values, **shown.values})


def _no_reach(_: object, _size: float) -> tuple[Array, Array, Array, int, int]:
    raise AssertionError("all parameters are random here")
