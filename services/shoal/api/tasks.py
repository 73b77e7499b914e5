"""Tasks of a worker: plain functions from a request to JSON."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from typing import Any

import numpy as np
import orjson

from shoal import notebook
from shoal.api.content import problem_of, scene_of, written
from shoal.api.limits import check_end, check_grid, check_lanes, check_scene, within
from shoal.api.operations import OfProblem, OfScene, Request, Simulate
from shoal.api.settings import Settings
from shoal.arguments import check_apart
from shoal.engines.contract import Engine
from shoal.engines.spot_checks import spot_check
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.identification.methods import get_method
from shoal.identification.recording.source import FileSource
from shoal.json_values import plain
from shoal.mechanics import findings as kinds
from shoal.mechanics.analysis.joint_reactions import to_json as reactions_to_json
from shoal.requests.request import read
from shoal.scene import Scene
from shoal.serialization import packed
from shoal.trajectory import Trajectory

Note = Callable[[Any], None]
"""Told how a computation goes."""


@dataclass(frozen=True)
class Bench:
    """Engine and settings of a worker, in a working folder of its own."""

    engine: Engine
    settings: Settings


Call = tuple[str, Request]
"""What is asked of a worker: one of `operations.OPERATIONS` by its name."""
Computation = Callable[[Note], bytes]


def call(bench: Bench, asked: Call, note: Note) -> bytes:
    """The answer to a call. Raises InputError, ComputationError."""
    return _prepared(bench, asked)(note)


def check(bench: Bench, asked: Call, note: Note) -> bytes:
    """Nothing, if the call can be tried. Raises InputError."""
    _prepared(bench, asked)
    return b""


def _prepared(bench: Bench, asked: Call) -> Computation:
    """Check the scene or problem of a call and return its computation. Raises InputError."""
    name, request = asked
    if getattr(request, "tolerance", None) is not None and bench.engine.name != "gauss":
        raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {bench.engine.name!r}")
    if isinstance(request, OfScene):
        scene, bounded = _of_scene(bench, request)
        if isinstance(request, Simulate):
            return partial(_simulated, bench, request, bounded, bounded is not scene)
        arguments: dict[str, Any] = {"scene": bounded}
    else:
        assert isinstance(request, OfProblem)
        arguments = _of_problem(bench, request)
    return partial(_computed, bench, name, {**request.arguments(), **arguments}, request)


def _of_scene(bench: Bench, request: OfScene) -> tuple[Scene, Scene]:
    """The scene of a request, and the same with no more steps than the service computes. Raises InputError."""
    scene, settings = scene_of(request.scene, request.set), bench.settings
    lanes = request.lanes if isinstance(request, Simulate) else None
    check_apart(request.set, lanes or request.varied)
    if lanes is None:
        check_grid(scene, settings, request.instants, request.varied)
        check_scene(scene, settings, request.instants, request.work)
        count = request.work * math.prod(len(axis) for axis in request.varied.values())
    else:
        if getattr(request, "tolerance", None) is not None:
            raise InputError("tolerance: a model is chosen for one scene; leave `lanes` out")
        check_lanes(scene, settings, request.instants, lanes)
        count = max(len(column) for column in lanes.values())
    return scene, within(scene, settings, count)


def _of_problem(bench: Bench, request: OfProblem) -> dict[str, Any]:
    problem = problem_of(request.problem, bench.settings, request.set)
    if (method := getattr(request, "method", None)) is not None or request.measured:
        get_method(method or problem.method)
    for name in request.data:
        if name not in problem.sources:
            raise InputError(f"data: no recording {name!r}; there are {', '.join(problem.sources)}")
    for name, source in problem.sources.items() if request.measured else ():
        if isinstance(source, FileSource) and source.path is None and name not in request.data:
            raise InputError(f"data: {name!r} is missing; this problem is fitted to measured motion")
    return {"problem": problem, "data": written(request.data) or None, "set": request.set}


def _computed(bench: Bench, name: str, arguments: dict[str, Any], request: Request, note: Note) -> bytes:
    """Call the library's function of that name; return the JSON of the command of that name, or the whole object."""
    function = getattr(notebook, name)
    if "engine" in signature(function).parameters:
        arguments = {**arguments, "engine": bench.engine.name}
    if follows := request.follows:
        arguments = {**arguments, "progress": lambda *row: note(dict(zip(follows, row, strict=True)))}
    found = function(**arguments)
    return to_json(packed(found) if request.objects else plain(reported(found)))


def reported(found: Any) -> Any:
    """A result as the command line prints it with --json."""
    if isinstance(found, list):
        return reactions_to_json(found)
    trajectory = getattr(found, "trajectory", None)
    return found.to_json() if trajectory is None else {**trajectory.to_json(), "selection": found.to_json()}


def _simulated(bench: Bench, request: Simulate, scene: Scene, bounded: bool, note: Note) -> bytes:
    """The motion of a scene, or of one per lane. bounded: whether it takes as many steps as the service computes."""
    asked, engine = read(request.of, {"scene": scene, **request.arguments()}), bench.engine
    times = request.instants
    if asked.tolerance is not None:
        found, _, selection = notebook.motion(asked, scene)
        assert selection is not None
        return _motion(request, found, selection.to_json())
    if request.lanes is None:
        found = verified(engine, scene, times) if asked.verify else engine.simulate(scene, times)
    else:
        values = {path: np.array(numbers) for path, numbers in request.lanes.items()}
        found = engine.simulate_many(scene, values, times)
        if asked.verify:
            checked = spot_check(engine, scene, values, found.status, found.times)
            model = {**found.model, "errors": checked.errors.to_json(), "verification": checked.to_json()}
            found = replace(found, model=model)
            if checked.complaint and found.ok:
                first = [kinds.POINT_REJECTED.found(checked.complaint)]
                found = replace(found, lane_findings=[first, *([] for _ in range(1, found.lanes))])
    if bounded:
        check_end(found, scene)
    return _motion(request, found)


def _motion(request: Simulate, trajectory: Trajectory, selection: dict[str, Any] | None = None) -> bytes:
    """A trajectory, every lane and every digit of it; selection: how its model was found."""
    if request.objects:
        return to_json(packed(trajectory))
    arrays = {
        name: None if (array := getattr(trajectory, name)) is None else np.ascontiguousarray(array)
        for name in ("times", "points", "angles", "velocities", "rates", "energy_drift", "constraint_drift")
    }
    same = ("engine", "markers", "status", "steps", "wall_s", "message", "advice", "model")
    stated = {name: getattr(trajectory, name) for name in same}
    stated["findings"] = [[one.to_json() for one in lane] for lane in trajectory.lane_findings]
    if request.lanes is not None:
        each = range(trajectory.lanes)
        stated["reasons"] = [trajectory.reason(lane) for lane in each]
        stated["changes"] = [plain(trajectory.changed(lane)) for lane in each]
    return to_json({**stated, **arrays, "selection": selection, "end": trajectory.end and dict(trajectory.end)})


def to_json(data: Any) -> bytes:
    """Doubles in the shortest form that gives them back exactly; null for what is not finite."""
    return orjson.dumps(data, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS)
