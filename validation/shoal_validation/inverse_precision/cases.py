"""The identification problems of the charts: data that the fitted model did not compute, one budget for all methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.problems.double_pendulum import settle

RATE = 100.0
"""Samples a second, those of the paper's record."""
BUDGET = 2000
"""Evaluations of every method on every case: 40 fish, the first swarm and 49 iterations."""
PLAIN = {"solver.relative_tolerance": 1e-6, "solver.absolute_tolerance": 1e-8}
"""Of DOP853 on the rigid machine: 4e-4 m off at B after 5 s, far from round-off and from the data's own equations."""


@dataclass(frozen=True)
class Case:
    """A problem as it is measured: about: one line; data: makes the measurement; values: fields of the fitted scene."""

    name: str
    about: str
    problem: Problem
    data: Callable[[Problem], Measurement]
    values: Mapping[str, object] = field(default_factory=dict)

    def model(self, measurement: Measurement) -> ForwardModel:
        """A forward model with a counter of its own."""
        return ForwardModel(self.problem, self.problem.load_scene(self.values), get_engine("gauss"), measurement)


def rigid_problem() -> Problem:
    """Both angles of the rigid double pendulum, anywhere, from the motion of its tip."""
    angle = {"lower": -np.pi, "upper": np.pi}
    data = {
        "name": "rigid-double-pendulum",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **angle},
            "theta2": {"path": "initial.AB.angle", **angle},
        },
        "channels": [{"marker": "B", "quantity": "x", "column": "x"}, {"marker": "B", "quantity": "y", "column": "y"}],
        "source": {"kind": "file", "duration": 10.0},
    }
    return Problem.parse(data, "rigid-double-pendulum")


def textbook(
    problem: Problem, horizon: float, noise: float = 0.0, seed: int = 0, rate: float = RATE, stated: bool = False
) -> Measurement:
    """The tip by Lagrange's equations (scipy) up to `horizon` [s], `rate` samples a second, with white noise [m].

    stated: whether the measurement says how large the noise is.
    """
    count = round(horizon * rate)
    times = np.arange(1, count + 1) / rate
    points: Array = settle(times).points + noise * np.random.default_rng(seed).standard_normal((count, 2))
    scene: Scene = load_scene(problem.scene)
    truth = {name: float(scene.value(p.path)) for name, p in problem.parameters.items() if p.path}
    origin = f"Lagrange's equations, scipy DOP853, noise {noise:g} m"
    return Measurement.single(times, tuple(problem.channels), points, origin, truth, noise if stated else None)


def _library(problem: Problem) -> Measurement:
    return measure(problem, problem.load_scene())


CASES = {
    case.name: case
    for case in (
        Case(
            "paper-case-1",
            "flexible double pendulum, 0.5 s; data: Exudyn 16/32 elements, model: 4/8 elements",
            load_problem("paper-case-1"),
            _library,
        ),
        Case(
            "paper-case-1-same-mesh",
            "flexible double pendulum, 0.5 s; data: CasADi 2/4 elements, model: the same mesh, leapfrog 2e-4 s",
            load_problem("paper-case-1-same-mesh"),
            _library,
            {"solver.integrator": "leapfrog", "solver.step": 2e-4},
        ),
        Case(
            "rigid-2s",
            "rigid double pendulum, 2 s, all angles allowed; data: Lagrange's equations by scipy",
            rigid_problem(),
            lambda problem: textbook(problem, 2.0),
            PLAIN,
        ),
        Case(
            "rigid-5s",
            "rigid double pendulum, 5 s, all angles allowed; data: Lagrange's equations by scipy",
            rigid_problem(),
            lambda problem: textbook(problem, 5.0),
            PLAIN,
        ),
    )
}
