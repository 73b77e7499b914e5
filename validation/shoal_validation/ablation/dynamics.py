"""The swarm at every time step: sixteen combinations of its parts, the same steps, the same budget, many seeds.

The acceleration of every step is sought among 40 fish in 100 iterations; the true minimiser of Gauss's function is
known, so that the error of the acceleration is exact. The time of a combination includes the making of its seeds, but
the traditional optimum of this quadratic function is one product of a matrix and a vector.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shoal.engines.swarm_motion import SwarmSettings, Switches
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.ablation.factorial import Combination, combinations
from shoal_validation.benchmarks.acceleration import EULER, cost, with_solver

MACHINES = {"flexible-double-pendulum": 5e-4, "rigid-double-pendulum": 1e-3}
"""Scenes and their time steps [s]."""
SWARMS = ("iafsa", "iafsa-printed")
ROUND_OFF = 1e-16
"""Errors below it are shown as this; a seed that is the answer has the error zero."""


@dataclass(frozen=True)
class Steps:
    """One swarm on one machine. Arrays are (2, 2, 2, 2, seeds), by parts off and on.

    error: mean relative error of the acceleration in the mass metric; path: largest distance of a marker from the
    motion with exact accelerations [m]; evaluations: of Gauss's function, seconds: of the processor, per time step
    """

    machine: str
    swarm: str
    steps: int
    error: Array
    path: Array
    evaluations: Array
    seconds: Array


def measure(machine: str, swarm: str, *, seeds: int, steps: int, note: Callable[[], None] = lambda: None) -> Steps:
    """All combinations and seeds; `note` is called after each run."""
    scene, times = _scene(machine, steps)
    true = simulate(scene, times)
    table = np.empty((4, 2, 2, 2, 2, seeds))
    # Seeds outside, so that whatever else the machine does falls on all combinations alike.
    for seed in range(seeds):
        sought = with_solver(scene, swarm).with_values({"solver.swarm_seed": seed})
        for combination in combinations():
            begin = time.process_time()
            row = cost("", sought, times, true, SwarmSettings(switches=switches(combination)))
            seconds = (time.process_time() - begin) / steps
            place: tuple[slice | int, ...] = (slice(None), *map(int, combination), seed)
            table[place] = max(row.error, ROUND_OFF), row.path, row.evaluations, seconds
            note()
    return Steps(machine, swarm, steps, *table)


def switches(combination: Combination) -> Switches:
    """The parts as the time loop names them."""
    traditional, previous, velocity, mutation = combination
    return Switches(seed_traditional=traditional, seed_previous=previous, velocity=velocity, mutation=mutation)


def _scene(machine: str, steps: int) -> tuple[Scene, Array]:
    # Released from rest: semi-implicit Euler is off by percents of the little energy that the first steps bring.
    step = MACHINES[machine]
    duration = steps * step
    settings = {"solver.integrator": EULER, "solver.step": step, "solver.duration": duration}
    scene = load_scene(machine).with_values({**settings, "solver.energy_tolerance": 0.1})
    return scene, np.linspace(0.0, duration, steps + 1)[1:]
