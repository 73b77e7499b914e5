"""Response of any model whose parameters are intervals or distributions, and of the markers of a machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.mechanics import reach
from shoal.response.enclosure import WILKS, Bounds, bounds_of, likely
from shoal.response.expansion import Expansion
from shoal.response.inputs import Inputs
from shoal.response.machine import ResponseModel
from shoal.response.methods import get_method
from shoal.response.methods.nested import resolved
from shoal.response.probability_boxes import ProbabilityBoxes, boxes_of, sampled
from shoal.response.problem import UncertainProblem
from shoal.response.runs import CachedModel, Model, TimeIsUpError, TooManyRunsError
from shoal.response.statistics import DRAWN as PLACES
from shoal.response.statistics import QUANTILES, Statistics, either, masked, of_expansion, of_runs
from shoal.response.study import Found, Study, TransformedMoments
from shoal.trajectory import Array

MIXED = "auto", "nested"
"""Methods for intervals and distributions together."""
MOST = 20_000
"""Runs that a study may make unless another limit is asked for."""


@dataclass(frozen=True)
class ModelResponse:
    """Response of any model: bounds or statistics of its columns, and the runs and method behind them."""

    found: Found
    runs: CachedModel
    bounds: Bounds | None
    statistics: Statistics | None
    boxes: ProbabilityBoxes | None = None

    @property
    def drawn(self) -> Array:
        """Answers of the runs that are drawn from the distributions of random parameters, (runs, columns)."""
        values = self.runs.values
        return values if self.found.drawn is None else values[len(values) - self.found.drawn :]

    @property
    def bounded(self) -> Bounds | ProbabilityBoxes | None:
        """Bounds or boxes, which have a horizon and a gap."""
        return self.bounds or self.boxes

    @property
    def horizon(self) -> float:
        """Last instant up to which bounds hold [s], infinite if always."""
        return math.inf if self.bounded is None else self.bounded.horizon


def respond(
    model: Model,
    inputs: Inputs,
    columns: int,
    *,
    method: str = "auto",
    groups: Array | None = None,
    instants: Array | None = None,
    gap: float | None = None,
    degree: int | None = None,
    count: int | None = None,
    seed: int = 0,
    most: int = MOST,
    progress: Callable[[int], None] | None = None,
    over_time: Callable[[Array], Model] | None = None,
) -> ModelResponse:
    """Bounds or statistics of any function of named values; see `Study`.

    model: path -> values, (runs,), to answers, (runs, columns). Raises InputError, ComputationError.
    """
    if inputs.mixed and method not in MIXED:
        raise InputError(
            f"vary: method {method} takes intervals or distributions, not both; methods for both are {', '.join(MIXED)}"
        )
    runs = CachedModel(model, inputs, most, progress)
    group = np.arange(columns) if groups is None else np.asarray(groups, dtype=np.int64)
    when = np.zeros(columns) if instants is None else instants
    study = Study(runs, group, when, seed, gap, degree, count, over_time)
    try:
        found = get_method(method)(study)
    except TimeIsUpError:
        found = _broken_off(runs)
    except TooManyRunsError:
        raise InputError(f"runs: method {method} needs more than the {most} runs that it may make") from None
    random = inputs.random
    try:
        bounds = None if random.any() else bounds_of(study, found)
    except TimeIsUpError:
        bounds = bounds_of(study, _broken_off(runs))
    if bounds is not None and math.isfinite(bounds.horizon) and runs.left >= WILKS:
        with suppress(TimeIsUpError):
            bounds = likely(study, bounds)
    statistics = _statistics(study, found) if random.all() else None
    boxes = None
    if inputs.mixed:
        boxes, how = resolved(study, boxes_of(study, found))
        found = replace(found, why=f"{found.why}; where it does not resolve deviations, {how}") if how else found
    if boxes is not None and math.isfinite(boxes.horizon):
        with suppress(TimeIsUpError):
            boxes = sampled(study, boxes)
    return ModelResponse(found, runs, bounds, statistics, boxes)


def _broken_off(runs: CachedModel) -> Found:
    """Return the result when the time is up. Raises TimeIsUpError without any run."""
    if runs.evaluations == 0:
        raise TimeIsUpError
    return Found("broken off when the time was up")


def _statistics(study: Study, found: Found) -> Statistics:
    runs = study.runs
    known = sampled = of_runs(runs.values, found.indices, len(study.inputs))
    if isinstance(found.surrogate, Expansion):
        known = of_expansion(found.surrogate, study.inputs, found.error, len(runs.xi), study.seed)
        if found.transformed is not None:
            known = _over(known, found.transformed, study)
        if found.errors is not None:
            known = replace(known, error=found.errors[0], std_error=found.errors[1])
        if found.indices is None:
            sampled = replace(sampled, first=known.first, total=known.total)
        known = known if found.coarse is None else either(found.coarse, sampled, known)
    if found.quantiles is not None:
        known = replace(known, quantiles=found.quantiles)
    return masked(known, study.largest(np.nan_to_num(known.std), runs.values))


def _over(known: Statistics, changed: TransformedMoments, study: Study) -> Statistics:
    """Return statistics with those of the columns that a transformation predicts."""
    quantiles, first, total = known.quantiles.copy(), known.first.copy(), known.total.copy()
    for columns, link in changed.links:
        answers = link(study.inputs.sobol(PLACES, study.seed + 1))
        quantiles[:, columns] = np.quantile(answers, QUANTILES, axis=0)
        if not study.inputs.correlations:
            first[:, columns], total[:, columns] = link.indices()
    return replace(
        known, mean=changed.mean, std=np.sqrt(changed.variance), quantiles=quantiles, first=first, total=total
    )


def respond_markers(problem: UncertainProblem) -> ModelResponse:
    """Make the runs of a method; beyond a horizon outer bounds are the kinematic reach.

    Raises InputError, and ComputationError if there is no time for the first runs.
    """
    asked, model = problem.asked, problem.model
    instants, markers, quantities = model.columns
    each = markers * quantities
    try:
        found = respond(
            model,
            problem.inputs,
            instants * each,
            method=asked.method,
            groups=np.tile(np.arange(each), instants),
            instants=np.repeat(model.times, each),
            gap=asked.gap,
            degree=asked.degree,
            count=asked.count,
            seed=asked.seed,
            most=asked.runs,
            progress=asked.progress,
            over_time=lambda times: replace(model, times=times, keep=None),
        )
    except TimeIsUpError:
        raise ComputationError("time-limit: it was over before the first runs were made") from None
    if found.bounds is None or math.isinf(found.horizon):
        return found
    return replace(found, bounds=_within_reach(found.bounds, model, problem.inputs))


def _within_reach(bounds: Bounds, model: ResponseModel, inputs: Inputs) -> Bounds:
    """Return bounds whose outer ones beyond the horizon are the kinematic reach; angles have none."""
    scene = model.scene
    ends = inputs.values(np.array([-np.ones(len(inputs)), np.ones(len(inputs))]))
    length = max(float(np.max(reach.size(scene.with_lanes(ends)))), 0.0) if reach.tethered(scene) else math.inf
    anchors = reach.anchors(scene)
    far = np.full((*model.columns, 2), math.nan)
    for axis in range(scene.dimensions):
        far[:, :, axis, 0] = anchors[:, axis].min() - reach.MARGIN * length
        far[:, :, axis, 1] = anchors[:, axis].max() + reach.MARGIN * length
    late = np.repeat(model.times > bounds.horizon, int(np.prod(model.columns[1:])))
    lower, upper = bounds.lower_outer.copy(), bounds.upper_outer.copy()
    lower[late], upper[late] = far.reshape(-1, 2)[late].T
    return replace(bounds, lower_outer=lower, upper_outer=upper)
