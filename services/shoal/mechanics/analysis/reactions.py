"""Joint reactions of a machine in motion, from its coordinates, rates and accelerations at requested times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.mechanics.analysis.at_rest import begun
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_reactions import Reactions, reactions_of
from shoal.mechanics.ended import Ended
from shoal.mechanics.integrators import facts, pick
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.runs import Runs, check_step
from shoal.mechanics.stability import step_limit
from shoal.scene import Scene


class MotionState(NamedTuple):
    """Coordinates, rates and accelerations (unknowns,) at a time [s], and the turns of angle forces (forces,)."""

    time: float
    q: Array
    v: Array
    a: Array
    turns: Array


def reactions(scene: Scene, times: Sequence[float] = (0.0,)) -> list[Reactions]:
    """Reactions in the motion of a scene at requested times [s]. Raises InputError, ComputationError."""
    evaluator, found = states(scene, times)
    bodies = FreeBodies(evaluator, max(times))
    result = []
    for state in found:
        evaluator.turns = state.turns
        result.append(reactions_of(evaluator, state.q, state.v, state.a, state.time, bodies=bodies))
    return result


def states(scene: Scene, times: Sequence[float]) -> tuple[Evaluator, list[MotionState]]:
    """States at times >= 0 [s], each reached from the start by whole steps no longer than the scene's.

    Raises InputError if the scene cannot be modelled, ComputationError if the motion cannot be believed (`verdict`).
    """
    if not len(times) or not all(np.isfinite(t) and t >= 0 for t in times):
        raise InputError("times: give times of at least 0 s")
    model, solver = begun(Machine.of(scene).model(max(times))), scene.solver
    choice = pick(solver, model, step_limit)
    if max(times) > 0:
        check_step(scene, choice, model)
    evaluator, found = Evaluator(model), []
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
        found.append(MotionState(time, q, v, evaluator.acceleration(q, v, time), turns))
    return evaluator, found
