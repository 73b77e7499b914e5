"""The main path: scene -> model -> march over tiles of lanes -> checked trajectory."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache, lru_cache
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import forces, stability, swarm_motion
from shoal.mechanics import reach as reaches
from shoal.mechanics.assembly.build import build, with_start
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.dynamics import derived_rows, work_space
from shoal.mechanics.integrators import Choice, choose, facts, halting, pick
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.march import SAMPLED, Record, march
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, pack, tiles, unpack
from shoal.mechanics.start import start
from shoal.mechanics.start.redundancy import redundant_joints
from shoal.mechanics.tangent import ready
from shoal.scene import Scene, Solver
from shoal.trajectory import Status, Trajectory, plain

DRIFT_TOLERANCE = 1e-6
SINKING = 3000.0
"""A weight that nothing holds yet falls for as long as the error of its rate is below the absolute tolerance; by then
it is 14 times as fast as that. Twice as much is no error by the default tolerance of energies, a hundredth."""
STEP_MARGIN = 0.95
"""Of the stable step, which is that of the start and varies by a few percent along the motion."""


def simulate(
    scene: Scene,
    times: Array,
    values: Mapping[str, Array] | None = None,
    *,
    threads: int | None = None,
    search: swarm_motion.Search | None = None,
) -> Trajectory:
    """Motion of a scene, or of one scene per lane, sampled at `times` [s].

    values: path in the scene -> one number per lane. Lanes are computed in tiles, tiles on threads. search: how a
    swarm seeks the accelerations, where `solver.acceleration` names one (default: as the paper does).
    Raises InputError if the scene cannot be modelled or its step is beyond the stability limit.
    """
    begin = time.perf_counter()
    lanes = len(next(iter(values.values()))) if values else 1
    asked, evidence = scene.solver, dict[str, Any]()
    if swarm_motion.asked_for(scene):
        scene, search = swarm_motion.suited(scene, lanes), search or swarm_motion.Search()
    else:
        search = None
    model, choice = _model_and_choice(scene, values or {}, lanes, float(times[-1]))
    if times[-1] > 0:
        _check_step(scene, choice)
    step = scene.solver.step
    steps = scene.solver.max_steps if facts(choice.name).adaptive else int(np.ceil(times[-1] / step - 1e-9))
    stops = halting(scene.solver, model, choice.name, float(times[-1]))
    tile, parts = tiles(lanes)

    def run(part: slice) -> tuple[Array, ...]:
        arrays = model.tile(tile, part)
        room = work_space(tile, arrays)
        arrays = ready(tile, arrays, room)
        room.z[: model.unknowns * len(tile)] = pack(model.q0, part, tile)
        room.zdot[: model.unknowns * len(tile)] = pack(model.v0, part, tile)
        if model.forces.size:
            derived_rows(tile, arrays, room)
            room.memory[:] = forces.initial_memory(tile, arrays.forces, room.z, pack(model.start_angles, part, tile))
        if search is not None:
            record, found = swarm_motion.march(
                search, asked, arrays, room, steps, times, model.marker_rows, stops.times
            )
            evidence.update(found)
            return tuple(unpack(field, part, tile) for field in record)
        scheme = choose(scene.solver, model, tile, part, choice.name)
        rows, tolerance = model.marker_rows.ravel(), scene.solver.rank_tolerance
        record = march(tile, scheme, arrays, room, step, steps, times, rows, tolerance, stops)
        return tuple(unpack(field, part, tile) for field in record)

    workers = min(threads or os.cpu_count() or 1, len(parts))
    results = [run(part) for part in parts] if workers == 1 else list(_pool(workers).map(run, parts))
    record = Record(*(np.concatenate(field, axis=1) for field in zip(*results, strict=True)))
    samples = record.samples.reshape(len(times), len(scene.markers), SAMPLED, lanes)
    points = samples[:, :, :2]
    angles = _angles(scene, model, samples[:, :, 2:5])
    energy_drift = _relative(record.energy_error[0], record.energy_scale[0], scene, model, float(times[-1]))
    constraint_drift = _of_the_size(record.drift, scene)
    status, message = _verdict(scene, model, record, choice, points, energy_drift, constraint_drift)
    return Trajectory(
        engine="gauss",
        times=times,
        markers=tuple(scene.markers),
        points=points,
        angles=angles,
        velocities=samples[:, :, 5:7],
        rates=samples[:, :, 7],
        status=status,
        energy_drift=energy_drift,
        constraint_drift=constraint_drift,
        steps=int(np.max(record.steps)),
        wall_s=time.perf_counter() - begin,
        message=message,
        model=_facts(scene, model, choice, record, not values) | evidence,
    )


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


def _check_step(scene: Scene, choice: Choice) -> None:
    """Raises InputError if the step is beyond the stability limit."""
    if scene.solver.step > choice.limit:
        raise InputError(
            f"solver.step: {scene.solver.step:g} s is beyond the stability limit {choice.limit:.3e} s of "
            f"{choice.name} for this scene; use a smaller step or solver.integrator=generalized-alpha"
        )


def _angles(scene: Scene, model: Model, directions: Array) -> Array:
    """Angles [rad] of the markers, continuous from the initial ones on; directions: (samples, markers, 3, lanes)."""
    angle = np.arctan2(directions[:, :, 1], directions[:, :, 0])
    near = directions[:, :, 2]
    angle += 2 * np.pi * np.rint((near - angle) / (2 * np.pi))
    for index, marker in enumerate(scene.markers.values()):
        begin = start_angle(model.scene, marker)
        angle[:, index] += 2 * np.pi * np.rint((begin - np.angle(np.exp(1j * np.asarray(begin)))) / (2 * np.pi))
    return angle


def _relative(error: Array, scale: Array, scene: Scene, model: Model, end: float) -> Array:
    """Energy error over the largest kinetic + elastic energy.

    A machine that never moves has none: then its weight lifted by its span and the energy of stretching its
    rods set the scale, as far as round-off goes. Nor is it an error if the weight sinks at a rate that the tolerance of
    rates allows: between two bars in one line, which hold it to the second order only, it does until they feel it.
    """
    stiff = max(np.max(family.coefficients, initial=0.0) for family in model.elements)
    weight = float(np.max(np.abs(model.weight), initial=0.0))
    sunk = SINKING * scene.solver.absolute_tolerance * end
    floor = weight * (1e-9 * reaches.span(scene) + sunk) + 1e-12 * float(stiff)
    relative: Array = error / np.maximum(scale, floor + 1e-300)
    return relative


def _of_the_size(drift: Array, scene: Scene) -> Array:
    """The largest of the violations of constraints (POWERS, lanes), relative to the machine's size; (lanes,)."""
    relative: Array = np.max(drift / reaches.span(scene) ** np.arange(len(drift))[:, None], axis=0)
    return relative


