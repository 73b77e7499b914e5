"""Up to a million steps: a pendulum against its elliptic functions, and a chaotic machine as far as it can be known."""

from __future__ import annotations

from functools import cache

import numpy as np
from shoal.scene import load_scene
from shoal.trajectory import Array

from shoal_validation.problems import double_pendulum, one_angle
from shoal_validation.stability.contract import Axis, StabilityMap, Watched
from shoal_validation.stability.methods import ADAPTIVE, AUTO, CASADI_CVODES, CASADI_RK4, EXUDYN, FIXED_STEP, both
from shoal_validation.stability.steps import SIZE, reference

DOP853 = next(method for method in ADAPTIVE if method.name == "dop853")
STEP = Axis("step", "s", (1e-3, 1e-2))
INSTANTS = 20


@cache
def _pendulum(steps: float, step: float) -> Watched:
    """A mass point on 1 m, released horizontally: it never comes to rest and never goes round."""
    times = step * steps * np.linspace(0.0, 1.0, INSTANTS + 1)[1:]
    return Watched(load_scene("single-pendulum"), {}, "A", times, one_angle.pendulum(times).points, 1.0)


LONG = StabilityMap(
    "long-runs",
    "What is left of energy and phase after a million steps?",
    "A bounded energy error is not a bounded phase error: the pendulum of a method of second order is late by a time "
    "that grows with the run.",
    Axis("steps", "", (1e3, 1e4, 1e5, 1e6)),
    STEP,
    (*FIXED_STEP, DOP853),
    _pendulum,
    lambda _, step: {"solver.step": step, "solver.max_steps": 10_000_000},
)


def _chaotic(horizon: float, _: float) -> Watched:
    return Watched(load_scene("rigid-double-pendulum"), {}, "B", _instants(horizon), _path(horizon), 3.0)


def _instants(horizon: float) -> Array:
    return horizon * np.linspace(0.0, 1.0, INSTANTS + 1)[1:]


@cache
def _path(horizon: float) -> Array:
    return double_pendulum.settle(_instants(horizon)).points


CHAOTIC = StabilityMap(
    "chaos",
    "How far ahead can a chaotic machine be computed?",
    "Every digit of accuracy buys the same span of time. The energy does not show where the span ends.",
    Axis("horizon", "s", (1.0, 2.0, 4.0, 6.0, 8.0, 10.0)),
    Axis("step", "s", (1e-3, 5e-3, 2e-2, 5e-2)),
    (*FIXED_STEP, *ADAPTIVE, *both(*EXUDYN, CASADI_RK4), CASADI_CVODES),
    _chaotic,
    lambda _, step: {"solver.step": step},
)


def _flexible(horizon: float, _: float) -> Watched:
    times = _instants(horizon)
    points = reference(load_scene("flexible-double-pendulum").model_dump_json(), tuple(times))
    return Watched(load_scene("flexible-double-pendulum"), {}, "B", times, points, SIZE)


FLEXIBLE = StabilityMap(
    "chaos-flexible",
    "How far ahead can the paper's own machine be computed, on its own mesh?",
    "The flexible double pendulum is chaotic too. At the paper's own step of 5e-4 s the motion is right for 0.5 s and "
    "wrong by decimetres at 3 s, with an energy error below a percent.",
    Axis("horizon", "s", (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)),
    Axis("step", "s", (1e-4, 5e-4, 1e-3)),
    (*FIXED_STEP, AUTO, *ADAPTIVE, *both(*EXUDYN)),
    _flexible,
    lambda _, step: {"solver.step": step},
)
