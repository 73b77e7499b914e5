"""The question of a study: a scene, its uncertain parameters, instants, limits, and the model that answers."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shoal.compile import clock
from shoal.engines import get_engine
from shoal.engines.contract import sampling_times
from shoal.engines.starts import StatedStart, Tally
from shoal.errors import ComputationError, InputError
from shoal.evaluation_cache import EvaluationCache
from shoal.requests.uncertain import Uncertain
from shoal.response.allocation import costs_of
from shoal.response.inputs import Inputs
from shoal.response.limits.choice import get_way
from shoal.response.limits.judge import require
from shoal.response.limits.limit import Limit, read_limits
from shoal.response.limits.quantities import of_section
from shoal.response.machine import ResponseModel
from shoal.response.read import parameters
from shoal.response.runs import Keep
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal.versions import versions


@dataclass(frozen=True)
class UncertainProblem:
    """A request that has been read and checked.

    scene: with the chosen model in its nominal place; limits: requirements among them; model: the scene as a function
    of its uncertain fields, which remembers its runs and counts those that start elsewhere
    """

    asked: Uncertain
    scene: Scene
    inputs: Inputs
    limits: list[Limit]
    model: ResponseModel
    keep: Keep
    starts: Tally

    @property
    def times(self) -> Array:
        """Instants [s]."""
        return self.model.times

    @property
    def careful(self) -> bool:
        """Return whether runs are to be repeated more carefully, and there is time."""
        return self.asked.verify and not self.keep.over


def read(asked: Uncertain, scene: Scene) -> UncertainProblem:
    """Read a request, choose the model of the scene, and check that it gives the quantities of the limits.

    Raises InputError, ComputationError.
    """
    end = None if asked.time_limit is None else clock.now() + asked.time_limit
    inputs = Inputs(parameters(asked.vary, scene), asked.correlate or None)
    starts = Tally(StatedStart.of(scene, [path for one in inputs.parameters for path in one.factors]))
    get_way(asked.limit_method)
    # The start is stated, not a response: of the scene's own instants those after it count.
    times = sampling_times(scene, asked.at) if asked.at is not None else sampling_times(scene, None)[1:]
    limits = read_limits(asked.limit, asked.require, scene)
    costs_of(asked.cost or {}, inputs)
    if asked.tolerance is not None:
        scene = _select_model(asked, scene, inputs, asked.tolerance, times, limits)
    keep = _keep(asked, scene, times, end)
    model = ResponseModel(scene, times, get_engine(asked.engine), keep=keep, starts=starts)
    for one in limits:
        require(model, one, inputs)
    return UncertainProblem(asked, scene, inputs, limits, model, keep, starts)


def _select_model(
    asked: Uncertain, scene: Scene, inputs: Inputs, tolerance: float, times: Array, limits: Sequence[Limit]
) -> Scene:
    """Return the scene with the cheapest model within a tolerance [m] at the median of the parameters."""
    from shoal.selection import select

    if asked.engine != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {asked.engine!r}")
    middle = inputs.values(inputs.quantiles(np.full((1, len(inputs)), 0.5)))
    sections = (scene.markers[one.place].body for one in limits if of_section(one.quantity, scene))
    nominal = scene.with_values({path: float(at[0]) for path, at in middle.items()})
    selection = select(nominal, tolerance, times, meshed=tuple(sections))
    if not selection.met:
        raise ComputationError(f"tolerance: no model within {tolerance:g} m: {selection.reason}")
    return selection.chosen.scene.with_values({path: scene.value(path) for path in middle})


def _keep(asked: Uncertain, scene: Scene, times: Array, end: float | None) -> Keep:
    """Return the store of runs and the end of the time. Raises InputError."""
    if asked.checkpoint is None:
        return Keep(None, end)
    study = repr((scene.fingerprint, times.tolist(), asked.engine, versions(("shoal",))))
    return Keep(EvaluationCache(Path(asked.checkpoint), hashlib.sha1(study.encode()).hexdigest(), "study"), end)
