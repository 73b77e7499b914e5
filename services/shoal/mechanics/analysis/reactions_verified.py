"""Verification of reactions by more careful runs: vibrations and steps change them more than positions.

Forces follow from accelerations. Steps that are long enough for the motion may be too long for these, above all where
nothing damps the axial vibration of stiff rods. So the forces are compared with those of runs with other settings; if
the run as stated is off, but two more careful ones agree, theirs are returned.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shoal.error_budget import ErrorBudget
from shoal.errors import ComputationError
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.analysis.mesh_error import beyond, second_runs
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.integrators import STRIDES, facts, pick
from shoal.mechanics.machine import Machine
from shoal.mechanics.reach import span
from shoal.mechanics.stability import step_limit
from shoal.scene import Scene

SHARE = 0.05
"""Of the largest force in the joints at these times: errors beyond it are not believed."""
CANCELLED = 1e-6
"""Of all forces on the bodies, which may cancel in the joints: errors below it are none."""
_TIGHT = 1e-8
"""Runs of adaptive integrators with tolerances below this are held against looser ones first, which cost less."""
_MOST = 200_000
"""Steps of a second run of an adaptive integrator."""


def verified(scene: Scene, times: Sequence[float]) -> list[Reactions]:
    """Reactions at times [s] with their errors. Raises InputError, ComputationError.

    `settled` is false, and `message` says what to do, where no two runs with other steps agree within SHARE. Errors of
    the mesh and of the theory of slender rods are added to those of the steps.
    """
    stated = reactions(scene, times)
    found = _in_time(stated, scene, times)
    sources = {"time": _largest(found)}

    def run(source: str, other: Scene) -> list[Reactions]:
        # Elements of half the length need half the step.
        shorter = {"solver.step": 0.5 * scene.solver.step} if source == "mesh" else {}
        return _with_differences(stated, reactions(other.with_values(shorter), times))

    for source, away in second_runs(scene, run, exact=False).items():
        if away is None:
            sources[source] = None
            continue
        factor = 1.0 + beyond(1.0) if source == "mesh" else 1.0
        found = [_with(one, two, factor) for one, two in zip(found, away, strict=True)]
        sources[source] = factor * (_largest(away) or 0.0)
    return [replace(one, errors=ErrorBudget(sources, "N")) for one in found]


def _largest(found: list[Reactions]) -> float | None:
    """The largest error of a force [N]; None where none is known."""
    errors = [joint.force_error for one in found for joint in one.joints.values()]
    return max((error for error in errors if error is not None), default=0.0 if not errors else None)


def _with(found: Reactions, other: Reactions, factor: float) -> Reactions:
    """Return reactions with the errors of another run, times a factor, added."""
    joints = {}
    for name, joint in found.joints.items():
        more = other.joints[name]
        force = (joint.force_error or 0.0) + factor * (more.force_error or 0.0)
        torque = (joint.torque_error or 0.0) + factor * (more.torque_error or 0.0)
        joints[name] = replace(joint, force_error=force, torque_error=torque)
    return replace(found, joints=joints)


def _in_time(stated: list[Reactions], scene: Scene, times: Sequence[float]) -> list[Reactions]:
    """With their errors in time, on the mesh as stated."""
    runs = [stated]
    if not any(times):
        return _with_differences(runs[0], runs[0])
    lever, off, why = span(scene), np.inf, ""
    for settings in _others(scene):
        try:
            another = reactions(scene.with_values(settings), times)
        except ComputationError as error:
            why = why or str(error)
            continue
        if _apart(runs[0], another, lever) <= SHARE:
            return _with_differences(runs[0], another)
        off = min(off, _apart(runs[0], another, lever))
        if any(_apart(one, another, lever) <= SHARE for one in runs[1:]):
            nearest = min(runs[1:], key=lambda one: _apart(one, another, lever))
            message = f"the run as stated is off by about {off:.0%} of the largest force; told are those with "
            name, tolerance = settings["solver.integrator"], settings["solver.relative_tolerance"]
            message += f"solver.integrator={name}, solver.relative_tolerance={tolerance:g}"
            return _with_differences(another, nearest, message)
        runs.append(another)
    if len(runs) == 1:
        return [replace(one, settled=False, message=f"errors of forces not estimated: {why}") for one in runs[0]]
    advice = (
        f"forces are off by about {off:.0%} of the largest: use a smaller solver.step, or solver.integrator=dop853 "
        "with a smaller solver.relative_tolerance, or earlier times if the motion is chaotic"
    )
    return [replace(one, settled=False) for one in _with_differences(runs[0], runs[-1], advice)]


def _others(scene: Scene) -> Iterator[dict[str, Any]]:
    """Settings of other runs, the cheapest first."""
    solver, model = scene.solver, Machine.of(scene).model()
    name = pick(solver, model, step_limit).name
    names: tuple[str, ...] = (name,)
    tolerances = (100 * solver.relative_tolerance, max(0.1 * solver.relative_tolerance, 1e-14))
    if not facts(name).adaptive:
        names, tolerances = ("dop853", "radau5"), (1e-7, 1e-9)
    elif solver.relative_tolerance > _TIGHT:
        tolerances = 0.01 * solver.relative_tolerance, 1e-4 * solver.relative_tolerance
    steps = min(solver.max_steps, _MOST) if not facts(name).adaptive else solver.max_steps
    longest = solver.max_step or (solver.duration / STRIDES if model.functions.size else None)
    if longest and facts(name).adaptive:
        # Two runs that both take the longest step would agree, however wrong both are.
        longest *= 0.5
    for integrator in names:
        for tolerance in tolerances:
            yield {
                "solver.integrator": integrator,
                "solver.relative_tolerance": tolerance,
                "solver.absolute_tolerance": tolerance,
                "solver.max_step": longest,
                "solver.max_steps": steps,
            }


def _with_differences(found: list[Reactions], other: list[Reactions], message: str = "") -> list[Reactions]:
    """Return reactions whose errors are their differences from those of another run."""
    told = []
    for one, two in zip(found, other, strict=True):
        joints = {}
        for name, joint in one.joints.items():
            force, torque = (
                float(np.linalg.norm(np.subtract(getattr(joint, part), getattr(two.joints[name], part))))
                for part in ("force", "torque")
            )
            joints[name] = replace(joint, force_error=force, torque_error=torque)
        told.append(replace(one, joints=joints, message=message))
    return told


def _apart(found: list[Reactions], other: list[Reactions], lever: float) -> float:
    """The largest error over the largest force at these times, torques counted at a lever [m]; nan if one is none."""
    errors = [
        max(joint.force_error or 0.0, (joint.torque_error or 0.0) / lever)
        for one in _with_differences(found, other)
        for joint in one.joints.values()
    ]
    sizes = [
        max(float(np.linalg.norm(joint.force)), float(np.linalg.norm(joint.torque)) / lever)
        for one in other
        for joint in one.joints.values()
    ]
    error, floor = max(errors, default=0.0), CANCELLED * max(one.scale for one in other)
    return 0.0 if error <= floor else error / max(sizes)
