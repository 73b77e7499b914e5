"""Levenberg-Marquardt from every pose the first samples allow."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import Descent, descend_many, differentiate_many, history
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.starts import starting_points
from shoal.trajectory import Array

PATIENCE = 100.0
"""A rival that after two steps is still worse by this factor than the best start is given up."""


def least_squares(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Descend from every start side by side."""
    starts = starting_points(model)
    return from_starts(model, starts, differentiate_many(model, starts), progress)


def from_starts(model: ForwardModel, starts: Array, first: tuple[Array, Array], progress: Progress) -> Outcome:
    """Descend from starts with residuals and Jacobians known there, as `differentiate_many` gives them.

    Rivals that are given up are listed with the fitness they had.
    """
    descents = descend_many(model, starts, progress, first=first, patience=PATIENCE)
    best = min(descents, key=lambda d: d.fitness)
    others = [(d.point, d.fitness) for d in descents if d is not best]
    return Outcome(best.point, best.fitness, history(descents), best.message, others, converged=best.converged)


def descend(model: ForwardModel, start: Array, progress: Progress) -> Descent:
    """Minimise the squared residuals from one start, within the bounds."""
    return descend_many(model, start[None], progress)[0]


def differentiate(model: ForwardModel, point: Array) -> tuple[Array, Array]:
    """Residuals at a point, (m,), and their forward-difference Jacobian, (m, parameters); 1 + parameters lanes."""
    residuals, jacobians = differentiate_many(model, point[None])
    return residuals[0], jacobians[0]
