"""Motions in closed form with uncertain parameters, and their bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipj, ellipk
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.runs import Answers, Model
from shoal.trajectory import Array

Motion = Callable[[Array, Array], Array]
"""Places in [-1, 1]^p, (runs, parameters, 1), and instants [s] to answers, (runs, instants)."""
GRID = {1: 200_001, 2: 801}
"""Places along each axis of the scan that gives the reference."""


@dataclass(frozen=True)
class Problem:
    """A motion over `parameters` parameters at these instants [s].

    separable: a sum of functions of one parameter each, so that bounds are sums of theirs; continuous: a motion, not a
    map of single instants
    """

    name: str
    parameters: int
    times: tuple[float, ...]
    motion: Motion
    separable: bool = False
    continuous: bool = True

    @property
    def inputs(self) -> Inputs:
        """Intervals [-1, 1]."""
        return Inputs(
            tuple(UncertainParameter(f"u{k}", Interval(-1.0, 1.0), {f"u{k}": 1.0}) for k in range(self.parameters))
        )

    def at(self, instants: Array) -> Model:
        """Return the problem as a model."""

        def model(values: Mapping[str, Array]) -> Answers:
            u = np.stack([values[f"u{k}"] for k in range(self.parameters)], axis=1)[:, :, None]
            return Answers(self.motion(u, instants), np.ones(len(u), dtype=bool))

        return model

    def reference(self, grid: Mapping[int, int] = GRID) -> tuple[Array, Array]:
        """Lower and upper bounds by a fine scan, (instants,): inside the true ones by its spacing squared.

        grid: places along each axis, by the number of parameters
        """
        times = np.array(self.times)
        if self.separable:
            axis = np.linspace(-1, 1, grid[1])
            middle = self.motion(np.zeros((1, self.parameters, 1)), times)[0]
            low, high = middle.copy(), middle.copy()
            for k in range(self.parameters):
                u = np.zeros((len(axis), self.parameters, 1))
                u[:, k, 0] = axis
                beside = self.motion(u, times) - middle
                low, high = low + beside.min(axis=0), high + beside.max(axis=0)
            return low, high
        axes = np.meshgrid(*[np.linspace(-1, 1, grid[self.parameters])] * self.parameters)
        u = np.stack([axis.ravel() for axis in axes], axis=1)[:, :, None]
        found = np.array([(y.min(), y.max()) for y in (self.motion(u, np.array([t])) for t in self.times)])
        return found[:, 0], found[:, 1]


def _oscillator(u: Array, t: Array) -> Array:
    return np.cos(np.sqrt(1 + 0.05 * u[:, 0]) * t)


def pendulum(u: Array, t: Array) -> Array:
    """Angle [rad] of a pendulum of 1 m +-2 % released from 1 rad: Jacobi's elliptic functions."""
    k = math.sin(0.5)
    sine = ellipj(ellipk(k * k) + np.sqrt(9.81 / (1 + 0.02 * u[:, 0])) * t, k * k)[0]
    return np.asarray(2 * np.arcsin(k * sine))


def rod(u: Array, t: Array) -> Array:
    """First axial mode of a rod with Kelvin-Voigt damping (frequency 10 rad/s +-2 %, ratio 0.002 +-20 %)."""
    w, ratio = 10 * np.sqrt(1 + 0.04 * u[:, 0]), 0.002 * (1 + 0.2 * u[:, 1])
    return np.asarray(np.exp(-ratio * w * t) * np.cos(w * np.sqrt(1 - ratio**2) * t))


def two(u: Array, t: Array) -> Array:
    """Two frequencies without a common measure, and the waves that a curve makes of them."""
    one, other = 3.1 * (1 + 0.01 * u[:, 0]) * t, 7.7 * (1 - 0.01 * u[:, -1]) * t
    return np.asarray(np.sin(0.3 * np.cos(one) + (0.2 + 0.01 * u[:, 0]) * np.cos(other)))


def _sum(u: Array, t: Array) -> Array:
    return np.asarray(sum(np.cos((1 + 0.3 * k) * (1 + 0.05 * u[:, k]) * t) for k in range(u.shape[1])))


def _peak(u: Array, t: Array) -> Array:
    return np.asarray(t / (1 + 25 * (u[:, 0] - 0.3) ** 2 + 10 * (u[:, 1] + 0.2 * u[:, 0]) ** 2))


def _logistic(u: Array, t: Array) -> Array:
    """x -> 3.9 x (1 - x) from 0.3 +- 0.001, t times: neighbours part by a factor of about 1.6 each time."""
    x = 0.3 + 0.001 * u[:, 0, 0]
    found, step = np.empty((len(x), len(t))), 0
    for k, wanted in enumerate(t):
        while step < wanted:
            x, step = 3.9 * x * (1 - x), step + 1
        found[:, k] = x
    return found


PROBLEMS = (
    Problem("oscillator, 50 s", 1, (5.0, 20.0, 50.0), _oscillator),
    Problem("pendulum, 20 s", 1, (10.0, 20.0), pendulum),
    Problem("pendulum, 1000 s", 1, (100.0, 500.0, 1000.0), pendulum),
    Problem("rod, 20 s", 2, (5.0, 20.0), rod),
    Problem("rod, 200 s", 2, (100.0, 200.0), rod),
    Problem("two frequencies, 100 s", 2, (50.0, 100.0), two),
    Problem("peak inside", 2, (1.0,), _peak, continuous=False),
    Problem("four springs, 8 s", 4, (2.0, 8.0), _sum, separable=True),
    Problem("logistic map, 20 times", 1, (4.0, 8.0, 20.0), _logistic, continuous=False),
)
