"""Differential evolution on the fitness alone; least squares ends what it began."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import optimize

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.course import CONTRACTED, Course
from shoal.identification.methods.lanes import descend_many
from shoal.identification.methods.outcome import Outcome, concluded

GENERATIONS = 200


def differential_evolution(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Storn and Price 1997, as scipy has it; a generation is one call of the model."""
    course = Course(progress)
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
