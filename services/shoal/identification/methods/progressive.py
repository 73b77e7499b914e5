"""Fit a short horizon first, then as far as the answer predicts: how a chaotic motion is fitted by single shooting.

The landscape of a long record has many minima, that of its beginning few. The minimum of a short horizon lies in the
basin of the longer one as long as its prediction has not left the data.
"""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.least_squares import Descent, descend
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points
from shoal.trajectory import Array

FIRST = 0.5
"""The first horizon [s], or a twentieth of the record if that is shorter."""
SHORTEST, LONGEST = 1.15, 4.0
"""By which factors a horizon may grow."""
_LEFT = 0.1
"""A prediction has left the data where it is off by this fraction of their spread, or by six times what the fit is."""
_HOPELESS = 100.0
"""A start whose first fit is worse than the best one's by this factor is given up."""
_RIVAL = 4.0


def progressive(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Least squares on growing horizons, from every pose that the first samples allow.

    Work is counted by simulated time; the fitness that is shown is that of the whole record.
    """
    first = min(FIRST, max(model.measurement.end / 20, _enough(model)))
    start = model.until(first)
    fits = sorted((descend(start, point, _silent) for point in starting_points(model)), key=lambda fit: fit.fitness)
    rows: list[tuple[int, float, float]] = []
    ends: list[Descent] = []
    for fit in fits:
        if ends and fit.fitness > _RIVAL * fits[0].fitness and ends[0].fitness < _HOPELESS * fits[0].fitness:
            continue
        if fit.fitness > _HOPELESS * fits[0].fitness:
            continue
        ends.append(_climb(model, fit, first, rows, progress))
    best = min(ends, key=lambda end: end.fitness)
    given_up = [(fit.point, float(f)) for fit in fits if (f := _whole(model, fit, ends)) is not None]
    others = [(end.point, end.fitness) for end in ends if end is not best]
    message = "" if best.converged else "no convergence on the whole record"
    return Outcome(best.point, best.fitness, rows, message, [*others, *given_up])


def _climb(
    model: ForwardModel, fit: Descent, horizon: float, rows: list[tuple[int, float, float]], progress: Progress
) -> Descent:
    """From the fit of a first horizon to that of the whole record."""
    end = model.measurement.end
    while True:
        residual = model.residuals(fit.point[None])[0]
        now = float(model.cost(residual[None])[0])
        rows.append((len(rows), min(now, rows[-1][1]) if rows else now, now))
        progress(*rows[-1])
        if horizon >= end * (1 - 1e-9):
            return fit
        horizon = min(end, _reach(model, fit, residual, horizon))
        if end < SHORTEST * horizon:
            horizon = end
        part = model if horizon >= end else model.until(horizon)
        fit = descend(part, fit.point, _silent)


def _reach(model: ForwardModel, fit: Descent, residual: Array, horizon: float) -> float:
    """How far the prediction of a fit follows the data [s], within the factors of growth."""
    data = np.concatenate([r.values[np.isfinite(r.values)] for r in model.measurement.recordings.values()])
    spread = float(np.std(data * model.rows.weight))
    limit = max(6.0 * np.sqrt(fit.fitness / model.things), _LEFT * spread)
    rows = residual[: len(model.rows.time)]
    off = model.rows.time[~(np.abs(rows) <= limit)]
    later = off[off > horizon]
    left = float(later.min()) if later.size else model.measurement.end
    return float(np.clip(left, SHORTEST * horizon, LONGEST * horizon))


def _enough(model: ForwardModel) -> float:
    """The time after which every recording has shown twice as many numbers as there are parameters [s]."""
    ends = []
    for recording in model.measurement.recordings.values():
        samples = -(-2 * len(model.names) // len(recording.channels))
        ends.append(float(recording.times[min(samples, len(recording.times) - 1)]))
    return max(ends)


def _whole(model: ForwardModel, fit: Descent, ends: list[Descent]) -> float | None:
    """Fitness over the whole record of a start that was given up; None if it was not."""
    span = model.upper - model.lower
    if any(np.max(np.abs(fit.point - end.point) / span) < 1e-2 for end in ends):
        return None
    return float(model.fitness(fit.point[None])[0])


def _silent(*_: float) -> None:
    return None
