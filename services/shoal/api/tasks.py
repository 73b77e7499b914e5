"""What a worker computes: plain functions from a request to JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson

from shoal.api.content import problem_of, scene_of, written
from shoal.api.limits import check_end, check_lanes, check_scene, within
from shoal.api.schemas import IdentifyRequest, SimulateRequest
from shoal.api.settings import Settings
from shoal.engines.contract import Engine
from shoal.errors import InputError
from shoal.identification import identify
from shoal.identification.conclude import Wishes
from shoal.identification.methods import get_method
from shoal.identification.recording.source import FileSource
from shoal.trajectory import Trajectory

Note = Callable[[Any], None]
"""Told how a computation goes."""


@dataclass(frozen=True)
class Bench:
    """What a worker computes with, in a working folder of its own."""

    engine: Engine
    settings: Settings


def simulate(bench: Bench, request: SimulateRequest, note: Note) -> bytes:
    """The motion of a scene, or of one per lane. Raises InputError."""
    scene, settings, times = scene_of(request.scene, request.values), bench.settings, request.times
    if request.lanes is None:
        check_scene(scene, settings, times)
        bounded = within(scene, settings)
        found = bench.engine.simulate(bounded, times)
    else:
        check_lanes(scene, settings, times, request.lanes)
        values = {path: np.array(numbers) for path, numbers in request.lanes.items()}
        bounded = within(scene, settings, max(len(column) for column in values.values()))
        found = bench.engine.simulate_many(bounded, values, times)
    if bounded is not scene:
        check_end(found, bounded)
    return motion(found)


def check(bench: Bench, request: IdentifyRequest, note: Note) -> bytes:
    """Nothing, if the request can be tried. Raises InputError."""
    problem = problem_of(request.problem, bench.settings, request.values)
    get_method(request.method or problem.method)
    if request.tolerance is not None and bench.engine.name != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {bench.engine.name!r}")
    for name in request.recordings:
        if name not in problem.sources:
            raise InputError(f"recordings: no recording {name!r}; there are {', '.join(problem.sources)}")
    written({name: given for name, given in request.recordings.items() if isinstance(given, str)})
    for name, source in problem.sources.items():
        if isinstance(source, FileSource) and source.path is None and name not in request.recordings:
            raise InputError(f"recordings: {name!r} is missing; this problem is fitted to measured motion")
    return b""


def identification(bench: Bench, request: IdentifyRequest, note: Note) -> bytes:
    """The estimate of a problem. Raises InputError, ComputationError."""
    estimate = identify(
        problem_of(request.problem, bench.settings, request.values),
        method=request.method,
        data=written(request.recordings) or None,
        engine=bench.engine.name,
        values=request.values,
        seed=request.seed,
        tolerance=request.tolerance,
        time_limit=request.time_limit,
        wishes=Wishes(profiles=request.profiles, bootstrap=request.bootstrap),
        progress=lambda *row: note(row),
    )
    return to_json(estimate.to_json())


def motion(trajectory: Trajectory) -> bytes:
    """A trajectory as schemas.Motion, every lane and every digit of it."""
    arrays = {
        name: None if (array := getattr(trajectory, name)) is None else np.ascontiguousarray(array)
        for name in ("times", "points", "angles", "velocities", "rates", "energy_drift", "constraint_drift")
    }
    plain = ("engine", "markers", "status", "steps", "wall_s", "message", "model")
    return to_json({name: getattr(trajectory, name) for name in plain} | arrays)


def to_json(data: Any) -> bytes:
    """Doubles in the shortest form that gives them back exactly; null for what is not finite."""
    return orjson.dumps(data, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS)
