"""Limits of standard normal variables whose probabilities are known, and how often an interval holds these."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import integrate, stats
from scipy.stats import qmc
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.limits.choice import probability
from shoal.response.limits.margins import Margins
from shoal.response.marginals import Normal
from shoal.response.runs import Answers
from shoal.trajectory import Array

Function = Callable[[Array], Array]
"""Places, (runs, parameters), to margins, (runs,) or (runs, instants)."""
MOST = 5000
"""Runs for one probability."""


@dataclass(frozen=True)
class Repeated:
    """Repeated estimates of one limit, each with a seed of its own.

    held: share of the intervals that hold the exact probability; doubted: share that is told to be in doubt; ratios: of
    what was told to the exact probability, (repetitions,); runs: the most that one took
    """

    held: float
    doubted: float
    ratios: Array
    runs: int

    @property
    def within(self) -> float:
        """Share of the repetitions with the probability within ten per cent."""
        return float(np.mean(np.abs(self.ratios - 1) < 0.1))


def margins(function: Function, count: int) -> Margins:
    """Return the margins of a function of `count` standard normal variables."""
    names = [f"x{k}" for k in range(count)]

    def model(values: Mapping[str, Array]) -> Answers:
        found = function(np.stack([values[name] for name in names], axis=1))
        found = found if found.ndim == 2 else found[:, None]
        return Answers(found, np.ones(len(found), dtype=bool))

    return Margins(
        model, Inputs(tuple(UncertainParameter(name, Normal(0.0, 1.0), {name: 1.0}) for name in names)), MOST
    )


def plane(beta: float, count: int) -> tuple[Function, float]:
    """Return a plane at distance beta from the origin, and its probability."""
    return lambda x: beta - x.sum(axis=1) / math.sqrt(count), float(stats.norm.sf(beta))


def paraboloid(beta: float, curved: float, count: int) -> tuple[Function, float]:
    """P = E Phi(-(beta + curved r^2)), r^2 of chi-squared distribution."""

    def chance(r: float) -> float:
        return float(stats.chi2.pdf(r, count - 1) * stats.norm.sf(beta + curved * r))

    edges = [1.0, 5.0, 20.0, abs(beta / curved)]
    exact = integrate.quad(chance, 0, 200, limit=800, points=edges)[0]
    return lambda x: beta - x[:, 0] + curved * (x[:, 1:] ** 2).sum(axis=1), exact


def branches(c: float) -> tuple[Function, float]:
    """Waarts' series system of four branches, with four design points, each as an instant of its own."""

    def four(x: Array) -> Array:
        s, t = (x[:, 0] - x[:, 1]) / math.sqrt(2), (x[:, 0] + x[:, 1]) / math.sqrt(2)
        return np.stack([c + 0.2 * s**2 - t, c + 0.2 * s**2 + t, s + (c + 4) / 2, (c + 4) / 2 - s], axis=1)

    def kept(s: float) -> float:
        return float(stats.norm.pdf(s) * 2 * stats.norm.sf(c + 0.2 * s * s))

    inside = integrate.quad(kept, -(c + 4) / 2, (c + 4) / 2, epsabs=1e-16)[0]
    return four, inside + 2 * float(stats.norm.sf((c + 4) / 2))


def two(one: float, other: float) -> tuple[Function, float]:
    """Two planes in different directions."""
    exact = 1 - stats.norm.cdf(one) * stats.norm.cdf(other)
    return lambda x: np.minimum(one - x[:, 0], other + x[:, 1]), float(exact)


def sphere(exact: float, about: int) -> tuple[Function, float]:
    """Limit about the origin in the first `about` parameters, in all directions alike, as of a kinetic energy."""
    square = float(stats.chi2.isf(exact, about))
    return lambda x: square - (x[:, :about] ** 2).sum(axis=1), exact


def rods(near: float, count: int) -> tuple[Function, float]:
    """The reach of rods in line, each turned by 0.1 rad of standard deviation.

    Passed with about that probability; the exact one by the distance of the limit in many directions.
    """
    short = 0.01 * float(stats.chi2.isf(near, count)) / 2
    ways = stats.norm.ppf(qmc.Sobol(count, seed=0).random(2**14))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    inner, outer = np.zeros(len(ways)), np.full(len(ways), 12.0)
    for _ in range(40):
        middle = (inner + outer) / 2
        passed = (1 - np.cos(0.1 * middle[:, None] * ways)).sum(axis=1) > short
        inner, outer = np.where(passed, inner, middle), np.where(passed, middle, outer)
    exact = float(stats.chi(count).sf(outer).mean())
    return lambda x: short - (1 - np.cos(0.1 * x)).sum(axis=1), exact


def cube(distance: float, count: int) -> tuple[Function, float]:
    """About the origin: two design points for every parameter."""
    return lambda x: distance - np.abs(x).max(axis=1), float(1 - (1 - 2 * stats.norm.sf(distance)) ** count)


STATES: dict[str, tuple[tuple[Function, float], int]] = {
    "a plane, 1e-3": (plane(3.09, 2), 2),
    "a plane, 1e-5, eight parameters": (plane(4.26, 8), 8),
    "a plane, 1e-7": (plane(5.2, 2), 2),
    "curved away": (paraboloid(4.5, 0.3, 4), 4),
    "curved towards": (paraboloid(4.0, -0.1, 3), 3),
    "two sides": ((lambda x: 4 - np.abs(x[:, 0]), 2 * float(stats.norm.sf(4))), 2),
    "two unequal design points": (two(3.5, 4.0), 4),
    "four branches": (branches(3.0), 2),
    "four branches, 7e-6": (branches(5.0), 2),
    "a sphere, 1e-3, four parameters": (sphere(1e-3, 4), 4),
    "a sphere, 1e-6, eight parameters": (sphere(1e-6, 8), 8),
    "a sphere, 1e-4, twelve parameters": (sphere(1e-4, 12), 12),
    "a sphere about three of eight parameters, 1e-5": (sphere(1e-5, 3), 8),
    "two rods in line, 1e-6": (rods(1e-6, 2), 2),
    "eight rods in line, 1e-4": (rods(1e-4, 8), 8),
}
"""Name -> margins and the exact probability, and the number of parameters."""


def repeated(state: str, way: str, times: int) -> Repeated:
    """One of `STATES`."""
    (function, exact), count = STATES[state]
    held, doubted, ratios, most = 0, 0, [], 0
    for seed in range(times):
        run = margins(function, count)
        found = probability(run, way, seed)
        estimate = found.estimate
        lower, upper = estimate.interval
        held, most = held + int(lower[-1] <= exact <= upper[-1]), max(most, run.evaluations)
        doubted += int(bool(found.findings))
        ratios.append(estimate.probability / exact)
    return Repeated(held / times, doubted / times, np.array(ratios), most)
