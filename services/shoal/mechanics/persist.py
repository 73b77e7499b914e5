"""Fallback integrators of `integrator: auto` where the first choice fails, from the cheapest on.

The first choice follows from the start alone: a rod that is stretched, turns fast or closes a loop may ask for more.
Lanes of one call keep their common first choice, so that differences between them are differences of the motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from shoal.mechanics import expense
from shoal.mechanics.simulate import STEP_MARGIN, simulate, stable_step
from shoal.scene import Scene
from shoal.trajectory import Status, Trajectory

PATIENCE = 20.0
"""No other choice is tried that would take longer than so many seconds."""
DAMPED = 0.9
"""Spectral radius that keeps generalized-alpha stable where vibrations that the step does not resolve turn fast."""
TOLERANCE = 1e-8


def persist(scene: Scene, first: Trajectory, threads: int | None = None, *, whole: bool = False) -> Trajectory:
    """The motion of one scene after its first run; under `auto` the first run that can be believed, if there is one."""
    if first.ok or scene.solver.integrator != "auto" or scene.solver.acceleration != "projection":
        return first
    for settings in _others(scene, first):
        other = scene.with_values({f"solver.{name}": value for name, value in settings.items()})
        run = simulate(other, first.times, threads=threads, whole=whole)
        if run.ok:
            reason = f"auto: {first.model['integrator']} ended with {first.status[0]}"
            wall_s = first.wall_s + run.wall_s
            return replace(run, wall_s=wall_s, model={**run.model, "integrator_reason": reason, "auto_took": settings})
    return first


def as_run(scene: Scene, trajectory: Trajectory) -> Scene:
    """The scene with the settings of the solver that its run took in place of its own."""
    return scene.with_values({f"solver.{name}": value for name, value in trajectory.model.get("auto_took", {}).items()})


def _others(scene: Scene, first: Trajectory) -> Iterator[dict[str, Any]]:
    """Settings of the solver to try, from the cheapest on."""
    name, model, duration = first.model["integrator"], first.model, float(first.times[-1])
    if model["elements"] == 0:
        if name != "radau5" and first.status[0] is not Status.FAILED:
            yield {"integrator": "radau5"}
        return
    if expense.seconds(model, "generalized-alpha", duration / scene.solver.step) < PATIENCE:
        yield {"integrator": "generalized-alpha", "spectral_radius": DAMPED}
    step = 0.5 * STEP_MARGIN * min(stable_step(scene, "leapfrog"), scene.solver.step)
    if expense.seconds(model, "leapfrog", duration / step) < PATIENCE:
        yield {"integrator": "leapfrog", "step": step}
    yield {
        "integrator": "radau5",
        "relative_tolerance": TOLERANCE,
        "absolute_tolerance": 0.1 * TOLERANCE,
        "max_steps": expense.affordable(model, "radau5", PATIENCE),
    }
