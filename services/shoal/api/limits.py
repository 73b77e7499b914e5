"""Limits on the size of requests, checked before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product

from shoal.api.settings import Settings
from shoal.engines.capabilities import is_moved_by_swarm
from shoal.errors import InputError
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.scene import Scene
from shoal.trajectory import Trajectory

STAGES = 12
"""What an adaptive step costs in terms of a fixed one: dop853 looks at the forces so often, radau5 does as much."""


class TooMuch(InputError):  # noqa: N818 - a refusal, not a failure
    """The request is right, and larger than this service computes."""


def check_scene(scene: Scene, settings: Settings, times: Sequence[float] | None = None, lanes: int = 1) -> None:
    """Check that a scene may be simulated in this number of lanes. times [s]: of the samples. Raises TooMuch."""
    solver = scene.solver
    elements = _elements(scene)
    if elements > settings.max_elements:
        raise TooMuch(f"scene.bodies: {elements} elements; this service computes {settings.max_elements}")
    samples = solver.samples + 1 if times is None else len(times)
    values = samples * len(scene.markers) * lanes
    if values > settings.max_values:
        size = f"{samples} samples of {len(scene.markers)} markers in {lanes} lanes"
        raise TooMuch(f"times: {size}; this service returns {settings.max_values} values")
    end = solver.duration if times is None else max(times, default=0.0)
    search = solver.swarm_size * solver.swarm_iterations if is_moved_by_swarm(scene) else 1
    field, step = ("max_step", (solver.max_step or math.inf) / STAGES) if _adaptive(scene) else ("step", solver.step)
    work = math.ceil(min(end / step, 1e18)) * elements * lanes * search
    if work > settings.max_work:
        raise TooMuch(
            f"solver.{field}: {end / step:.3g} steps of {elements} elements in {lanes} lanes"
            f"{f', each searched {search} times' if search > 1 else ''}; "
            f"this service computes {settings.max_work:.3g} in all"
        )


def within(scene: Scene, settings: Settings, lanes: int = 1) -> Scene:
    """The scene, whose integrator, if it chooses its own steps, takes no more of them than the service computes."""
    allowed = max(1, settings.max_work // (STAGES * _elements(scene) * lanes))
    return scene.with_values({"solver.max_steps": allowed}) if allowed < scene.solver.max_steps else scene


def check_end(motion: Trajectory, scene: Scene) -> None:
    """Return whether a motion came to its end in the steps that `within` left it. Raises TooMuch."""
    reached = motion.steps < scene.solver.max_steps or not _adaptive(scene, motion.model.get("integrator"))
    if not (motion.ok or reached):
        raise TooMuch(
            f"solver.relative_tolerance: {motion.message.partition(';')[0]}; with {_elements(scene)} elements in "
            f"{motion.lanes} lanes this service computes no more"
        )


def _elements(scene: Scene) -> int:
    return sum(getattr(body, "elements", 1) for body in scene.bodies.values())


def _adaptive(scene: Scene, integrator: str | None = None) -> bool:
    """Return whether an integrator, else that of the scene, is adaptive; for `auto` this takes the model."""
    name = integrator or scene.solver.integrator
    return name in INTEGRATORS and facts(name).adaptive


def check_lanes(
    scene: Scene, settings: Settings, times: Sequence[float] | None, lanes: Mapping[str, Sequence[float]]
) -> None:
    """Return whether a scene may be simulated with these numbers, one per lane. Raises InputError."""
    if not lanes or not all(lanes.values()):
        raise InputError("lanes: needs at least one path, and one number or more for each")
    count = max(len(column) for column in lanes.values())
    check_scene(scene, settings, times, count)
    costly = {path: column for path, column in lanes.items() if _costly(path)}
    for lane in range(count) if costly else ():
        numbers = {path: column[min(lane, len(column) - 1)] for path, column in costly.items()}
        check_scene(scene.with_values(numbers), settings, times, count)


def check_grid(
    scene: Scene, settings: Settings, times: Sequence[float] | None, axes: Mapping[str, Sequence[float]]
) -> None:
    """Return whether a scene may be simulated over the full grid of these values. Raises InputError."""
    count = math.prod(len(axis) for axis in axes.values())
    check_scene(scene, settings, times, count)
    for path, axis in axes.items():
        for extreme in (min(axis), max(axis)):
            scene.with_values({path: extreme})
    costly = {path: axis for path, axis in axes.items() if _costly(path)}
    for numbers in product(*costly.values()) if costly else ():
        check_scene(scene.with_values(dict(zip(costly, numbers, strict=True))), settings, times, count)


def _costly(path: str) -> bool:
    """Return whether the work depends on it, which then may differ from lane to lane."""
    return path.startswith("solver.") or path.endswith((".elements", ".modes", ".axial_modes"))
