"""Bounds or statistics of the markers of a machine: a response whose columns are instants, markers and quantities."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shoal.errors import ComputationError
from shoal.mechanics import reach
from shoal.response.inputs import Inputs
from shoal.response.kept import TimeIsUpError
from shoal.response.machine import ResponseModel
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse, respond
from shoal.response.result import Bounds


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
