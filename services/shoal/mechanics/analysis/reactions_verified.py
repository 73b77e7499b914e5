"""Verification of reactions by more careful runs: vibrations and steps change them more than positions.

Forces follow from accelerations. Steps that are long enough for the motion may be too long for these, above all where
nothing damps the axial vibration of stiff rods. So the forces are compared with those of runs with other settings; if
the run as stated is off, but two more careful ones agree, theirs are returned.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shoal.error_budget import ErrorBudget
from shoal.errors import ComputationError
from shoal.findings import Finding
from shoal.mechanics.analysis import reaction_findings as kinds
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.analysis.mesh_error import estimates
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.integrators import STRIDES, facts, pick
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import Array
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

    They are inaccurate where no two runs with other steps agree within SHARE. Errors of the mesh and
    of the theory of slender rods are added to those of the steps. At an impact there are none.
    """
    stated = reactions(scene, times)
    between = [one.time for one in stated if not one.impacts]
    if len(between) < len(stated):
        smooth = iter(verified(scene, between) if between else ())
        return [one if one.impacts else next(smooth) for one in stated]
    found, other, remarks = _in_time(stated, scene, times)

    def run(source: str, finer: Scene) -> list[Reactions]:
        # Elements of half the length need half the step.
        shorter = {"solver.step": 0.5 * scene.solver.step} if source == "mesh" else {}
        return reactions(finer.with_values(shorter), times)

    steps = [None] * len(times) if other is None else list(map(_differences, found, other))
    others = estimates(stated, scene, run, _differences, exact=False)
    errors = [{"time": one, **more} for one, more in zip(steps, others, strict=True)]
    largest = {source: _largest([one[source] for one in errors]) for source in errors[0]}
    return [
        replace(_with_errors(one, each), remarks=remarks, errors=ErrorBudget(largest, "N"))
        for one, each in zip(found, errors, strict=True)
    ]


def _in_time(
    stated: list[Reactions], scene: Scene, times: Sequence[float]
) -> tuple[list[Reactions], list[Reactions] | None, list[Finding]]:
    """Return the reactions that are believed most, those of the run that they are compared with, and what is wrong.

    All on the mesh as stated; no other run where there is none.
    """
    if not any(times):
        return stated, stated, []
    runs, lever, off, why = [stated], span(scene), np.inf, ""
    for settings in _others(scene):
        try:
            another = reactions(scene.with_values(settings), times)
        except ComputationError as error:
            why = why or str(error)
            continue
        if _apart(stated, another, lever) <= SHARE:
            return stated, another, []
        off = min(off, _apart(stated, another, lever))
        if any(_apart(one, another, lever) <= SHARE for one in runs[1:]):
            nearest = min(runs[1:], key=lambda one: _apart(one, another, lever))
            name, tolerance = settings["solver.integrator"], settings["solver.relative_tolerance"]
            text = (
                f"the run as stated is off by about {off:.0%} of the largest force; the forces are those with "
                f"solver.integrator={name}, solver.relative_tolerance={tolerance:g}"
            )
            return another, nearest, [kinds.OTHER_RUN.found(text, off=off, relative_tolerance=tolerance)]
        runs.append(another)
    if len(runs) == 1:
        return stated, None, [kinds.NOT_ESTIMATED.found(f"errors of forces not estimated: {why}")]
    return stated, runs[-1], [kinds.INACCURATE.found(f"forces are off by about {off:.0%} of the largest", off=off)]


def _others(scene: Scene) -> Iterator[dict[str, Any]]:
    """Settings of other runs, the cheapest first."""
    solver, model = scene.solver, Machine.of(scene).model()
    name = pick(solver, model, step_limit).name
    names: tuple[str, ...] = (name,)
    tolerances = (100 * solver.relative_tolerance, max(0.1 * solver.relative_tolerance, 1e-14))
    if not facts(name).adaptive:
        names = ("dop853",) if model.gaps.size else ("dop853", "radau5")
        tolerances = 1e-7, 1e-9
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


def _differences(one: Reactions, other: Reactions) -> Array:
    """Return the distances of the force [N] and of the torque [N m] of every joint and contact, (joints, 2)."""
    return _sizes(
        [(np.subtract(a, b), np.subtract(c, d)) for (a, c), (b, d) in zip(_all(one), _all(other), strict=True)]
    )


def _all(one: Reactions) -> list[tuple[Any, Any]]:
    """Return force and torque of every joint, then those of every contact."""
    joints = [(joint.force, joint.torque) for joint in one.joints.values()]
    return joints + [(contact.force, 0.0) for contact in one.contacts.values()]


def _sizes(vectors: Iterable[tuple[Any, Any]]) -> Array:
    """Return the sizes of forces and torques, (joints, 2)."""
    return np.array([list(map(np.linalg.norm, pair)) for pair in vectors]).reshape(-1, 2)


def _apart(found: list[Reactions], other: list[Reactions], lever: float) -> float:
    """The largest error over the largest force at these times, torques counted at a lever [m]; nan if one is none."""
    units = np.array([1.0, lever])
    error = np.max([_differences(one, two) / units for one, two in zip(found, other, strict=True)], initial=0.0)
    sizes = [_sizes(_all(one)) / units for one in other]
    return 0.0 if error <= CANCELLED * max(one.scale for one in other) else float(error / np.max(sizes))


def _with_errors(found: Reactions, errors: Mapping[str, Array | None]) -> Reactions:
    """Return reactions with the sum of the known errors of each joint and contact."""
    known = [each for each in errors.values() if each is not None]
    if not known:
        return found
    total, count = np.sum(known, axis=0).tolist(), len(found.joints)
    pairs = zip(found.joints.items(), total[:count], strict=True)
    joints = {name: replace(joint, force_error=force, torque_error=torque) for (name, joint), (force, torque) in pairs}
    others = zip(found.contacts.items(), total[count:], strict=True)
    contacts = {name: replace(contact, force_error=force) for (name, contact), (force, _) in others}
    return replace(found, joints=joints, contacts=contacts)


def _largest(errors: list[Array | None]) -> float | None:
    """Return the largest error of a force at all times [N]; None where it is not known."""
    known = [each[:, 0] for each in errors if each is not None]
    return float(np.max(known, initial=0.0)) if known else None
