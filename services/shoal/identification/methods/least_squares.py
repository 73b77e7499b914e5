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
_SMALL_STEP = 1e-9
"""Relative to the size of a parameter; a smaller step is the end."""
_SMALL_GAIN = 1e-8
"""A step that promises to lower the fitness by less than this fraction is the end."""


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
    """Descend from every start, the best start first.

    Later starts are rivals: a rival is given up when after two steps it is still more than a hundred times
    worse than the best answer, and is then listed with the fitness it had.
    """
    starts = starting_points(model)
    first = [linearise(model, start) for start in starts]
    order = np.argsort([_cost(residual) for residual, _ in first], kind="stable")
    descents: list[Descent] = []
    rows: list[tuple[int, float, float]] = []
    for k in order:
        hopeless = 100 * min((d.fitness for d in descents), default=np.inf)
        residual, jacobian = first[k]
        descent = _descend(model, starts[k], residual, jacobian, progress, len(rows), hopeless)
        descents.append(descent)
        best_before = rows[-1][1] if rows else np.inf
        rows += [(i, min(best, best_before), mean) for i, best, mean in descent.rows]
    best = min(descents, key=lambda d: d.fitness)
    others = [(d.point, d.fitness) for d in descents if d is not best]
    message = "" if best.converged else f"no convergence after {len(best.rows)} iterations"
    return Outcome(best.point, best.fitness, rows, message, others)


def descend(model: ForwardModel, start: Array, progress: Progress) -> Descent:
    """Minimise the squared residuals from one start, within the bounds."""
    residual, jacobian = linearise(model, start)
    return _descend(model, start, residual, jacobian, progress, 0, np.inf)


def _descend(
    model: ForwardModel,
    point: Array,
    residual: Array,
    jacobian: Array,
    progress: Progress,
    first: int,
    hopeless: float,
) -> Descent:
    samples = model.samples
    cost = _cost(residual)
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    damping, growth = 1e-6, 2.0
    rows = [(first, cost / samples, cost / samples)]
    progress(*rows[-1])
    converged = not np.isfinite(cost)
    for iteration in range(1, _ITERATIONS):
        if converged or (iteration > 2 and cost / samples > hopeless):
            break
        scale = np.maximum(scale, np.linalg.norm(jacobian, axis=0))
        trial = np.clip(point + _step(jacobian, residual, damping, scale), model.lower, model.upper)
        moved = trial - point
        predicted = cost - _cost(residual + jacobian @ moved)
        if np.max(np.abs(moved) / model.sizes(point)) < _SMALL_STEP or predicted < _SMALL_GAIN * cost:
            converged = True
            break
        trial_residual, trial_jacobian = linearise(model, trial)
        trial_cost = _cost(trial_residual)
        rows.append((first + iteration, min(cost, trial_cost) / samples, trial_cost / samples))
        progress(*rows[-1])
        if trial_cost < cost:
            ratio = (cost - trial_cost) / predicted
            point, residual, jacobian, cost = trial, trial_residual, trial_jacobian, trial_cost
            damping *= max(0.1, 1 - (2 * ratio - 1) ** 3)
            growth = 2.0
        else:
            damping *= growth
            growth *= 2
            converged = damping > 1e12
    return Descent(point, residual, jacobian, cost / samples, rows, converged and bool(np.isfinite(cost)))


def _cost(residual: Array) -> float:
    return float(residual @ residual) if np.all(np.isfinite(residual)) else float("inf")


def linearise(model: ForwardModel, point: Array) -> tuple[Array, Array]:
    """Residuals at a point, (m,), and their forward-difference Jacobian, (m, parameters); 1 + parameters lanes."""
    steps = DIFFERENCE * model.sizes(point)
    steps = np.where(point + steps > model.upper, -steps, steps)
    residuals = model.residuals(np.concatenate([point[None], point + np.diag(steps)]))
    with np.errstate(invalid="ignore"):
        jacobian = ((residuals[1:] - residuals[0]) / steps[:, None]).T
    return residuals[0], np.where(np.isfinite(jacobian), jacobian, 0.0)


def _step(jacobian: Array, residual: Array, damping: float, scale: Array) -> Array:
    """Damped least-squares step in parameters scaled by the columns of the Jacobian (Marquardt 1963)."""
    stacked = np.concatenate([jacobian / scale, np.sqrt(damping) * np.eye(len(scale))])
    solution, *_ = np.linalg.lstsq(stacked, np.concatenate([-residual, np.zeros(len(scale))]), rcond=None)
    return np.asarray(solution / scale)
