"""Contenders: every identification method of Shoal, and the global optimisers that others publish.

All are given the same bounds and the same counted model. Settings are those the packages come with, but for the ones
named here. A method of Shoal takes part as soon as it is in METHODS.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods import METHODS
from shoal.identification.methods.least_squares import descend
from shoal.trajectory import Array

Search = Callable[[ForwardModel, np.random.Generator, Progress], object]
"""Minimises the counted fitness; what it found is read from the counter."""

HUGE = 1e9
"""Fitness of a failed simulation for optimisers that want finite numbers [m^2]."""
DETERMINISTIC = {
    "auto",
    "least-squares",
    "progressive",
    "multiple-shooting",
    "casadi",
    "casadi-multiple",
    "DIRECT",
    "SHGO",
}
"""These take no random numbers: one run says all. A method that is not known here is run with every seed."""

OWN_MODEL = {"casadi", "casadi-multiple"}
"""These fit a model of their own, not the one that all others share."""


@dataclass(frozen=True)
class Contender:
    """A method: family: whose it is; seeded: whether its runs differ."""

    name: str
    family: str
    search: Search

    @property
    def seeded(self) -> bool:
        """Return whether it draws lots."""
        return self.name not in DETERMINISTIC


def contenders() -> list[Contender]:
    """Everyone."""
    found = [Contender(name, "shoal", search) for name, search in METHODS.items()]
    found.append(Contender("least-squares, random start", "shoal", random_descent))
    found += [Contender(name, "scipy", search) for name, search in SCIPY.items()]
    return found


def random_descent(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> object:
    """Levenberg-Marquardt from one point anywhere in the box: what a local method does by itself."""
    return descend(model, model.lower + rng.random(len(model.lower)) * (model.upper - model.lower), progress)


def dual_annealing(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> object:
    """Generalised simulated annealing with local searches."""
    return optimize.dual_annealing(_one(model), _bounds(model), rng=rng)


def direct(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> object:
    """Dividing rectangles, deterministic."""
    return optimize.direct(_one(model), _bounds(model), maxiter=10_000, vol_tol=0.0)


def shgo(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> object:
    """Simplicial homology with 64 Sobol points a round, deterministic."""
    with warnings.catch_warnings():
        # Its local search is told of bounds that it checks itself.
        warnings.simplefilter("ignore")
        return optimize.shgo(_one(model), _bounds(model), n=64, iters=4, sampling_method="sobol")


SCIPY: dict[str, Search] = {
    "dual annealing": dual_annealing,
    "DIRECT": direct,
    "SHGO": shgo,
}


def _bounds(model: ForwardModel) -> optimize.Bounds:
    return optimize.Bounds(model.lower, model.upper)


def _fitness(model: ForwardModel, points: Array) -> Array:
    return np.nan_to_num(model.fitness(points), posinf=HUGE)


def _one(model: ForwardModel) -> Callable[[Array], float]:
    return lambda point: float(_fitness(model, np.asarray(point)[None])[0])
