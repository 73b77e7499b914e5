"""Aliases of an answer: other values by which the machine swings faster or slower, the same at every sample.

Samples in even steps show a vibration of frequency f and one of n times the sampling rate more or less f alike. Where
the bounds hold motions that the samples do not resolve, each parameter is scanned over its bounds on the first samples,
so finely that no swing is missed, the others following to first order; from the dips of the misfit descents go on to
the whole record. Where an answer leaves a misfit, its start may be the alias: from starts that turn more often between
samples it is sought again over growing parts of the record, as the first samples show all of them alike.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from shoal.identification.conventions import HARDLY
from shoal.identification.diagnostics.minima.other_starts import turned
from shoal.identification.diagnostics.minima.rivals import apart, between_samples, turn_of_samples
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.auto import explained
from shoal.identification.methods.lanes import DESCENTS, Descent, descend_many, differentiate_many, distinct
from shoal.identification.methods.least_squares import PATIENCE
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.progressive import extend
from shoal.trajectory import Array

_UNEVEN = 0.1
"""Of a step between samples: from here on uneven times distinguish a fast swing from a slow one."""
_LOOKS = 4
"""Values between the bounds and the answer, to either side, at which the motion is looked at between the samples."""
_UNRESOLVED = 0.3
"""Of a change of the motion: how far it lies off the straight line between two samples, at a fourth of their rate."""
_SAMPLES = 40
"""So many instants are scanned, or twice as many, and so on, until they vary by as much as the record."""
_VARYING = 0.5
"""Of the spread of all samples: what the first samples show at least before they stand for all."""
_COARSE, _MOST = 33, 2048
"""Points of a scan in the beginning, and at most."""


def aliases(model: ForwardModel, outcome: Outcome) -> list[Descent]:
    """Return the ends of descents from the dips of the misfit over the bounds of each parameter. Raises TimeIsUp."""
    if turn_of_samples(model, _UNEVEN) is None:
        return []
    first = _first_part(model)
    free = ~model.parameters.initial & ~model.parameters.proportional
    dips = [
        _dips(first, outcome.point, k) for k in np.flatnonzero(free).tolist() if _unresolved(first, outcome.point, k)
    ]
    found = np.concatenate(dips) if dips else np.empty((0, len(outcome.point)))
    part, end = first, first.measurement.end
    while len(found):
        ends = distinct(part, descend_many(part, np.vstack([outcome.point, found]), patience=PATIENCE))
        limit = _limit(part, outcome.point)
        good = [d for d in ends if d.fitness <= limit and apart(model, d.point, outcome.point)]
        found = np.array([d.point for d in good])
        if part is model:
            return [d for d in good if d.converged]
        end *= 2
        part = model if end >= model.measurement.end else model.until(end)
    return []


def more_turns(model: ForwardModel, outcome: Outcome) -> list[Descent]:
    """Return the fit from starts that turn more often, or less, from sample to sample, of data not yet explained."""
    if turn_of_samples(model, _UNEVEN) is None or explained(model, outcome):
        return []
    starts = list(islice(turned(model, outcome.point), 2 * DESCENTS))
    found = extend(model, np.array(starts), lambda *_: None) if starts else None
    return descend_many(model, found.point[None]) if found is not None and explained(model, found) else []


def _first_part(model: ForwardModel) -> ForwardModel:
    """The model of the first samples, that vary by half as much as all do."""
    times = np.unique(model.rows.time)
    count = _SAMPLES
    while count < len(times):
        part = model.until(float(times[count - 1]))
        if part.rows.signal >= _VARYING * model.rows.signal:
            return part
        count *= 2
    return model


def _limit(model: ForwardModel, point: Array) -> float:
    """Largest fitness with which a point explains a part of the record about as well as the answer."""
    mine = float(model.cost(model.uncounted(point[None]))[0])
    return mine + (HARDLY * model.rows.signal) ** 2 * len(model.rows.time) / model.rows.samples


def _line(point: Array, k: int, values: Array) -> Array:
    """The point with other values of a parameter, (values, parameters)."""
    points = np.repeat(point[None], len(values), axis=0)
    points[:, k] = values
    return points


def _unresolved(model: ForwardModel, point: Array, k: int) -> bool:
    """Return whether the bounds of a parameter hold motions that swing faster than the samples show."""
    ends = [np.linspace(point[k], end, _LOOKS + 1)[1:] for end in (model.lower[k], model.upper[k])]
    points = _line(point, k, np.concatenate([point[k : k + 1], *ends]))
    for name in model.measurement.recordings:
        at, straight, between = (seen[1:] - seen[0] for seen in between_samples(model, points, name))
        off, size = np.mean((between - straight) ** 2, axis=1), np.var(at, axis=1)
        if np.any(off > _UNRESOLVED**2 * size):  # nan where a motion failed
            return True
    return False


def _dips(model: ForwardModel, point: Array, k: int) -> Array:
    """Local minima of the misfit along a parameter, the others following to first order, the best first."""
    others = np.arange(len(point)) != k
    rows = len(model.rows.time)

    def scanned(values: Array) -> tuple[Array, Array, Array]:
        points = _line(point, k, values)
        if not np.any(others):
            residuals = model.uncounted(points)
            return residuals[:, :rows], model.cost(residuals), points
        residuals, jacobians = differentiate_many(model, points)
        costs = model.cost(residuals)
        for n in np.flatnonzero(np.isfinite(costs)):
            step = np.linalg.lstsq(jacobians[n][:, others], -residuals[n])[0]
            points[n, others] = np.clip(points[n, others] + step, model.lower[others], model.upper[others])
            left = residuals[n] + jacobians[n][:, others] @ step
            costs[n] = min(costs[n], float(model.cost(left[None])[0]))
        return residuals[:, :rows], costs, points

    values = np.linspace(model.lower[k], model.upper[k], _COARSE)
    residuals, costs, points = scanned(values)
    finite = residuals[np.all(np.isfinite(residuals), axis=1)]
    spread = float(np.sqrt(np.mean((finite - np.mean(finite, axis=0)) ** 2))) if len(finite) else 0.0
    while spread > 0.0 and len(values) < _MOST:
        with np.errstate(invalid="ignore"):
            off = np.sqrt(np.mean(np.diff(residuals, axis=0) ** 2, axis=1))
        middles = 0.5 * (values[1:] + values[:-1])[off > spread]
        # Where there are too many, those near the answer.
        middles = np.sort(middles[np.argsort(np.abs(middles - point[k]))][: _MOST - len(values)])
        if not len(middles):
            break
        order = np.argsort(np.append(values, middles), kind="stable")
        pairs = zip((residuals, costs, points), scanned(middles), strict=True)
        residuals, costs, points = (np.concatenate(pair)[order] for pair in pairs)
        values = np.append(values, middles)[order]
    around = np.pad(costs, 1, constant_values=np.inf)
    dips = np.flatnonzero((costs < around[:-2]) & (costs <= around[2:]))
    good = [n for n in dips[np.argsort(costs[dips], kind="stable")] if apart(model, points[n], point)]
    return points[good[:DESCENTS]]
