"""Results of the limits of a study, and the tolerances that keep one of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from shoal.findings import Finding
from shoal.response.allocation import TARGET, Allocation, Reached, accepted, costs_of, of_intervals
from shoal.response.allocation_of_random import of_random
from shoal.response.between import between
from shoal.response.inputs import Inputs
from shoal.response.kept import TimeIsUpError
from shoal.response.limits.crosschecked import allowing, crosschecked
from shoal.response.limits.judge import Reach, judge, watched
from shoal.response.limits.limit import Limit
from shoal.response.limits.result import LimitResult
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse, respond
from shoal.response.runs import Model
from shoal.response.statistics import Statistics
from shoal.trajectory import Array

UNRESOLVED = 1e-8
"""Runs that differ by less than this share of a limit's quantity differ by the errors of their steps."""


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
        return between(limit, model, inputs, **_how(problem))
    result = judge(limit, model, inputs, _reach(problem, inputs, problem.asked.gap), **_how(problem))
    return crosschecked(result, model, found.drawn, shared=found.found.indices is not None)


def _how(problem: UncertainProblem) -> dict[str, Any]:
    asked = problem.asked
    how = {"seed": asked.seed, "verify": asked.verify, "progress": asked.progress}
    return {"way": asked.limit_method, "most": asked.limit_runs, **how}


def _reach(problem: UncertainProblem, inputs: Inputs, gap: float | None) -> Reach:
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
        return bounds.lower, outer, runs.germs[runs.values.argmin(axis=0)], runs.evaluations, runs.failed

    return reach


def allocate(problem: UncertainProblem, results: Sequence[LimitResult]) -> Allocation | None:
    """Return the cheapest tolerances that keep the limit, where they are asked for and there is time.

    Raises InputError, ComputationError.
    """
    if problem.asked.allocate and results:
        with suppress(TimeIsUpError):
            return _allocated(problem, results[0])
    return None


def _allocated(problem: UncertainProblem, stated: LimitResult) -> Allocation:
    """Stated: the result with the stated tolerances."""
    limit, model, inputs, asked = stated.limit, problem.model, problem.inputs, problem.asked
    prices, widest = costs_of(asked.cost or {}, inputs), accepted(model.scene, inputs)
    if inputs.random.any():
        target = TARGET if asked.target is None else asked.target
        return of_random(limit, model, inputs, stated, target, prices, widest, **_how(problem))
    # Tolerances that keep the limit keep it by the known error of the model.
    margins = watched(model, limit.tightened(stated.errors.total or 0.0))

    def least(here: Inputs) -> Reached:
        lower, outer, germs, evaluations, _ = _reach(problem, here, None)(margins, abs(limit.bound))
        worst = int(lower.argmin())
        return Reached(float(outer.min()), float(lower[worst]), germs[worst], evaluations)

    return of_intervals(limit.required, margins, inputs, least, prices, widest)


def allow_for_limits(
    problem: UncertainProblem, statistics: Statistics | None, results: Sequence[LimitResult]
) -> tuple[Statistics | None, list[Finding]]:
    """Return statistics whose errors allow for the probabilities of limits, and what they have missed."""
    missed = list[Finding]()
    for one in results:
        if statistics is not None and one.passing is not None and not one.doubted:
            statistics, more = allowing(statistics, problem.model, one.limit, one.passing.estimate)
            missed += more
    return statistics, missed
