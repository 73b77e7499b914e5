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
from shoal.mechanics import stability
from shoal.mechanics.dynamics import work_space
from shoal.mechanics.integrators import choose, facts
from shoal.mechanics.march import march
from shoal.mechanics.model import Model, build, with_start
from shoal.mechanics.tile import Array, pack, tiles, unpack
from shoal.scene import GROUND, Rod, Scene
from shoal.trajectory import Status, Trajectory

REACH_MARGIN = 1.1
DRIFT_TOLERANCE = 1e-6


def simulate(
    scene: Scene, times: Array, values: Mapping[str, Array] | None = None, *, threads: int | None = None
) -> Trajectory:
    """Motion of a scene, or of one scene per lane, sampled at `times` [s].

    values: path in the scene -> one number per lane. Lanes are computed in tiles, tiles on threads.
    Raises InputError if the scene cannot be modelled or its step is beyond the stability limit.
    """
    begin = time.perf_counter()
    lanes = len(next(iter(values.values()))) if values else 1
    model, limit = _model_and_limit(scene, values or {}, lanes)
    if times[-1] > 0:
        _check_step(scene, limit)
    step = scene.solver.step
    steps = int(np.ceil(times[-1] / step - 1e-9))
    tile, parts = tiles(lanes)

    def run(part: slice) -> tuple[Array, ...]:
        arrays = model.tile(tile, part)
        room = work_space(tile, arrays)
        room.z[: model.unknowns * len(tile)] = pack(model.q0, part, tile)
        room.zdot[: model.unknowns * len(tile)] = pack(model.v0, part, tile)
        scheme = choose(scene.solver, model, tile, part)
        record = march(
            tile, scheme, arrays, room, step, steps, times, model.marker_rows.ravel(), scene.solver.rank_tolerance
        )
        return tuple(unpack(field, part, tile) for field in record)

    workers = min(threads or os.cpu_count() or 1, len(parts))
    results = [run(part) for part in parts] if workers == 1 else list(_pool(workers).map(run, parts))
    samples, error, scale, drift, correction = (np.concatenate(field, axis=1) for field in zip(*results, strict=True))
    samples = samples.reshape(len(times), len(scene.markers), 4, lanes)
    points = samples[:, :, :2]
    angles = _angles(scene, model, samples[:, :, 2:])
    energy_drift = _relative(error[0], scale[0], scene, model)
    status, message = _verdict(scene, model, points, energy_drift, drift[0])
    return Trajectory(
        engine="gauss",
        times=times,
        markers=tuple(scene.markers),
        points=points,
        angles=angles,
        status=status,
        energy_drift=energy_drift,
        constraint_drift=drift[0],
        steps=steps,
        wall_s=time.perf_counter() - begin,
        message=message,
        model=_facts(scene, model, limit, float(np.max(correction))),
    )


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="shoal-tiles")


@lru_cache(maxsize=64)
def _prepared(scene_json: str) -> tuple[Model, float]:
    """Model and stability limit of a scene; repeated runs, and lanes that only start differently, share them."""
    scene = Scene.model_validate_json(scene_json)
    model = build(scene)
    return model, _limit(scene, model)


def _model_and_limit(scene: Scene, values: Mapping[str, Array], lanes: int) -> tuple[Model, float]:
    """The model of all lanes, and the smallest stability limit [s] at the scene's own start."""
    if all(path.startswith("initial.") for path in values):
        model, limit = _prepared(scene.model_dump_json())
        return (with_start(model, scene.with_lanes(values), lanes) if values else model), limit
    model = build(scene.with_lanes(values), lanes)
    return model, _limit(scene, model)


def _limit(scene: Scene, model: Model) -> float:
    return stability.step_limit(model, facts(scene.solver.integrator))


def _check_step(scene: Scene, limit: float) -> None:
    """Raises InputError if the step is beyond the stability limit."""
    if scene.solver.step > limit:
        raise InputError(
            f"solver.step: {scene.solver.step:g} s is beyond the stability limit {limit:.3e} s of "
            f"{scene.solver.integrator} for this scene; use a smaller step or solver.integrator=generalized-alpha"
        )


