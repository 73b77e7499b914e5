"""The two global optimisers that others use most, on the fitness alone; least squares ends what they began."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import SearchHistory, descend_many
from shoal.identification.methods.outcome import Outcome, concluded
from shoal.trajectory import Array

CONTRACTED = 1e-3
"""The search is over when the population fills no more than this fraction of each range."""
GENERATIONS = 200
"""Generations at most; the search mostly ends by CONTRACTED before."""
RUNS = 4
"""Of CMA-ES, each with twice the population of the one before."""
_HUGE = 1e30
"""Fitness of a failed simulation for CMA-ES, which computes with all values."""


def differential_evolution(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Storn and Price 1997, as scipy has it; a generation is one call of the model."""
    with model.off_the_clock():  # slow to import
        from scipy import optimize

    course = SearchHistory(progress)
    span = model.upper - model.lower

    def fitness(columns: Any) -> Any:
        return course.note(model.fitness(np.atleast_2d(np.asarray(columns).T)))

    def contracted(intermediate_result: Any) -> bool:
        return bool(np.all(np.ptp(intermediate_result.population, axis=0) <= CONTRACTED * span))

    bounds = optimize.Bounds(model.lower, model.upper)
    settings: dict[str, Any] = {"vectorized": True, "updating": "deferred", "polish": False, "tol": 0.0}
    settings |= {"callback": contracted, "maxiter": GENERATIONS}
    found = optimize.differential_evolution(fitness, bounds, rng=rng, **settings)
    return concluded(model, descend_many(model, np.atleast_2d(found.x), progress), course)


def cma_es(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Covariance matrix adaptation in the unit box, restarted with twice the population (Auger and Hansen 2005)."""
    with model.off_the_clock():  # slow to import
        import cma

    # The package takes no box of one dimension; a second one is not looked at.
    size = max(2, len(model.lower))
    population = 4 + int(3 * np.log(size))
    course = SearchHistory(progress)
    ends = []

    def place(unit: Array) -> Array:
        return np.asarray(model.lower + unit[..., : len(model.lower)] * (model.upper - model.lower))

    for run in range(RUNS):
        options = {
            "bounds": [0.0, 1.0],
            "popsize": 2**run * population,
            "tolx": CONTRACTED,
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(rng.random(size), 0.3, options)
        while not strategy.stop():
            unit = strategy.ask()
            values = course.note(model.fitness(place(np.array(unit))))
            strategy.tell(unit, np.nan_to_num(values, posinf=_HUGE).tolist())
        ends.append(place(np.asarray(strategy.best.x)))
    return concluded(model, descend_many(model, np.array(ends), progress), course)
