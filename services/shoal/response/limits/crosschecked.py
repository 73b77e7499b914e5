"""Consistency of the probability of a limit with the mean and standard deviation of its quantity.

The runs that are drawn from the distributions tell a probability without bias, if roughly; and a deviation cannot be
smaller than what lies beyond a limit makes it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.inputs import IntArray
from shoal.response.limits.counted import contradictions, ends
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.limit import Limit
from shoal.response.limits.result import LimitResult
from shoal.response.machine import ResponseModel
from shoal.response.statistics import Statistics
from shoal.trajectory import Array


def crosschecked(judged: LimitResult, machine: ResponseModel, values: Array, *, shared: bool) -> LimitResult:
    """Test a probability against the runs that estimated mean and standard deviation of the limit's quantity.

    values: (runs, columns); shared: whether runs share parameters with others, as those that tell indices do
    """
    columns = _columns(machine, judged.limit)
    if judged.passing is None or columns is None or not len(values):
        return judged
    share = 2 / (len(judged.inputs) + 2) if shared else 1.0
    margins = judged.limit.margin(values[:, columns])
    found = [*judged.passing.findings, *contradictions(judged.passing.estimate, margins, share)]
    return replace(judged, passing=replace(judged.passing, findings=found))


def allowing(
    told: Statistics, machine: ResponseModel, limit: Limit, estimate: ExceedanceEstimate
) -> tuple[Statistics, list[Finding]]:
    """Return statistics whose errors allow for the probability of a limit, and what they have missed, if anything."""
    columns = _columns(machine, limit)
    if columns is None:
        return told, []
    mean, least = shifts(limit, told.mean[columns], told.error[columns], estimate)
    lacks = least > told.std[columns] + np.nan_to_num(told.std_error[columns])
    if not lacks.any():
        return told, []
    error, std_error = told.error.copy(), told.std_error.copy()
    error[columns] = np.where(lacks, np.fmax(error[columns], mean), error[columns])
    std_error[columns] = np.where(lacks, least - told.std[columns], std_error[columns])
    k = int(np.where(lacks, least, 0.0).argmax())
    missed = kinds.RARE_MISSED.found(
        f"the standard deviation of {limit.place}.{limit.quantity} at {machine.times[k]:g} s is "
        f"{told.std[columns][k]:.1e} by the runs, and what exceeds {limit.text} makes it {least[k]:.1e} at least, so "
        "that the errors of mean and standard deviation are enlarged",
        time=float(machine.times[k]),
        std=float(told.std[columns][k]),
        least=float(least[k]),
    )
    return replace(told, error=error, std_error=std_error), [missed]


def shifts(limit: Limit, mean: Array, error: Array, estimate: ExceedanceEstimate) -> tuple[Array, Array]:
    """Return the shift of the mean and the least standard deviation that a probability implies, (instants,) each.

    With probability p beyond a bound at distance d from the mean that is p d and, by Cantelli's inequality,
    d sqrt(p / (1 - p)); on both sides by Chebyshev's d sqrt(p). mean: told, to within `error`
    """
    lower, _ = ends(estimate)
    # To be passed for the first time is no more probable than to be beyond.
    first = np.diff(estimate.passed, prepend=0.0)
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
