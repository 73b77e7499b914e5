"""Step and tolerance against machine: rigid problems of the library, open, looped and singular."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shoal.trajectory import Trajectory

from shoal_validation.problems import get_problem
from shoal_validation.stability.contract import Axis, Method, StabilityMap, Watched
from shoal_validation.stability.methods import ADAPTIVE, EXUDYN, FIXED_STEP, both
from shoal_validation.stability.singular import TURNED, left
from shoal_validation.stability.steps import TOLERANCES, tolerances

SIZES = {"pendulum": 1.0, "double-pendulum": 3.0, "parallelogram": 1.0, "slider-crank": 2.0, "four-bar-2": 1.0}
"""Problem -> how far its marker can be from its bearing [m]."""


def _stuck(run: Trajectory) -> bool:
    """Return whether the slider has stayed at the crank's bearing, about which crank and rod then turn as one."""
    return bool(np.max(np.abs(run.marker("B")[:, 0] - 2.0 * run.marker("A")[:, 0])) > TURNED)


WATCHES = {"parallelogram": left, "slider-crank": _stuck}


def _watched(_: float, name: str) -> Watched:
    problem = get_problem(name)
    points = problem.reference.points
    watch = WATCHES.get(name, lambda _run: False)
    return Watched(problem.scene(), {}, problem.marker, problem.times, points, SIZES[name], left=watch)


MACHINES = Axis("machine", "", tuple(SIZES))
STEP = StabilityMap(
    "step-machine",
    "How long may the steps of each method be on machines that pass singular positions or saddle points?",
    "Machines that come to stand near their highest point multiply every error. There energy says little about the "
    "motion, least of all with a method that keeps it by construction.",
    Axis("step", "s", (1e-3, 3e-3, 1e-2, 2e-2, 5e-2, 1e-1)),
    MACHINES,
    (*FIXED_STEP, *ADAPTIVE, *both(*EXUDYN)),
    _watched,
    lambda step, _: {"solver.step": step},
)


def _with(method: Method, name: str, changes: dict[str, object]) -> Method:
    return replace(method, name=f"{method.name}, {name}", changes={**method.changes, **changes})


DRIFT_LEFT: dict[str, object] = {"solver.project": False}
BAUMGARTE: dict[str, object] = {"solver.acceleration": "baumgarte"}
MOST = 20_000
"""Steps; a method left to drift otherwise creeps through a singular position."""

TOLERANCE = StabilityMap(
    "tolerance-machine",
    "What do loose tolerances and drift left alone cost on these machines?",
    "Tolerances of 1e-6 and less hold everywhere while drift is removed. Looser ones end on the wrong swing. Without "
    "removal of drift even a tight tolerance may leave the branch at a singular position.",
    TOLERANCES,
    MACHINES,
    (
        *ADAPTIVE,
        *(_with(method, "drift left", DRIFT_LEFT) for method in ADAPTIVE),
        _with(ADAPTIVE[0], "Baumgarte", BAUMGARTE),
        _with(ADAPTIVE[0], "Baumgarte, drift left", BAUMGARTE | DRIFT_LEFT),
    ),
    _watched,
    lambda relative, _: {**tolerances(relative), "solver.max_steps": MOST},
)
