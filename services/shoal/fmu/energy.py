"""The energy of a scene along its motion."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import stability
from shoal.mechanics.analysis.at_rest import begun
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.motion_state import LANE
from shoal.mechanics.assembly.build import build
from shoal.mechanics.inertia_cap import capped
from shoal.mechanics.integrators import choose, facts, halting, pick
from shoal.mechanics.march import march
from shoal.mechanics.marched import sampled
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.workspace import at_start
from shoal.scene import Scene
from shoal.trajectory import Array


def energies(scene: Scene, times: Array) -> Array:
    """Kinetic, elastic and gravitational energy [J] at increasing times >= 0 [s], (times,).

    Springs count as elastic; what applied loads could still do does not count. For a scene that `simulate` accepts.
    """
    model = begun(capped(build(scene, horizon=max(float(times[-1]), scene.solver.duration))))
    instants = times
    if model.forces.size:
        # Turns of torsion springs are counted from sample to sample, which must be less than half a turn apart.
        instants = np.union1d(times, np.arange(0.0, times[-1], scene.solver.step))
    q, v = _states(model, instants)
    evaluator, wanted, found = Evaluator(model), set(times.tolist()), []
    for k, time in enumerate(instants.tolist()):
        evaluator.remember(q[k])
        if time in wanted:
            seen = evaluator.at(q[k], v[k], time)
            found.append(seen.kinetic + seen.strain + seen.gravity)
    return np.array(found)


def _states(model: Model, times: Array) -> tuple[Array, Array]:
    """Coordinates and rates at the times, (times, unknowns) each: the time loop with groups of unknowns as markers."""
    solver, n, d = model.scene.solver, model.unknowns, model.dimensions
    choice = pick(solver, model, stability.step_limit)
    arrays, room = at_start(model, SINGLE, LANE)
    scheme = choose(solver, model, SINGLE, LANE, choice.name)
    steps = solver.max_steps if facts(choice.name).adaptive else int(np.ceil(times[-1] / solver.step - 1e-9))
    groups = np.minimum(np.arange(0, n, d)[:, None] + np.arange(d), n - 1)
    rows = np.concatenate([groups, groups], axis=1).ravel()
    stops = halting(solver, model, choice.name, float(times[-1]))
    record = march(SINGLE, scheme, arrays, room, solver.step, steps, times, rows, solver.rank_tolerance, stops)
    samples = record.samples.reshape(len(times), len(groups), sampled(d))
    point, velocity = slice(0, d), slice(2 * d + 1, 3 * d + 1)
    q, v = (samples[:, :, columns].reshape(len(times), -1)[:, :n] for columns in (point, velocity))
    return q, v
