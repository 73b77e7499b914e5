"""Joint reactions of a machine in motion, from its coordinates, rates and accelerations at requested times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.mechanics.analysis.at_rest import begun
from shoal.mechanics.analysis.evaluate import Evaluator, Pressing
from shoal.mechanics.analysis.felt import HELD
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_reactions import Reactions, reactions_of
from shoal.mechanics.ended import Ended
from shoal.mechanics.integrators import facts, pick
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.runs import Runs, check_step
from shoal.mechanics.stability import step_limit
from shoal.scene import Scene
from shoal.scene.signals import refuse_sampled
from shoal.trajectory import Trajectory

AT_ONCE = 1e-9
"""Events this near to a time, in parts of it, are at that time: where samples count as taken at the end of a step."""


class MotionState(NamedTuple):
    """Coordinates, rates and accelerations (unknowns,) at a time [s], and the turns of angle forces (forces,).

    pressing: what contacts exert; impacts: at this time, see `event_record`
    """

    time: float
    q: Array
    v: Array
    a: Array
    turns: Array
    pressing: Pressing
    impacts: list[dict[str, Any]]


def reactions(scene: Scene, times: Sequence[float] = (0.0,)) -> list[Reactions]:
    """Reactions in the motion of a scene at requested times [s]. Raises InputError, ComputationError."""
    evaluator, found = states(scene, times)
    bodies = FreeBodies(evaluator, max(times))
    result = []
    for state in found:
        evaluator.turns = state.turns
        _, q, v, a, _, pressing, impacts = state
        result.append(reactions_of(evaluator, q, v, a, state.time, bodies=bodies, pressing=pressing, impacts=impacts))
    return result


def states(scene: Scene, times: Sequence[float]) -> tuple[Evaluator, list[MotionState]]:
    """States at times >= 0 [s], each reached from the start by whole steps no longer than the scene's.

    Raises InputError if the scene cannot be modelled, ComputationError if the motion cannot be believed (`verdict`).
    """
    if not len(times) or not all(np.isfinite(t) and t >= 0 for t in times):
        raise InputError("times: give times of at least 0 s")
    refuse_sampled(scene, HELD)
    model, solver = begun(Machine.of(scene).model(max(times))), scene.solver
    choice = pick(solver, model, step_limit)
    if max(times) > 0:
        check_step(scene, choice, model)
    evaluator, found = Evaluator(model, one_sided=True), list[MotionState]()
    initial = evaluator.turns
    for time in map(float, times):
        if time > 0 and not facts(choice.name).adaptive:
            solver = solver.model_copy(update={"step": time / max(1, int(np.ceil(time / scene.solver.step - 1e-9)))})
        runs = Runs(scene.model_copy(update={"solver": solver}), model, choice)
        run = runs.run(np.array([time]), whole=True)
        if not run.ok or run.states is None:
            status, reason = run.status[0], run.reason(0)
            raise ComputationError(f"{scene.name}: the motion up to {time:g} s is rejected ({status}): {reason}")
        q, v = run.states.q[0, :, 0], run.states.v[0, :, 0]
        evaluator.turns = turns = run.end.turns if isinstance(run.end, Ended) else initial
        evaluator.put_contacts(run.states.contacts[0, ..., 0])
        a, pressing = evaluator.acceleration(q, v, time), evaluator.pressing
        impacts = [] if np.all(np.isfinite(pressing.force)) else _impacts(run, time)
        found.append(MotionState(time, q, v, a, turns, pressing, impacts))
    return evaluator, found


def _impacts(run: Trajectory, time: float) -> list[dict[str, Any]]:
    """Return the impacts at the end of a run, which are those after its last other event."""
    return [one for one in run.model["events"] if one.get("impulse") and abs(one["time"] - time) <= AT_ONCE * time]
