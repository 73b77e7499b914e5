"""Descents from many places: half of them with the pose that the first samples fix, half anywhere in the box."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import DESCENTS, SearchHistory, best_apart, descend_many
from shoal.identification.methods.outcome import Outcome, concluded
from shoal.identification.methods.starts import starting_points
from shoal.trajectory import Array

SCREENED = 128
"""Points that are looked at once."""


def multi_start(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Look at a Sobol sequence over the box, descend from its best points; `minima` are the others that were found."""
    poses = starting_points(model)
    points = screened(model, poses, rng)
    course = SearchHistory(lambda *_: None)
    values = course.note(model.fitness(points))
    starts = best_apart(
        model, np.concatenate([poses, points]), np.concatenate([np.zeros(len(poses)), values]), 2 * DESCENTS
    )
    return concluded(model, descend_many(model, starts, progress), course)


def screened(model: ForwardModel, poses: Array, rng: np.random.Generator) -> Array:
    """SCREENED points in the box; every other one has its initial state from one of the poses."""
    with model.off_the_clock():  # slow to import
        from scipy.stats import qmc

    points = model.lower + qmc.Sobol(len(model.lower), rng=rng).random(SCREENED) * (model.upper - model.lower)
    fixed = np.any(poses != model.parameters.start, axis=0)
    if np.all(fixed):
        return np.asarray(points[: SCREENED // 2])
    turn = poses[np.arange(SCREENED // 2) % len(poses)]
    points[::2] = np.where(fixed, turn, points[::2])
    return np.asarray(points)
