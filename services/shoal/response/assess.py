"""Results of the limits of a study, and what they imply for its statistics.

The probability that a limit is exceeded where some parameters are random and others intervals lies between two: the
reliability index beta is a smooth function of the intervals. It is bounded as places of markers are: few runs of a
reliability analysis at each of some interval values, a polynomial through their indices, whose extremal values are
determined and entered into the fit. Where the index is least and largest, all runs estimate the probability.

Runs that are drawn from the distributions estimate a probability without bias, if roughly; and a standard deviation
cannot be smaller than what lies beyond a limit makes it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import special

from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.enclosure import enclosure
from shoal.response.extremes import extremes
from shoal.response.inputs import Inputs, IntArray
from shoal.response.limits.choice import probability
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.exceedance import contradictions, ends
from shoal.response.limits.judge import Reach, judge, watched
from shoal.response.limits.limit import Limit
from shoal.response.limits.margins import FAR, Margins
from shoal.response.limits.result import LimitResult, ProbabilityBounds, VerifiedRun
from shoal.response.machine import ResponseModel
from shoal.response.methods.nested import best
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse, respond
from shoal.response.runs import Answers, CachedModel, Model, TimeIsUpError
from shoal.response.statistics import Statistics
from shoal.response.study import Study
from shoal.trajectory import Array

UNRESOLVED = 1e-8
"""Share of a limit's quantity below which runs differ by the errors of their steps only."""


def assess_limits(problem: UncertainProblem, found: ModelResponse) -> list[LimitResult]:
    """Return the results of the limits for which there is time. Raises InputError, ComputationError."""
    results = list[LimitResult]()
    with suppress(TimeIsUpError):
        for one in problem.limits:
            results.append(_assess(one, problem, found))
    return results


def _assess(limit: Limit, problem: UncertainProblem, found: ModelResponse) -> LimitResult:
    model, inputs = problem.model, problem.inputs
    if inputs.mixed:
        return between(limit, model, inputs, **options(problem))
    result = judge(limit, model, inputs, bound_margins(problem, inputs, problem.asked.gap), **options(problem))
    return crosschecked(result, model, found.drawn, shared=found.found.indices is not None)


def options(problem: UncertainProblem) -> dict[str, Any]:
    """Return the options of the assessment of a limit."""
    asked = problem.asked
    how = {"seed": asked.seed, "verify": asked.verify, "progress": asked.progress}
    return {"way": asked.limit_method, "most": asked.limit_runs, **how}


def bound_margins(problem: UncertainProblem, inputs: Inputs, gap: float | None) -> Reach:
    """Return a function that bounds the margins of a model over the intervals."""
    asked, times = problem.asked, problem.times

    def reach(model: Model, size: float) -> tuple[Array, Array, Array, int, int]:
        groups = np.zeros(len(times))
        found = respond(
            model, inputs, len(times), groups=groups, instants=times, gap=gap, seed=asked.seed, most=asked.runs
        )
        bounds, runs = found.bounds, found.runs
        assert bounds is not None
        outer = np.where(times <= bounds.horizon, bounds.lower_outer, -math.inf)
        values = runs.values
        spread = values.max(axis=0) - values.min(axis=0)
        if spread.max() <= UNRESOLVED * max(size, np.abs(values).max()):
            # No surrogate predicts the errors of a solver's steps: an energy that is the same in all runs.
            outer = bounds.lower - spread
        return bounds.lower, outer, runs.xi[runs.values.argmin(axis=0)], runs.evaluations, runs.failed

    return reach


def allow_for_limits(
    problem: UncertainProblem, statistics: Statistics | None, results: Sequence[LimitResult]
) -> tuple[Statistics | None, list[Finding]]:
    """Return statistics whose errors allow for the probabilities of limits, and what they have missed."""
    missed = list[Finding]()
    for one in results:
        if statistics is not None and one.exceedance is not None and not one.doubted:
            statistics, more = allowing(statistics, problem.model, one.limit, one.exceedance.estimate)
            missed += more
    return statistics, missed


SHARE, LEAST = 5, 500
"""One in so many of the runs for a probability, but this number at least, estimates the index during the search."""
PLACES, MORE = 12, 6
"""Interval values that are examined, and more for each interval, at most."""
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
        # Other seeds than while it was sought: what was least by chance is not reported as the least.
        here, on, other = machine.at(values), _counting(progress, made), seed + 101 + k
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
        """Return the reliability index at every place."""
        nonlocal made, failed
        found = np.full((len(next(iter(values.values()))), 1), np.nan)
        why = ""
        for k in range(len(found)):
            here = machine.at({path: float(at[k]) for path, at in values.items()})
            margins = Margins(watched(here, limit), random, few, _counting(progress, made))
            exceedance = probability(margins, way, seed)
            found[k] = np.clip(-special.ndtri(exceedance.estimate.probability), -FAR, FAR)
            made, failed = made + margins.evaluations, failed + margins.failed
            why = why or (exceedance.why if np.isnan(found[k, 0]) else "")
        return Answers(found, np.isfinite(found[:, 0]), 0, why)

    answer = respond(index, given, 1, gap=GAP, seed=seed, most=PLACES + MORE * len(given))
    return answer, made, failed


