"""Progressive horizon: fit the beginning, see how far the answer predicts, fit up to there, and so to the end.

Over a long record of a chaotic motion the squared residual has a great many minima and the true one is very narrow;
over a short one it has few. The answer of a horizon lies in the basin of a longer one as long as it predicts the motion
up to there (horizon continuation; Baake et al., Physical Review A 45, 1992; Pisarenko and Sornette, Physical Review E
69, 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import descend_many, distance, distinct, history, kept_apart, squares
from shoal.identification.methods.least_squares import differentiate
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.starts import GAIN, starting_points
from shoal.trajectory import Array

FIRST, _PART = 0.5, 0.1
"""The first horizon [s], and of the record, at most; longer where the samples up to there are too few."""
_ROWS = 3
"""Numbers in the first horizon for each parameter, at least."""
_LEAST, _MOST = 1.15, 3.0
"""By how much a horizon grows."""
_PREDICTED = 0.1
"""A deviation below this fraction of the spread of the data is predicted, and so is one that the fit has as well."""
_NOTICED = 5.0
"""Times the deviation of the fit."""
_ITERATIONS = 8
"""Steps on each horizon."""
_HOPELESS = 25.0
"""Times the fitness of the best branch on the same horizon: a branch that is worse is dropped."""
TRUST = 0.3
"""Of its range: standard deviation of a parameter around the answer of the horizon before."""


@dataclass(frozen=True)
class Branch:
    """One start on its way. point: (parameters,); fitness: on its present horizon."""

    point: Array
    fitness: float


def progressive(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """From every pose that the first samples allow over growing horizons to the whole record, then least squares."""
    return extend(model, starting_points(model), progress)


def extend(model: ForwardModel, starts: Array, progress: Progress) -> Outcome:
    """The answers of the starts (starts, parameters), over growing horizons."""
    branches = [Branch(start, np.inf) for start in starts]
    horizon, end = first_horizon(model), model.measurement.end
    while horizon < end:
        part = model.until(horizon)
        branches = _survivors(model, [fit(part, branch.point) for branch in branches])
        horizon = max(_reach(model, branch, horizon) for branch in branches)
    descents = descend_many(model, np.array([branch.point for branch in branches]), progress)
    best = min(descents, key=lambda d: d.fitness)
    others = [(d.point, d.fitness) for d in distinct(model, descents) if d is not best]
    return Outcome(best.point, best.fitness, history(descents), best.message, others)


def first_horizon(model: ForwardModel) -> float:
    """The time [s] up to which there are numbers enough for the parameters, and FIRST or a part of the record."""
    needed = _ROWS * len(model.names)
    times = np.sort(model.rows.time)
    enough = times[min(needed, len(times)) - 1]
    begun = max(r.times[min(2, len(r.times) - 1)] for r in model.measurement.recordings.values())
    return float(min(max(min(FIRST, _PART * model.measurement.end), enough, begun), model.measurement.end))


def fit(model: ForwardModel, start: Array) -> Branch:
    """Levenberg-Marquardt of a few steps, which leaves near the start what the samples do not determine.

    The start counts as a prior whose standard deviation is a part of a parameter's range, against the deviation that
    the fit has. So each step minimises another sum than the last, unlike in `numerics.levenberg_marquardt`.
    """
    span = model.upper - model.lower
    point, damping = start, 1e-3
    residual, jacobian = differentiate(model, point)
    for _ in range(_ITERATIONS):
        cost = squares(residual)
        if not np.isfinite(cost):
            break
        trust = np.sqrt(cost / len(residual)) / TRUST / span
        scale = np.sqrt(np.sum(jacobian**2, axis=0) + trust**2)
        normal = jacobian.T @ jacobian + np.diag(trust**2 + damping * scale**2)
        gradient = jacobian.T @ residual + trust**2 * (point - start)
        step = np.linalg.solve(normal / scale / scale[:, None], gradient / scale) / scale
        trial = np.clip(point - step, model.lower, model.upper)
        predicted = cost - squares(residual + jacobian @ (trial - point))
        if predicted < GAIN * cost:
            break
        there = differentiate(model, trial)
        if squares(there[0]) < cost:
            point, (residual, jacobian) = trial, there
            damping /= 10
        else:
            damping *= 100
    return Branch(point, float(model.cost(residual[None])[0]))


def _survivors(model: ForwardModel, branches: list[Branch]) -> list[Branch]:
    """The branches worth going on with, best first: none that is much worse than the best, none twice."""
    best, *others = sorted(branches, key=lambda b: b.fitness)
    worth = [best, *(branch for branch in others if branch.fitness <= _HOPELESS * best.fitness)]
    return kept_apart(worth, lambda one, other: distance(model, one.point, other.point) > 1e-5)


def _reach(model: ForwardModel, branch: Branch, horizon: float) -> float:
    """The next horizon [s] of a branch: where its prediction leaves the data."""
    part = model.until(min(_MOST * horizon, model.measurement.end))
    residual = part.residuals(branch.point[None])[0, : len(part.rows.time)]
    allowed = max(_PREDICTED * model.rows.signal, _NOTICED * float(np.sqrt(branch.fitness)))
    off = part.rows.time[np.abs(residual) > allowed]
    off = off[off > horizon]
    worst = float(np.min(off)) if off.size else part.measurement.end
    return min(max(worst, _LEAST * horizon), model.measurement.end)
