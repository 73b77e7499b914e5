"""Rivals: other points that explain the data as well as the answer, and what they are to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import damped_step, differentiate_many, differing, kept_apart
from shoal.identification.methods.outcome import Outcome
from shoal.identification.spread.chances import chi_square_above
from shoal.identification.spread.uncertainty import LEVEL, Linearisation
from shoal.identification.spread.value import Value
from shoal.trajectory import Array

_EVEN, _WHOLE = 1e-3, 0.02
"""Steps between samples that differ by no more of themselves are even; turns this near to a whole number are whole."""
_STATIONS, _STEPS = 7, 10
"""Points between two minima, and how many steps they may descend towards the valley's floor."""


def rivals_of(model: ForwardModel, outcome: Outcome, at: Linearisation) -> list[Array]:
    """Other minima that fit as well as the noise can tell, without repetitions, (parameters,) each."""
    limit = as_good(model, outcome, at)
    good = [point for point, fitness in outcome.minima if fitness <= limit]
    return kept_apart([outcome.point, *good], partial(apart, model))[1:]


def as_good(model: ForwardModel, outcome: Outcome, at: Linearisation) -> float:
    """Up to which fitness another point explains the data as well as the answer, as far as the noise can tell."""
    # Of the sum of squares; correlated noise makes larger differences by chance.
    chance = max(seen.variance / seen.independent(1) for seen in at.noise)
    doubt = chi_square_above(len(outcome.point), 1.0 - LEVEL) * chance / model.rows.samples
    least = max(outcome.fitness, model.rows.things * (model.rows.noise or 0.0) ** 2)
    return outcome.fitness + min(doubt, 0.5 * least) + 1e-18


def valley(model: ForwardModel, outcome: Outcome, at: Linearisation) -> tuple[Outcome, list[Array]]:
    """The outcome without those minima that lie in its own valley, and these, (parameters,) each. Raises TimeIsUp."""
    limit = as_good(model, outcome, at)
    same = [point for point in rivals_of(model, outcome, at) if connected(model, outcome.point, point, limit)]
    here = [outcome.point, *same]
    minima = [end for end in outcome.minima if all(apart(model, end[0], point) for point in here)]
    return replace(outcome, minima=minima), same


def connected(model: ForwardModel, one: Array, other: Array, limit: float) -> bool:
    """Whether a path leads from one point to another on which the fitness stays below a limit.

    Points on the line between them descend across it, all side by side, for a few steps. Runs are not counted.
    """
    model = model.aside()
    span = model.upper - model.lower
    difference = other - one
    turns = 2 * np.pi * np.round(difference / (2 * np.pi))
    way = (difference - np.where(model.parameters.turning, turns, 0.0)) / span
    across = np.linalg.svd(way[None])[2][1:].T * span[:, None]
    points = one + np.linspace(0.0, 1.0, _STATIONS + 2)[1:-1, None] * way * span
    points = np.clip(points, model.lower, model.upper)
    residuals, jacobians = differentiate_many(model, points)
    values, damping = model.cost(residuals), np.full(_STATIONS, 1e-3)
    for _ in range(_STEPS):
        above = np.flatnonzero(values > limit)
        if not above.size:
            return True
        steps = [_downhill(residuals[k], jacobians[k] @ across, damping[k]) for k in above]
        trials = np.clip(points[above] + np.array(steps) @ across.T, model.lower, model.upper)
        found, slopes = differentiate_many(model, trials)
        lower = model.cost(found) < values[above]
        damping[above] *= np.where(lower, 0.1, 10.0)
        kept = above[lower]
        points[kept], residuals[kept], jacobians[kept] = trials[lower], found[lower], slopes[lower]
        values[kept] = model.cost(found[lower])
    return bool(np.all(values <= limit))


def _downhill(residual: Array, jacobian: Array, damping: float) -> Array:
    """A damped least-squares step from residuals (rows,) by their Jacobian (rows, directions)."""
    if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(jacobian)):
        return np.zeros(jacobian.shape[1])
    return damped_step(residual, jacobian, np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), damping)


def apart(model: ForwardModel, one: Array, other: Array) -> bool:
    """Whether two points are different machines; angles that differ by whole turns are not."""
    return bool(np.any(differing(model, one, other)))


def turn_of_samples(model: ForwardModel) -> float | None:
    """The rate [rad/s] at which a body turns once from each sample to the next; None where samples are uneven."""
    steps = [np.diff(recording.times) for recording in model.measurement.recordings.values()]
    if any(step.size == 0 or np.ptp(step) > _EVEN * step[0] for step in steps):
        return None
    return float(2 * np.pi / max(step[0] for step in steps))


def within(model: ForwardModel, point: Array, parameters: Mapping[str, Value]) -> bool:
    """Whether intervals that are wide for the mesh's own error, more than for noise, include a point already."""
    if not any(value.correction is not None and abs(value.correction) > value.std for value in parameters.values()):
        return False
    values = zip(model.names, model.parameters.to_values(point), strict=True)
    return all(parameters[name].lower <= value <= parameters[name].upper for name, value in values)


def relation(model: ForwardModel, one: Array, other: Array) -> str:
    """What another solution is to the first: a mirror image, another clock or camera, or just different."""
    changed = np.flatnonzero(differing(model, one, other))
    turn = turn_of_samples(model)
    if turn is not None and all(model.parameters.paths[k].endswith(".rate") for k in changed):
        turns = (one - other)[changed] / turn
        if np.all(np.abs(turns - np.round(turns)) < _WHOLE):
            return "the same at every sample, by whole turns between samples; sample more often"
    if np.all(model.parameters.initial[changed]):
        return "mirror images: the same marker positions with another pose"
    entries = list(model.parameters.entries.values())
    if all(entries[k].parameter.of_measurement for k in changed):
        return "one machine, recorded in different ways"
    if not np.any(differing(model, np.abs(one), np.abs(other))):
        return "mirror images: parameters with the opposite sign"
    return "different machines"
