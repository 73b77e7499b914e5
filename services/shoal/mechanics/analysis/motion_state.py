"""The full state of a scene's motion at requested times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shoal.errors import ComputationError, InputError
from shoal.mechanics import stability
from shoal.mechanics.analysis.at_rest import begun
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.assembly.build import build
from shoal.mechanics.integrators import choose, facts, halting, pick
from shoal.mechanics.machine import check_step
from shoal.mechanics.march import march
from shoal.mechanics.numerics.tile import SINGLE, Array
from shoal.mechanics.workspace import at_start
from shoal.scene import Scene

LANE = slice(0, 1)
"""The only lane of a model of one scene."""


class State(NamedTuple):
    """Coordinates, rates and accelerations (unknowns,) at a time [s], and the turns of angle forces (forces,)."""

    time: float
    q: Array
    v: Array
    a: Array
    turns: Array


def states(scene: Scene, times: Sequence[float]) -> tuple[Evaluator, list[State]]:
    """States at times >= 0 [s], each reached from the start by whole steps no longer than the scene's.

    Raises InputError if the scene cannot be modelled, ComputationError if the motion is not finite.
    """
    if not len(times) or not all(np.isfinite(t) and t >= 0 for t in times):
        raise InputError("times: give times of at least 0 s")
    model = begun(build(scene, horizon=max(times)))
    choice = pick(scene.solver, model, stability.step_limit)
    if max(times) > 0:
        check_step(scene, choice)
    evaluator = Evaluator(model)
    n = model.unknowns
    none = np.zeros(0, dtype=np.int64)
    found = []
    for time in map(float, times):
        arrays, room = at_start(model, SINGLE, LANE)
        steps = max(1, int(np.ceil(time / scene.solver.step - 1e-9))) if time > 0 else 0
        step = time / steps if steps else scene.solver.step
        scheme = choose(scene.solver, model, SINGLE, LANE, choice.name)
        if facts(choice.name).adaptive:
            steps, step = (scene.solver.max_steps if steps else 0), scene.solver.step
        stops = halting(scene.solver.model_copy(update={"step": step}), model, choice.name, time)
        march(SINGLE, scheme, arrays, room, step, steps, np.array([time]), none, scene.solver.rank_tolerance, stops)
        q, v = room.z[:n].copy(), room.zdot[:n].copy()
        if not (np.all(np.isfinite(q)) and np.all(np.isfinite(v))):
            raise ComputationError(f"{scene.name}: the motion is not finite at {time:g} s; use a smaller step")
        evaluator.turns = room.memory
        found.append(State(time, q, v, evaluator.acceleration(q, v, time), room.memory.copy()))
    return evaluator, found
