"""The main path: scene -> model -> march over tiles of lanes -> checked trajectory."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache, lru_cache
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import forces, plane, stability, verdict
from shoal.mechanics import reach as reaches
from shoal.mechanics.assembly.build import build, with_start
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.dynamics import Work, derived_rows, work_space
from shoal.mechanics.gates import Seek, Sought, ready
from shoal.mechanics.integrators import Choice, choose, facts, halting, pick
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.march import march
from shoal.mechanics.marched import Marched, sampled
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile, pack, tiles, unpack
from shoal.mechanics.start import start
from shoal.mechanics.start.redundancy import redundant_joints
from shoal.scene import Scene, Solver
from shoal.trajectory import Trajectory, plain

STEP_MARGIN = 0.95
"""Of the stable step, which is that of the start and varies by a few percent along the motion."""


def simulate(
    scene: Scene,
    times: Array,
    values: Mapping[str, Array] | None = None,
    *,
    threads: int | None = None,
    seek: Callable[[Arrays, Work], Seek] | None = None,
) -> Trajectory:
    """Motion of a scene, or of one scene per lane, sampled at `times` [s].

    values: path in the scene -> one number per lane. Lanes are computed in tiles, tiles on threads. seek: who seeks the
    accelerations of a single lane in place of Gauss's principle as it is solved here.
    Raises InputError if the scene cannot be modelled or its step is beyond the stability limit.
    """
    begin = time.perf_counter()
    lanes = len(next(iter(values.values()))) if values else 1
    model, choice = _model_and_choice(scene, values or {}, lanes, float(times[-1]))
    if times[-1] > 0:
        check_step(scene, choice)
    tile, parts = tiles(lanes)

    def run(part: slice) -> tuple[Array, ...]:
        arrays, room = at_start(model, tile, part)
        sought = None if seek is None else Sought(seek(arrays, room), model.unknowns)
        arrays = arrays if sought is None else sought.joined(arrays, room)
        record = _marched(scene.solver, model, choice, times, tile, part, arrays, room)
        if sought is not None and sought.error is not None:
            raise sought.error
        return tuple(unpack(field, part, tile) for field in record)

    workers = min(threads or os.cpu_count() or 1, len(parts))
    results = [run(part) for part in parts] if workers == 1 else list(_pool(workers).map(run, parts))
    record = Marched(*(np.concatenate(field, axis=1) for field in zip(*results, strict=True)))
    d = model.dimensions
    samples = record.samples.reshape(len(times), len(scene.markers), sampled(d), lanes)
    points = samples[:, :, :d]
    energy_drift = verdict.energy_error(record, scene, model, float(times[-1]))
    constraint_drift = verdict.of_the_size(record.drift, scene)
    status, message = verdict.verdict(scene, model, record, choice, points, energy_drift, constraint_drift)
    return Trajectory(
        engine="gauss",
        times=times,
        markers=tuple(scene.markers),
        points=points,
        angles=_angles(scene, model, samples[:, :, d : 2 * d + 1]),
        velocities=samples[:, :, 2 * d + 1 : 3 * d + 1],
        rates=samples[:, :, 3 * d + 1],
        status=status,
        energy_drift=energy_drift,
        constraint_drift=constraint_drift,
        steps=int(np.max(record.steps)),
        wall_s=time.perf_counter() - begin,
        message=message,
        model=_facts(scene, model, choice, record, not values),
    )


def at_start(model: Model, tile: Tile, part: slice) -> tuple[Arrays, Work]:
    """The arrays and the work space of one tile of lanes that stands at its start, as a march takes them."""
    arrays = model.tile(tile, part)
    room = work_space(tile, arrays)
    arrays = ready(tile, arrays, room)
    room.z[: model.unknowns * len(tile)] = pack(model.q0, part, tile)
    room.zdot[: model.unknowns * len(tile)] = pack(model.v0, part, tile)
    if model.forces.size:
        derived_rows(tile, arrays, room)
        room.memory[:] = forces.initial_memory(tile, arrays.forces, room.z, pack(model.start_angles, part, tile))
    return arrays, room


def _marched(
    solver: Solver, model: Model, choice: Choice, times: Array, tile: Tile, part: slice, arrays: Arrays, room: Work
) -> Marched:
    step, end = solver.step, float(times[-1])
    steps = solver.max_steps if facts(choice.name).adaptive else int(np.ceil(end / step - 1e-9))
    stops = halting(solver, model, choice.name, end)
    scheme = choose(solver, model, tile, part, choice.name)
    record: Marched = march(
        tile, scheme, arrays, room, step, steps, times, model.marker_rows.ravel(), solver.rank_tolerance, stops
    )
    return record


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="shoal-tiles")


def stable_step(scene: Scene, integrator: str) -> float:
    """Largest stable step [s] of an integrator at the start of a scene; infinite if nothing limits it.

    Raises InputError if the scene cannot be modelled.
    """
    return _limit(*_key(scene, scene.solver.duration), facts(integrator))


_PACE = (
    "step",
    "integrator",
    "samples",
    "relative_tolerance",
    "absolute_tolerance",
    "max_step",
    "max_steps",
    "spectral_radius",
    "newton_tolerance",
    "energy_tolerance",
)
"""Settings of the solver that leave the model as it is."""


def _key(scene: Scene, end: float) -> tuple[str, float]:
    """What a model is built from: the scene, and up to where its functions of time are wanted [s]."""
    usual = {name: Solver.model_fields[name].default for name in _PACE}
    neutral = scene.model_copy(update={"solver": scene.solver.model_copy(update=usual)})
    return neutral.model_dump_json(), max(end, scene.solver.duration)


@lru_cache(maxsize=64)
def _model(scene_json: str, horizon: float) -> Model:
    """Repeated runs, runs by other integrators, and lanes that only start differently share the model."""
    return build(Scene.model_validate_json(scene_json), horizon=horizon)


@lru_cache(maxsize=512)
def _limit(scene_json: str, horizon: float, integrator: Facts) -> float:
    return stability.step_limit(_model(scene_json, horizon), integrator)


def _model_and_choice(scene: Scene, values: Mapping[str, Array], lanes: int, end: float) -> tuple[Model, Choice]:
    """The model of all lanes, and the integrator, whose stability limit is the smallest at the scene's own start.

    Where nothing moves (end [s] is 0) no step is limited.
    """
    if all(path.startswith("initial.") for path in values) and not (values and start.gives_numbers(scene)):
        key = _key(scene, end)
        model = _model(*key)
        choice = pick(scene.solver, model, lambda _, integrator: _limit(*key, integrator) if end > 0 else np.inf)
        return (with_start(model, scene.with_lanes(values), lanes) if values else model), choice
    model = build(scene.with_lanes(values), lanes, max(end, scene.solver.duration))
    return model, pick(scene.solver, model, stability.step_limit if end > 0 else lambda *_: np.inf)


def check_step(scene: Scene, choice: Choice) -> None:
    """Raises InputError if the step is beyond the stability limit."""
    if scene.solver.step > choice.limit:
        raise InputError(
            f"solver.step: {scene.solver.step:g} s is beyond the stability limit {choice.limit:.3e} s of "
            f"{choice.name} for this scene; use a smaller step or solver.integrator=generalized-alpha"
        )


def _angles(scene: Scene, model: Model, directions: Array) -> Array:
    """Angles [rad] of the markers, continuous from the initial ones on; (samples, markers, d + 1, lanes)."""
    angle = np.asarray(plane.angle((directions[:, :, 0], directions[:, :, 1])))
    near = directions[:, :, -1]
    angle += 2 * np.pi * np.rint((near - angle) / (2 * np.pi))
    for index, marker in enumerate(scene.markers.values()):
        begin = np.asarray(start_angle(model.scene, marker))
        angle[:, index] += 2 * np.pi * np.rint((begin - plane.angle(plane.unit(begin))) / (2 * np.pi))
    return angle


def _start(scene: Scene, model: Model, record: Marched) -> dict[str, Any]:
    """The start as it was used, what of it was stated otherwise, and joints whose forces are not unique."""
    q, v = np.split(record.begin[:, 0], 2)
    used = start.begun(model.frames, model.scene, q, v)
    redundant = {"redundant_joints": list(_redundant(scene.model_dump_json()))}
    return dict(plain(start.facts(scene, used, float(reaches.size(scene))) | redundant))


@lru_cache(maxsize=64)
def _redundant(scene_json: str) -> tuple[str, ...]:
    scene = Scene.model_validate_json(scene_json)
    return () if start.is_direct(scene) else redundant_joints(start.complete(scene).scene)


def _facts(scene: Scene, model: Model, choice: Choice, record: Marched, single: bool) -> dict[str, Any]:
    """What was computed, for the record; single: one scene without lanes."""
    return {
        "unknowns": model.unknowns,
        "elements": model.flexible,
        "constraints": len(model.constraint_names),
        "integrator": choice.name,
        "integrator_reason": choice.reason,
        "step": scene.solver.step,
        "stability_limit": choice.limit if np.isfinite(choice.limit) else None,
        "evaluations": int(np.max(record.evaluations)),
        **(_start(scene, model, record) if single else {}),
        "bodies": {
            name: {"element": body.element, **({"elements": body.elements} if body.element != "rigid" else {})}
            for name, body in scene.bodies.items()
        },
    }
