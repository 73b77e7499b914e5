"""The energy of a scene along its motion."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.machine import Machine
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Array


def energies(scene: Scene, times: Array) -> Array:
    """Kinetic, elastic and gravitational energy [J] at increasing times >= 0 [s], (times,).

    Springs count as elastic; what applied loads could still do does not count. For a scene that `simulate` accepts.
    """
    instants = times
    if Machine.of(scene).model().forces.size:
        # Turns of torsion springs are counted from sample to sample, which must be less than half a turn apart.
        instants = np.union1d(times, np.arange(0.0, times[-1], scene.solver.step))
    states = simulate(scene, instants, whole=True).states
    # Contacts have no energy, and are left to the caller.
    evaluator, wanted, found = Evaluator(states.model, one_sided=True, held=True), set(times.tolist()), []
    for k, time in enumerate(instants.tolist()):
        evaluator.remember(states.q[k, :, 0])
        if time in wanted:
            seen = evaluator.at(states.q[k, :, 0], states.v[k, :, 0], time)
            found.append(seen.kinetic + seen.strain + seen.gravity)
    return np.array(found)
