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
from shoal.mechanics.marched import NUMBERS, Marched, told
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import SINGLE, Array
from shoal.mechanics.verdict import Limits
from shoal.mechanics.workspace import at_start
from shoal.scene import Scene
from shoal.trajectory import Status

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

    Raises InputError if the scene cannot be modelled, ComputationError if the motion cannot be believed (`verdict`).
    """
    if not len(times) or not all(np.isfinite(t) and t >= 0 for t in times):
        raise InputError("times: give times of at least 0 s")
    model = begun(build(scene, horizon=max(times)))
    choice = pick(scene.solver, model, stability.step_limit)
    if max(times) > 0:
        check_step(scene, choice)
    evaluator = Evaluator(model)
    limits, n = Limits(scene, model), model.unknowns
    found = []
    for time in map(float, times):
        arrays, room = at_start(model, SINGLE, LANE)
        steps = max(1, int(np.ceil(time / scene.solver.step - 1e-9))) if time > 0 else 0
        step = time / steps if steps else scene.solver.step
        scheme = choose(scene.solver, model, SINGLE, LANE, choice.name)
        if facts(choice.name).adaptive:
            steps, step = (scene.solver.max_steps if steps else 0), scene.solver.step
        stops = halting(scene.solver.model_copy(update={"step": step}), model, choice.name, time)
        rows, tolerance = model.marker_rows.ravel(), scene.solver.rank_tolerance
        record = march(SINGLE, scheme, arrays, room, step, steps, np.array([time]), rows, tolerance, stops)
        (status,), (reason,) = limits.verdict(_numbers(model, record, limits, time), choice, model.failed)
        if status is not Status.OK:
            raise ComputationError(f"{scene.name}: the motion up to {time:g} s is rejected ({status}): {reason}")
        q, v = room.z[:n].copy(), room.zdot[:n].copy()
        evaluator.turns = room.memory
        found.append(State(time, q, v, evaluator.acceleration(q, v, time), room.memory.copy()))
    return evaluator, found


def _numbers(model: Model, record: Marched, limits: Limits, end: float) -> Array:
    """Return the numbers by which the record of a run up to `end` [s] is judged, (NUMBERS, 1)."""
    markers, numbers = len(model.marker_rows), np.empty((NUMBERS, 1))
    motion, turns = np.empty((1, markers, 2 * model.dimensions + 2, 1)), np.zeros((markers, 1))
    told(record, 1, 0, turns, limits.anchors, limits.energy_floor(end), limits.span, motion, numbers)
    return numbers
