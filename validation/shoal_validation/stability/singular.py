"""Ways to the acceleration started near and at a singular position, as the cranks' masses get unlike.

The parallelogram with a coupler of 2 kg, cranks of 1 kg and of a multiple, a force of 20 N to the side, started flat or
at a small angle from it with 4 rad/s. Its coupler translates: the machine is one pendulum (`problems/one_angle.py`).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from shoal.scene import load_scene
from shoal.trajectory import Array, Trajectory

from shoal_validation.problems.one_angle import G, motion
from shoal_validation.stability.contract import Axis, Method, StabilityMap, Watched
from shoal_validation.stability.methods import ADAPTIVE, EXUDYN, GAUSS, both

SIDE = 20.0
"""N"""
RATE = -4.0
"""rad/s"""
TURNED = 0.1
"""m; a coupler whose ends differ by so much from a translation has left the branch."""
TIMES = np.linspace(0.1, 3.0, 30)
STEP = 1e-3
DISTANCES = Axis("distance from the singular position", "rad", (0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2))
MASSES = Axis("mass of one crank over the other", "", (1.0, 3.0, 30.0, 1000.0))


def machine(distance: float, ratio: float, accuracy: float = 1e-3) -> Watched:
    """The parallelogram of one cell."""
    start = {f"initial.{name}.{key}": value for name in ("left", "right")
             for key, value in (("angle", distance), ("rate", RATE))}  # fmt: skip
    load = {"pull": {"kind": "force", "at": {"body": "left", "point": "end"}, "force": [SIDE, 0.0]}}
    crank = {"bodies.right.mass": ratio, "bodies.right.inertia": ratio / 12}
    fields = {**start, **crank, "loads": load}
    return Watched(load_scene("parallelogram"), fields, "A", TIMES, reference(distance, ratio), 1.0, accuracy, left)


@cache
def reference(distance: float, ratio: float) -> Array:
    """End of the first crank [m], (times, 2)."""
    inertia, moment = (1.0 + ratio) / 3 + 2.0, (1.0 + ratio) / 2 + 2.0
    angle = motion(lambda a, _: (-moment * G * np.cos(a) - SIDE * np.sin(a)) / inertia, distance, RATE, TIMES)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def left(run: Trajectory) -> bool:
    """Return whether the coupler has turned: the machine went on as an antiparallelogram."""
    across = run.marker("B") - run.marker("A") - np.array([2.0, 0.0])
    return bool(np.max(np.linalg.norm(across, axis=1)) > TURNED)


def way(acceleration: str, project: bool) -> Method:
    """A way to the acceleration, with drift removed after every step or left; steps by rk4."""
    name = acceleration if project else f"{acceleration}, drift left"
    changes = {"solver.integrator": "rk4", "solver.acceleration": acceleration, "solver.project": project}
    return Method(name, GAUSS, changes)


WAYS = ("projection", "kkt", "augmented-lagrangian", "proximal", "baumgarte")
ACCELERATION = StabilityMap(
    "singular",
    "Which way to the acceleration passes a singular position, however near it starts?",
    "With drift removed after every step all ways but kkt hold at every distance and mass. kkt has no answer near "
    "the position once the cranks are unlike, and says so; equal cranks hide it. Left to drift, only Baumgarte's "
    "way holds. The others leave the branch or diverge, and the checks find it.",
    DISTANCES,
    MASSES,
    (*(way(name, project) for project in (True, False) for name in WAYS), *ADAPTIVE, *both(*EXUDYN)),
    machine,
    lambda *_: {"solver.step": STEP},
)
