"""Maps of rigid machines in space: singular positions, steps, and how fast a top turns."""

from __future__ import annotations

from functools import cache

import numpy as np
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.problems import get_problem, in_space
from shoal_validation.stability.contract import Axis, StabilityMap, Watched
from shoal_validation.stability.methods import ADAPTIVE, EXUDYN, FIXED_STEP, both
from shoal_validation.stability.singular import DISTANCES, WAYS, way
from shoal_validation.stability.singular_in_space import MACHINES, TURN

TIMES = np.linspace(0.05, 0.5, 10)
TURNS = np.linspace(0.02, 0.2, 10)
"""Of the top, which takes short steps."""
SIZE = 1.0
"""m, as far as the markers of all of them are from a bearing."""


@cache
def _singular(distance: float, name: str) -> Watched:
    machine, motion = MACHINES[name]
    points = TURN.apply(motion(distance)(TIMES))
    return Watched(Scene.parse(machine(distance)), {}, "A", TIMES, points, SIZE)


SINGULAR = StabilityMap(
    "space-singular",
    "Which way to the acceleration passes a singular position in space, however near it starts?",
    "All ways hold at every distance, but for kkt, which has no answer where constraints depend on each other: near "
    "the position, and anywhere on machines that are held twice (a leg too many, Bennett's linkage). It says so.",
    DISTANCES,
    Axis("machine", "", tuple(MACHINES)),
    (*(way(name, project) for project in (True, False) for name in WAYS), *ADAPTIVE, *both(*EXUDYN)),
    _singular,
    lambda *_: {"solver.step": 1e-3},
)


def _watched(_: float, name: str) -> Watched:
    problem = get_problem(name)
    return Watched(problem.scene(), {}, problem.marker, problem.times, problem.reference.points, SIZE)


STEP = StabilityMap(
    "space-step",
    "How long may the steps of each method be on rigid machines in space?",
    "The spin of 150 rad/s of the heavy top asks for the shortest steps. The energy check finds "
    "steps that are too long; Exudyn's own status does not.",
    Axis("step", "s", (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)),
    Axis("machine", "", ("spherical-pendulum", "heavy-top", "bricard")),
    (*FIXED_STEP, *both(*EXUDYN)),
    _watched,
    lambda step, _: {"solver.step": step},
)


@cache
def _path(spin: float) -> Array:
    return in_space.top([0.0, spin, 0.0], TURNS)


def _top(_: float, spin: float) -> Watched:
    return Watched(load_scene("heavy-top"), {"initial.top.spin": [0.0, spin, 0.0]}, "C", TURNS, _path(spin), SIZE)


SPIN = StabilityMap(
    "space-spin",
    "How long may the steps of each method be as a top turns faster?",
    "Directions as coordinates turn with the body, so that a step has to be a fraction of a turn: at 1000 rad/s up "
    "to a radian with energy-momentum, a third with rk4, a hundredth with leapfrog, which gains energy. Exudyn's "
    "rotations allow a third. Longer steps end with a status.",
    Axis("step", "s", (1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)),
    Axis("spin of the top", "rad/s", (1.0, 10.0, 100.0, 1000.0, 10_000.0)),
    (*FIXED_STEP, *both(*EXUDYN)),
    _top,
    lambda step, _: {"solver.step": step},
)