def _angles(scene: Scene, model: Model, directions: Array) -> Array:
    """Angles [rad] of the marker directions (samples, markers, 2, lanes), continuous from the initial angles on."""
    raw = np.arctan2(directions[:, :, 1], directions[:, :, 0])
    first = np.empty((1, *raw.shape[1:]))
    for index, marker in enumerate(scene.markers.values()):
        first[0, index] = model.scene.start(marker.body).angle
    return np.unwrap(np.concatenate([first, raw]), axis=0)[1:]


def _relative(error: Array, scale: Array, scene: Scene, model: Model) -> Array:
    """Energy error over the largest kinetic + elastic energy.

    A machine that never moves has none: then its weight lifted by its reach and the energy of stretching its
    rods set the scale, as far as round-off goes.
    """
    stiff = max(np.max(c.coefficients[1::3], initial=0.0) for c in (model.cables_full, model.cables_reduced))
    floor = 1e-9 * float(np.max(np.abs(model.weight))) * _reach(scene) + 1e-12 * float(stiff)
    relative: Array = error / np.maximum(scale, floor + 1e-300)
    return relative


def _verdict(
    scene: Scene, model: Model, points: Array, energy_drift: Array, drift: Array
) -> tuple[tuple[Status, ...], str]:
    """Status of every lane, and the reason for the first that is not ok."""
    reach = _reach(scene) * REACH_MARGIN
    farthest = np.max(_distance_to_ground(scene, points), axis=(0, 1))
    statuses, message = [], ""
    for lane in range(model.lanes):
        if not (np.isfinite(farthest[lane]) and np.isfinite(energy_drift[lane])):
            status, reason = Status.DIVERGED, "the motion is not finite; use a smaller step"
        elif farthest[lane] > reach:
            status = Status.OUT_OF_REACH
            reason = f"a marker is {farthest[lane]:.3g} m away, the reach is {reach:.3g} m"
        elif energy_drift[lane] > scene.solver.energy_tolerance:
            status = Status.ENERGY
            reason = f"energy is off by {energy_drift[lane]:.2g}, allowed {scene.solver.energy_tolerance:g} (relative)"
        elif not drift[lane] <= DRIFT_TOLERANCE:
            status, reason = Status.DRIFTED, f"constraints are violated by {drift[lane]:.2g}"
        else:
            status, reason = Status.OK, ""
        statuses.append(status)
        message = message or reason
    return tuple(statuses), message


def _distance_to_ground(scene: Scene, points: Array) -> Array:
    """Distance of every marker to the nearest anchor on the ground [m], (samples, markers, lanes)."""
    sides = (side for joint in scene.joints.values() for side in (joint.first, joint.second))
    anchors = [scene.location(side) for side in sides if side.body == GROUND]
    distances = [np.hypot(points[:, :, 0] - x, points[:, :, 1] - y) for x, y in anchors]
    return np.asarray(np.min(distances, axis=0))


def _reach(scene: Scene) -> float:
    """No point can be farther from an anchor of its machine than all bodies stretched out in a line [m]."""
    sides = [side for joint in scene.joints.values() for side in (joint.first, joint.second)]
    places = [*sides, *scene.markers.values()]
    total = 0.0
    for name, body in scene.bodies.items():
        used = [scene.location(place) for place in places if place.body == name]
        if isinstance(body, Rod):
            used += [body.points["start"], body.points["end"]]
        total += max(np.hypot(a[0] - b[0], a[1] - b[1]) for a in used for b in used)
    return float(total)


def _facts(scene: Scene, model: Model, limit: float, correction: float) -> dict[str, Any]:
    """What was computed, for the record."""
    return {
        "unknowns": model.unknowns,
        "elements": model.elements,
        "constraints": len(model.constraint_names),
        "integrator": scene.solver.integrator,
        "step": scene.solver.step,
        "stability_limit": limit if np.isfinite(limit) else None,
        "initial_correction": correction,
        "bodies": {
            name: {"element": body.element, **({"elements": body.elements} if body.element != "rigid" else {})}
            for name, body in scene.bodies.items()
        },
    }
