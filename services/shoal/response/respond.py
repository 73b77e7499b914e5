"""Any model whose parameters are known as intervals or distributions: runs by a method -> bounds or statistics."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import InputError
from shoal.response.attained import DRAWN, bounds_of, likely
from shoal.response.boxes import Boxes, boxes_of, sampled
from shoal.response.expansion import Expansion
from shoal.response.inner import resolved
from shoal.response.inputs import Inputs
from shoal.response.kept import TimeIsUpError
from shoal.response.methods import get_method
from shoal.response.result import Bounds
from shoal.response.runs import CachedModel, Model, TooManyRunsError
from shoal.response.statistics import DRAWN as PLACES
from shoal.response.statistics import QUANTILES, Statistics, either, masked, of_expansion, of_runs
from shoal.response.study import Found, LinkedMoments, Study
from shoal.trajectory import Array

MIXED = "auto", "nested"
"""Methods for intervals and distributions together."""
MOST = 20_000
"""Runs that a study may make unless another limit is asked for."""


@dataclass(frozen=True)
class ModelResponse:
    """What is found of any model: bounds or statistics of its columns, and how."""

    found: Found
    runs: CachedModel
    bounds: Bounds | None
    statistics: Statistics | None
    boxes: Boxes | None = None

    @property
    def drawn(self) -> Array:
        """Of random parameters: the answers of runs that are drawn from their distributions, (runs, columns)."""
        values = self.runs.values
        return values if self.found.drawn is None else values[len(values) - self.found.drawn :]

    @property
    def bounded(self) -> Bounds | Boxes | None:
        """What has a horizon and a gap."""
        return self.bounds or self.boxes

    @property
    def horizon(self) -> float:
        """Up to when bounds hold [s], infinite if always."""
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
    if bounds is not None and math.isfinite(bounds.horizon) and runs.left >= DRAWN:
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
    """What is known when the time is up. Raises TimeIsUpError if that is nothing."""
    if runs.evaluations == 0:
        raise TimeIsUpError
    return Found("broken off when the time was up")


def _statistics(study: Study, found: Found) -> Statistics:
    runs = study.runs
    told = sampled = of_runs(runs.values, found.indices, len(study.inputs))
    if isinstance(found.surrogate, Expansion):
        told = of_expansion(found.surrogate, study.inputs, found.error, len(runs.germs), study.seed)
        if found.linked is not None:
            told = _over(told, found.linked, study)
        if found.errors is not None:
            told = replace(told, error=found.errors[0], std_error=found.errors[1])
        if found.indices is None:
            sampled = replace(sampled, first=told.first, total=told.total)
        told = told if found.coarse is None else either(found.coarse, sampled, told)
    if found.quantiles is not None:
        told = replace(told, quantiles=found.quantiles)
    return masked(told, study.largest(np.nan_to_num(told.std), runs.values))


def _over(told: Statistics, linked: LinkedMoments, study: Study) -> Statistics:
    """With those of the columns that something else than the expansion tells."""
    quantiles, first, total = told.quantiles.copy(), told.first.copy(), told.total.copy()
    for columns, link in linked.links:
        answers = link(study.inputs.sobol(PLACES, study.seed + 1))
        quantiles[:, columns] = np.quantile(answers, QUANTILES, axis=0)
        if not study.inputs.correlations:
            first[:, columns], total[:, columns] = link.indices()
    return replace(told, mean=linked.mean, std=np.sqrt(linked.variance), quantiles=quantiles, first=first, total=total)
