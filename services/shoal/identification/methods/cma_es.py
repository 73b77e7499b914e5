"""Covariance matrix adaptation on the fitness alone; least squares ends what it began."""

from __future__ import annotations

import cma
import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.course import CONTRACTED, Course
from shoal.identification.methods.lanes import descend_many
from shoal.identification.methods.outcome import Outcome, concluded
from shoal.trajectory import Array

RUNS = 4
"""Each with twice the population of the one before."""
_HUGE = 1e30
"""Fitness of a failed simulation, as the package computes with all values."""


def cma_es(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """In the unit box, restarted with twice the population (Auger and Hansen 2005)."""
    # The package takes no box of one dimension; a second one is not looked at.
    size = max(2, len(model.lower))
    population = 4 + int(3 * np.log(size))
    course = Course(progress)
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
