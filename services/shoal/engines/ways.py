"""Ways to run a scene: integrators and steps from the cheapest on, as a fallback or a more careful run, and their cost.

The first choice of `integrator: auto` follows from the start alone: a rod that is stretched, turns fast or closes a
loop may ask for more. Lanes of one call keep their common first choice, so that differences between them are
differences of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shoal.mechanics.integrators import facts
from shoal.mechanics.simulate import STEP_MARGIN, stable_step
from shoal.scene import Scene, Solver
from shoal.scene.refined import refined
from shoal.trajectory import Status, Trajectory

MOST = 20.0
"""No fallback is tried that would take longer than so many seconds."""
DAMPED = 0.9
"""Spectral radius that keeps generalized-alpha stable where vibrations that the step does not resolve turn fast."""
TOLERANCE = 1e-8
"""Of fallbacks that choose their steps."""
CLOSE = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-9}
"""Tolerances of second runs by integrators that choose their steps."""
SPAN = 100.0
"""Factor between the tolerances of two adaptive runs; the error falls at least tenfold with it."""
LOOSE = 1e-8
"""A tolerance above this is held against a tighter one, a tolerance below against a looser one, which costs less."""
TIGHTEST = 1e-14
"""The smallest tolerance of a second run."""
SHORTER, MORE = 0.5, 4
"""Part of the mean step that those of a tighter run may reach, and how many times as many it may take at most."""
FARTHER = 3.0
"""Factor on the distance from singular positions at which they count, for a tighter run; a looser one takes as many
times as its error is expected to be larger."""
HALVINGS = 3
"""So often the step of a second run that is unstable is halved, before an implicit method is asked."""


def seconds(model: Mapping[str, Any], integrator: str, steps: float) -> float:
    """Return the cost [s] of a number of steps by order of magnitude; model: a trajectory's `model`.

    A measured time would make the answer depend on the load of the machine.
    """
    rate = facts(integrator).seconds_per_unknown[bool(model.get("constraints"))]
    return rate * float(model["unknowns"]) * steps


def affordable(model: Mapping[str, Any], integrator: str, budget: float) -> int:
    """Return the number of steps that a budget [s] allows, at least one."""
    return max(1, int(budget / seconds(model, integrator, facts(integrator).stages)))


def is_adaptive(run: Trajectory) -> bool:
    """Return whether the native solver made a run by an integrator that chooses its steps."""
    return run.engine == "gauss" and facts(run.model["integrator"]).adaptive


def first_believed(scene: Scene, first: Trajectory, simulate: Callable[[Scene], Trajectory]) -> Trajectory:
    """Return the first run of a scene or, under `auto`, the first one by a fallback that can be believed, if any."""
    if first.ok or scene.solver.integrator != "auto" or scene.solver.acceleration != "projection":
        return first
    for settings in _fallbacks(scene, first):
        run = simulate(scene.with_values({f"solver.{name}": value for name, value in settings.items()}))
        if run.ok:
            reason = f"auto: {first.model['integrator']} ended with {first.status[0]}"
            wall_s = first.wall_s + run.wall_s
            return replace(run, wall_s=wall_s, model={**run.model, "integrator_reason": reason, "auto_took": settings})
    return first


def as_run(scene: Scene, trajectory: Trajectory) -> Scene:
    """The scene with the settings of the solver that its run took in place of its own."""
    return scene.with_values({f"solver.{name}": value for name, value in trajectory.model.get("auto_took", {}).items()})


def _fallbacks(scene: Scene, first: Trajectory) -> Iterator[dict[str, Any]]:
    """Settings of the solver to try where the first choice of `auto` failed."""
    name, model, duration = first.model["integrator"], first.model, float(first.times[-1])
    if model["elements"] == 0:
        if name != "radau5" and first.status[0] is not Status.FAILED and "events" not in model:
            yield {"integrator": "radau5"}
        return
    if seconds(model, "generalized-alpha", duration / scene.solver.step) < MOST:
        yield {"integrator": "generalized-alpha", "spectral_radius": DAMPED}
    step = 0.5 * STEP_MARGIN * min(stable_step(scene, "leapfrog"), scene.solver.step)
    if seconds(model, "leapfrog", duration / step) < MOST:
        yield {"integrator": "leapfrog", "step": step}
    yield {
        "integrator": "radau5",
        "relative_tolerance": TOLERANCE,
        "absolute_tolerance": 0.1 * TOLERANCE,
        "max_steps": affordable(model, "radau5", MOST),
    }


def careful(scene: Scene, trajectory: Trajectory, factor: float | None = None) -> Iterator[Scene]:
    """Yield more careful runs on the same mesh, with the usual treatment of constraints.

    factor: on the tolerance of an adaptive integrator. Its steps may end at a longest one or where forces have kinks,
    and not by the tolerance. So those of a tighter run are shorter in any case: two runs with the same steps would
    agree though both are off.
    """
    named = ("acceleration", "project", "rank_tolerance", "inertia_cap")
    usual = {name: Solver.model_fields[name].default for name in named}
    settings = {f"solver.{name}": value for name, value in usual.items()}
    if is_adaptive(trajectory):
        solver = scene.solver
        factor = factor or (1 / SPAN if solver.relative_tolerance > LOOSE else SPAN)
        settings["solver.relative_tolerance"] = max(solver.relative_tolerance * factor, TIGHTEST)
        settings["solver.absolute_tolerance"] = solver.absolute_tolerance * factor
        if trajectory.model.get("distance_from_singular", 1.0) <= solver.rank_tolerance:
            # What third derivatives leave there is proportional to it, and no matter of steps.
            settings["solver.rank_tolerance"] = usual["rank_tolerance"] * (np.sqrt(SPAN) if factor > 1 else FARTHER)
        if factor < 1 and trajectory.steps:
            settings["solver.max_step"] = SHORTER * float(trajectory.times[-1]) / trajectory.steps
            settings["solver.max_steps"] = max(solver.max_steps, MORE * trajectory.steps)
        yield scene.with_values(settings)
    elif not any(scene.flexible_rods):
        # Tolerances that the run itself had no use for may be any.
        close = {path: min(scene.value(path), most) for path, most in CLOSE.items()}
        yield scene.with_values({**settings, **close, "solver.integrator": "auto"})
    else:
        scene = scene.with_values(settings)
        if trajectory.engine == "gauss" and (trajectory.steps - 1) * scene.solver.step > trajectory.times[-1]:
            # Steps that were cut at what is narrow are cut alike at half the step, and their error stays.
            yield scene.with_values({"solver.integrator": "dop853", **CLOSE})
        yield from able(scene, 0.5 * scene.solver.step)


def on_finer_mesh(scene: Scene, times: int) -> Iterator[Scene]:
    """Yield the scene with a multiple of the elements or modes, by the ways of `able`. times: the multiple."""
    yield from able(scene.with_values({**refined(scene, times), "solver.inertia_cap": False}), scene.solver.step)


def able(scene: Scene, step: float) -> Iterator[Scene]:
    """Ways to run a scene with steps of at most `step` [s], from the cheapest and best on.

    The stable step of leapfrog is that of the start; loops and stretched rods have shorter ones, which are not
    known beforehand. Damping may leave it none that is of use.
    """
    if not any(rod.element != "modal" for rod in scene.flexible_rods.values()):
        yield scene.with_values({"solver.integrator": "auto"})
        return
    longest = min(step, STEP_MARGIN * stable_step(scene, "leapfrog"))
    for halvings in range(HALVINGS):
        yield scene.with_values({"solver.integrator": "leapfrog", "solver.step": 0.5**halvings * longest})
    implicit = {"solver.integrator": "generalized-alpha", "solver.spectral_radius": DAMPED, "solver.step": step}
    yield scene.with_values(implicit)
    yield scene.with_values({"solver.integrator": "radau5", **CLOSE})
