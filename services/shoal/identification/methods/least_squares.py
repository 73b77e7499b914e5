"""Levenberg-Marquardt by finite-difference lanes, from every pose the first samples allow.

One call per iteration simulates a trial point together with its neighbours, so the Jacobian is
there when the trial is accepted (Nielsen's damping rule; Madsen, Nielsen, Tingleff,
Methods for non-linear least squares problems, 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points
from shoal.trajectory import Array

DIFFERENCE = 1e-6
"""Step of the finite differences, relative to the size of a parameter (at least 1e-3 of its range)."""
_ITERATIONS = 60
_STARTS = 8


@dataclass(frozen=True)
class Descent:
    """A local search: where it ended, residuals and Jacobian there, and its rows of (iteration, best, mean)."""

    point: Array
    residual: Array
    jacobian: Array
    fitness: float
    rows: list[tuple[int, float, float]]
    converged: bool


def least_squares(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Descend from every start, best start first; a start whose descent can only end elsewhere is still descended."""
    starts = starting_points(model)[:_STARTS]
    descents: list[Descent] = []
    rows: list[tuple[int, float, float]] = []
    for start in starts:
        descent = descend(model, start, progress, first=len(rows))
        descents.append(descent)
        best_before = rows[-1][1] if rows else np.inf
        rows += [(k, min(best, best_before), mean) for k, best, mean in descent.rows]
    best = min(descents, key=lambda d: d.fitness)
    others = [(d.point, d.fitness) for d in descents if d is not best]
    message = "" if best.converged else f"no convergence after {_ITERATIONS} iterations"
    return Outcome(best.point, best.fitness, rows, message, others)


def descend(model: ForwardModel, start: Array, progress: Progress, first: int = 0) -> Descent:
    """Minimise the squared residuals from one start, within the bounds."""
    point = start
    residual, jacobian = linearise(model, point)
    cost = float(residual @ residual)
    samples = len(model.measurement.times)
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    damping, growth = 1e-6, 2.0
    rows = [(first, cost / samples, cost / samples)]
    progress(*rows[-1])
    converged = not np.isfinite(cost)
    for iteration in range(1, _ITERATIONS):
        if converged:
            break
        scale = np.maximum(scale, np.linalg.norm(jacobian, axis=0))
        step = _step(jacobian, residual, damping, scale)
        trial = np.clip(point + step, model.lower, model.upper)
        moved = trial - point
        if np.max(np.abs(moved) / _sizes(model, point)) < 1e-12:
            converged = True
            break
        trial_residual, trial_jacobian = linearise(model, trial)
        trial_cost = float(trial_residual @ trial_residual)
        predicted = cost - float(np.sum((residual + jacobian @ moved) ** 2))
        if trial_cost < cost:
            ratio = (cost - trial_cost) / max(predicted, 1e-300)
            small = np.max(np.abs(moved) / _sizes(model, trial)) < 1e-10 or cost - trial_cost < 1e-12 * cost
            point, residual, jacobian, cost = trial, trial_residual, trial_jacobian, trial_cost
            damping *= max(1 / 3, 1 - (2 * ratio - 1) ** 3) if ratio < 1 else 0.1
            growth = 2.0
            converged = bool(small) or cost / samples < 1e-24
        else:
            # Nothing left to gain: what the model predicts is below the round-off of the cost.
            converged = predicted < 1e-10 * cost or damping > 1e12
            damping *= growth
            growth *= 2
        rows.append((first + iteration, cost / samples, trial_cost / samples))
        progress(*rows[-1])
    return Descent(point, residual, jacobian, cost / samples, rows, converged and bool(np.isfinite(cost)))


def linearise(model: ForwardModel, point: Array) -> tuple[Array, Array]:
    """Residuals at a point, (m,), and their forward-difference Jacobian, (m, parameters); 1 + parameters lanes."""
    steps = DIFFERENCE * _sizes(model, point)
    steps = np.where(point + steps > model.upper, -steps, steps)
    residuals = model.residuals(np.concatenate([point[None], point + np.diag(steps)]))
    with np.errstate(invalid="ignore"):
        jacobian = ((residuals[1:] - residuals[0]) / steps[:, None]).T
    return residuals[0], np.where(np.isfinite(jacobian), jacobian, 0.0)


def _sizes(model: ForwardModel, point: Array) -> Array:
    return np.maximum(np.abs(point), 1e-3 * (model.upper - model.lower))


def _step(jacobian: Array, residual: Array, damping: float, scale: Array) -> Array:
    """Damped least-squares step in parameters scaled by the columns of the Jacobian (Marquardt 1963)."""
    stacked = np.concatenate([jacobian / scale, np.sqrt(damping) * np.eye(len(scale))])
    solution, *_ = np.linalg.lstsq(stacked, np.concatenate([-residual, np.zeros(len(scale))]), rcond=None)
    return np.asarray(solution / scale)
