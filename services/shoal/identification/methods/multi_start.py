"""Descents from many places: half of them with the pose that the first samples fix, half anywhere in the box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import Descent, descend_many, distinct, history
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points
from shoal.trajectory import Array

SCREENED = 128
"""Points that are looked at once."""
STARTS = 16
"""Descents from the best of them, and from every pose that the first samples allow."""
_APART = 0.02
"""Two starts are different if a parameter differs by more than this fraction of its range."""


def multi_start(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Look at a Sobol sequence over the box, descend from its best points; `minima` are the others that were found."""
    poses = starting_points(model)
    points = scatter(model, poses, rng)
    values = model.fitness(points)
    starts = best_apart(model, np.concatenate([poses, points]), np.concatenate([np.zeros(len(poses)), values]), STARTS)
    return concluded(model, descend_many(model, starts, progress), [(0, *_summary(values))])


def scatter(model: ForwardModel, poses: Array, rng: np.random.Generator) -> Array:
    """SCREENED points in the box; every other one has its initial state from one of the poses."""
    from scipy.stats import qmc  # slow to import

    points = model.lower + qmc.Sobol(len(model.lower), rng=rng).random(SCREENED) * (model.upper - model.lower)
    fixed = np.any(poses != model.parameters.start, axis=0)
    if np.all(fixed):
        return np.asarray(points[: SCREENED // 2])
    turn = poses[np.arange(SCREENED // 2) % len(poses)]
    points[::2] = np.where(fixed, turn, points[::2])
    return np.asarray(points)


def best_apart(model: ForwardModel, points: Array, values: Array, count: int) -> Array:
    """The best points that are not close to a better one, one to `count`, (starts, parameters)."""
    span = model.upper - model.lower
    found: list[Array] = []
    for k in np.argsort(values, kind="stable"):
        if len(found) == count or not np.isfinite(values[k]):
            break
        if all(np.max(np.abs(points[k] - other) / span) > _APART for other in found):
            found.append(points[k])
    return np.array(found or [points[0]])


def concluded(model: ForwardModel, descents: Sequence[Descent], before: Sequence[tuple[int, float, float]]) -> Outcome:
    """The outcome of descents: the best, the other minima in order, and the rows of the search before and of theirs."""
    best, *others = distinct(model, descents) or [descents[0]]
    rows = list(before)
    for _, lowest, mean in history(descents):
        rows.append((len(rows), min(lowest, rows[-1][1]) if rows else lowest, mean))
    message = "" if best.converged else f"no convergence after {len(best.rows)} iterations"
    minima = [(descent.point, descent.fitness) for descent in others if descent.converged]
    return Outcome(best.point, best.fitness, rows, message, minima)


def _summary(values: Array) -> tuple[float, float]:
    """Lowest and mean of the values that are finite."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.mean())) if finite.size else (float("inf"), float("inf"))