def _verdict(
    scene: Scene,
    model: Model,
    record: Record,
    choice: Choice,
    points: Array,
    energy_drift: Array,
    constraint_drift: Array,
) -> tuple[tuple[Status, ...], str]:
    """Status of every lane, and the reason for the first that is not ok."""
    # Lanes may be machines of different lengths.
    reach = reaches.MARGIN * reaches.reach(model.scene, record.energy_scale[0])
    farthest = np.max(reaches.distance_to_ground(model.scene, points), axis=(0, 1))
    adaptive = facts(choice.name).adaptive
    steps, reached = record.steps[0], record.reached[0]
    statuses, message = [], ""
    failed = np.broadcast_to(model.failed, model.lanes)
    for lane in range(model.lanes):
        finite = np.isfinite(farthest[lane]) and np.isfinite(energy_drift[lane])
        if failed[lane]:
            status, reason = Status.FAILED, "no start agrees with the joints and with what is stated"
        elif not finite and np.isfinite(energy_drift[lane]) and adaptive and steps[lane] >= scene.solver.max_steps:
            status = Status.FAILED
            reason = (
                f"{steps[lane]:.0f} steps of {choice.name} led to {reached[lane]:.4g} s only; "
                "raise solver.max_steps or solver.relative_tolerance"
            )
        elif not finite:
            status = Status.DIVERGED
            advice = "no step is short enough for it" if adaptive else "use a smaller step"
            reason = f"the motion is not finite; {advice}"
        elif farthest[lane] > reach[lane]:
            status = Status.OUT_OF_REACH
            reason = f"a marker is {farthest[lane]:.3g} m away, the reach is {reach[lane]:.3g} m"
        elif energy_drift[lane] > scene.solver.energy_tolerance:
            status = Status.ENERGY
            reason = f"energy is off by {energy_drift[lane]:.2g}, allowed {scene.solver.energy_tolerance:g} (relative)"
        elif not constraint_drift[lane] <= DRIFT_TOLERANCE:
            status = Status.DRIFTED
            reason = f"constraints are violated by {constraint_drift[lane]:.2g} of the machine's size"
        else:
            status, reason = Status.OK, ""
        statuses.append(status)
        message = message or reason
    return tuple(statuses), message


def _start(scene: Scene, model: Model, record: Record) -> dict[str, Any]:
    """The start as it was used, what of it was stated otherwise, and joints whose forces are not unique."""
    q, v = np.split(record.begin[:, 0], 2)
    used = start.begun(model.frames, model.scene, q, v)
    redundant = {"redundant_joints": list(_redundant(scene.model_dump_json()))}
    return dict(plain(start.facts(scene, used, float(reaches.size(scene))) | redundant))


@lru_cache(maxsize=64)
def _redundant(scene_json: str) -> tuple[str, ...]:
    scene = Scene.model_validate_json(scene_json)
    return () if start.is_direct(scene) else redundant_joints(start.complete(scene).scene)


def _facts(scene: Scene, model: Model, choice: Choice, record: Record, single: bool) -> dict[str, Any]:
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
