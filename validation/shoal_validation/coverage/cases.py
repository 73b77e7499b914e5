"""A rigid double pendulum by Lagrange's equations (scipy), with white and with correlated noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

from shoal_validation.problems.double_pendulum import lagrange

HORIZON, RATE = 2.0, 100.0
NOISE = 5e-3
"""Standard deviation of the noise [m], whatever its correlation."""


@dataclass(frozen=True)
class Case:
    """Sought parameters, their true values, and the correlation of neighbouring samples of the noise."""

    name: str
    problem: Problem
    truth: Mapping[str, float]
    rho: float

    def model(self, seed: int) -> ForwardModel:
        """The forward model on data with noise of that seed; its size is not stated."""
        times = np.arange(1, round(HORIZON * RATE) + 1) / RATE
        points = tip(times, **self.truth) + noise(len(times), self.rho, seed)
        data = Measurement.single(times, tuple(self.problem.channels), points, "scipy DOP853", self.truth)
        return ForwardModel(self.problem, self.problem.load_scene(), get_engine("gauss"), data)


def tip(times: Array, theta1: float, theta2: float, density: float = 1000.0, friction: float = 0.0) -> Array:
    """Tip of that machine [m], (samples, 2); angles [rad], density of the second rod, friction at the ground."""
    return lagrange((theta1, theta2), times, density, friction)[1]


def noise(count: int, rho: float, seed: int) -> Array:
    """Stationary AR(1) noise of standard deviation NOISE in both coordinates, (samples, 2)."""
    draws = np.random.default_rng(seed).standard_normal((count, 2))
    draws[1:] *= np.sqrt(1 - rho**2)
    return np.asarray(NOISE * lfilter([1.0], [1.0, -rho], draws, axis=0))


def _problem(name: str, more: Mapping[str, object]) -> Problem:
    angle = {"lower": -np.pi, "upper": np.pi}
    parameters = {
        "theta1": {"path": "initial.OA.angle", **angle},
        "theta2": {"path": "initial.AB.angle", **angle},
        **more,
    }
    channels = [{"marker": "B", "quantity": q, "column": q} for q in ("x", "y")]
    data = {"name": name, "scene": "rigid-double-pendulum", "parameters": parameters, "channels": channels}
    return Problem.parse({**data, "source": {"kind": "file"}}, name)


def cases() -> list[Case]:
    """Both angles alone, and with a mass and friction; white noise and noise with a memory of ten samples."""
    start = {"theta1": np.pi / 4, "theta2": np.pi / 6}
    more = {
        "density": {"path": "bodies.AB.density", "lower": 100.0, "upper": 10000.0, "scale": "log"},
        "friction": {"path": "joints.O.friction", "lower": 0.0, "upper": 5.0},
    }
    known = {
        "angles": (_problem("angles", {}), start),
        "angles, mass, friction": (_problem("machine", more), start | {"density": 1200.0, "friction": 0.5}),
    }
    return [
        Case(f"{name}; {kind}", problem, truth, rho)
        for name, (problem, truth) in known.items()
        for kind, rho in (("white", 0.0), ("AR(1) 0.9", 0.9))
    ]