def _beyond(runs: CachedModel, seed: int) -> tuple[float, float]:
    """Return by how much the index may exceed the largest one that is known, and fall below the least.

    Indices are known to the scatter of few runs: the polynomial that predicts left-out ones best is taken. Of
    those that are FAR nothing else is known, and beyond them lies no measurable probability: they stay out of the fit.
    """
    near = runs.values[:, 0] < FAR
    some = not near.all() and near.sum() > SHARED * (len(runs.inputs) + 1)
    runs = runs.part(near) if some else runs
    study = Study(runs, np.zeros(1, dtype=np.int64), np.zeros(1), seed)
    surrogate = best(study)
    found = extremes(surrogate, len(runs.inputs), 1, seed)
    known = enclosure(study, surrogate, found, surrogate.left_out)
    return 0.0 if some else float(known.upper_outer[0] - known.upper[0]), float(known.lower[0] - known.lower_outer[0])


def _counting(progress: Callable[[int], None] | None, made: int) -> Callable[[int], None] | None:
    return None if progress is None else lambda runs: progress(made + runs)


def _with(shown: VerifiedRun | None, named: dict[str, float], values: dict[str, float]) -> VerifiedRun | None:
    """A run with the values of the intervals as well."""
    if shown is None:
        return None
    return replace(shown, parameters={**named, **shown.parameters}, values={**values, **shown.values})


def _no_reach(_: object, _size: float) -> tuple[Array, Array, Array, int, int]:
    raise AssertionError("all parameters are random here")


def crosschecked(assessed: LimitResult, machine: ResponseModel, values: Array, *, shared: bool) -> LimitResult:
    """Test a probability against the runs that estimated mean and standard deviation of the limit's quantity.

    values: (runs, columns); shared: whether runs share parameters with others, as those for indices do
    """
    columns = _columns(machine, assessed.limit)
    if assessed.exceedance is None or columns is None or not len(values):
        return assessed
    share = 2 / (len(assessed.inputs) + 2) if shared else 1.0
    margins = assessed.limit.margin(values[:, columns])
    found = [*assessed.exceedance.findings, *contradictions(assessed.exceedance.estimate, margins, share)]
    return replace(assessed, exceedance=replace(assessed.exceedance, findings=found))


def allowing(
    known: Statistics, machine: ResponseModel, limit: Limit, estimate: ExceedanceEstimate
) -> tuple[Statistics, list[Finding]]:
    """Return statistics whose errors allow for the probability of a limit, and what they have missed, if anything."""
    columns = _columns(machine, limit)
    if columns is None:
        return known, []
    mean, least = shifts(limit, known.mean[columns], known.error[columns], estimate)
    lacks = least > known.std[columns] + np.nan_to_num(known.std_error[columns])
    if not lacks.any():
        return known, []
    error, std_error = known.error.copy(), known.std_error.copy()
    error[columns] = np.where(lacks, np.fmax(error[columns], mean), error[columns])
    std_error[columns] = np.where(lacks, least - known.std[columns], std_error[columns])
    k = int(np.where(lacks, least, 0.0).argmax())
    missed = kinds.RARE_MISSED.found(
        f"the standard deviation of {limit.place}.{limit.quantity} at {machine.times[k]:g} s is "
        f"{known.std[columns][k]:.1e} by the runs, and what exceeds {limit.text} makes it {least[k]:.1e} at least, so "
        "that the errors of mean and standard deviation are enlarged",
        time=float(machine.times[k]),
        std=float(known.std[columns][k]),
        least=float(least[k]),
    )
    return replace(known, error=error, std_error=std_error), [missed]


def shifts(limit: Limit, mean: Array, error: Array, estimate: ExceedanceEstimate) -> tuple[Array, Array]:
    """Return the shift of the mean and the least standard deviation that a probability implies, (instants,) each.

    With probability p beyond a bound at distance d from the mean that is p d and, by Cantelli's inequality,
    d sqrt(p / (1 - p)); on both sides by Chebyshev's d sqrt(p). mean: estimated to within `error`
    """
    lower, _ = ends(estimate)
    # To be exceeded for the first time is no more probable than to be beyond.
    first = np.diff(estimate.exceeded, prepend=0.0)
    p = np.clip(first * lower / estimate.probability, 0.0, 0.5) if estimate.probability > 0 else np.zeros(len(first))
    distance = np.maximum(limit.margin(mean) - np.nan_to_num(error), 0.0)
    if limit.absolute and limit.above:
        return np.zeros(len(p)), distance * np.sqrt(p)
    return p * distance, distance * np.sqrt(p / (1 - p))


def _columns(machine: ResponseModel, limit: Limit) -> IntArray | None:
    """Return the columns of a study that hold the quantity of a limit, (instants,); None where none do."""
    if limit.quantity not in machine.quantities or limit.place not in machine.scene.markers:
        return None
    _, markers, quantities = machine.columns
    first = list(machine.scene.markers).index(limit.place) * quantities + machine.quantities.index(limit.quantity)
    return np.arange(len(machine.times)) * markers * quantities + first
