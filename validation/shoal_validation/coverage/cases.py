"""A rigid double pendulum by Lagrange's equations (scipy), with white and with correlated noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lfilter
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

HORIZON, RATE = 2.0, 100.0
NOISE = 5e-3
"""Standard deviation of the noise [m], whatever its correlation."""
G = 9.81
LENGTHS = (1.0, 2.0)
MASS = 1.0
"""Of the first rod; that of the second follows from its density."""


@dataclass(frozen=True)
class Case:
    """What is sought, its true values, and the correlation of neighbouring samples of the noise."""

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
    """Tip [m], (samples, 2), of two uniform rods of 1 m 1 kg and 2 m, released from rest at absolute angles from +X.

    density: of the second rod, of 1e-3 m^2 [kg/m^3]; friction: of the joint at the ground [N m s]
    """
    (l1, l2), m1, m2 = LENGTHS, MASS, density * 1e-3 * LENGTHS[1]

    def rate(_: float, y: Array) -> Array:
        a, b, u, w = y
        c, s = np.cos(a - b), np.sin(a - b)
        mass = np.array([[(m1 / 3 + m2) * l1**2, m2 * l1 * l2 / 2 * c], [m2 * l1 * l2 / 2 * c, m2 * l2**2 / 3]])
        load = np.array(
            [
                -m2 * l1 * l2 / 2 * s * w * w - (m1 / 2 + m2) * G * l1 * np.cos(a) - friction * u,
                m2 * l1 * l2 / 2 * s * u * u - m2 * G * l2 / 2 * np.cos(b),
            ]
        )
        return np.concatenate([[u, w], np.linalg.solve(mass, load)])

    start = [theta1, theta2, 0.0, 0.0]
    run = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-11)
    a, b = run.y[:2]
    return np.stack([l1 * np.cos(a) + l2 * np.cos(b), l1 * np.sin(a) + l2 * np.sin(b)], axis=1)


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
