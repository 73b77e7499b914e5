"""Rivals: other points that explain the data as well as the answer, and what they are to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from shoal.identification.conventions import LEVEL
from shoal.identification.diagnostics.hypotheses import Hypothesis
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import UNDAMPED, damped_step, differentiate_many, differing, kept_apart
from shoal.identification.methods.outcome import Outcome
from shoal.identification.uncertainty.chances import chi_square_above
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.mechanics.numerics.levenberg_marquardt import levenberg_marquardt
from shoal.mechanics.numerics.tile import Index
from shoal.trajectory import Array

ALIAS = "the same at every sample, and apart between samples"
"""What an answer's alias is to it."""
_EVEN = 1e-3
"""Steps between samples that differ by no more of themselves are even."""
_PART = 0.382
"""Of the way from one sample to the next."""
_BETWEEN, _SEEN = 9.0, 0.01
"""Motions are apart between samples by so many times more than at them, in squares, and by so much of the spread's."""
_STATIONS, _STEPS = 7, 10
"""Points between two minima, and how many steps they may descend towards the valley's floor."""


def rivals_of(model: ForwardModel, outcome: Outcome, at: Linearisation) -> list[Array]:
    """Other minima that fit as well within the noise, without repetitions, (parameters,) each."""
    limit = as_good(model, outcome, at)
    good = [point for point, fitness in outcome.minima if fitness <= limit]
    return kept_apart([outcome.point, *good], partial(apart, model))[1:]


def as_good(model: ForwardModel, outcome: Outcome, at: Linearisation) -> float:
    """Largest fitness with which a point explains the data as well as the answer within the noise."""
    doubt = chi_square_above(len(outcome.point), 1.0 - LEVEL) * _unit(at) / model.rows.samples
    least = max(outcome.fitness, model.rows.things * (model.rows.noise or 0.0) ** 2)
    return outcome.fitness + min(doubt, 0.5 * least) + 1e-18


def rows_of(model: ForwardModel, outcome: Outcome, at: Linearisation) -> list[Hypothesis]:
    """Return a row of the table of hypotheses for each other minimum, the best first.

    It frees nothing, so that no p-value decides: chi-square drops by a negative number, and one above minus the
    quantile of the joint confidence region (see `as_good`) fits as well.
    """
    rows, unit = list[Hypothesis](), max(_unit(at) / model.rows.samples, 1e-300)
    for point, fitness in sorted(outcome.minima, key=lambda end: end[1]):
        if np.isfinite(fitness):
            values = zip(model.names, model.parameters.to_values(point), strict=True)
            name = ", ".join(f"{name} = {value:.4g}" for name, value in values)
            drop, share = (outcome.fitness - fitness) / unit, 1.0 - fitness / max(outcome.fitness, 1e-300)
            rows.append(Hypothesis(name, "minimum", 0, drop, 1.0, 1.0, share, fitted=True))
    return rows


def _unit(at: Linearisation) -> float:
    """The mean square by which differences of a sum of squares are chi-square; correlated noise makes it larger."""
    return max(seen.variance / seen.independent(1) for seen in at.noise)


def valley(model: ForwardModel, outcome: Outcome, at: Linearisation) -> tuple[Outcome, list[Array]]:
    """The outcome without those minima that lie in its own valley, and these, (parameters,) each. Raises TimeIsUp."""
    limit = as_good(model, outcome, at)
    same = [point for point in rivals_of(model, outcome, at) if connected(model, outcome.point, point, limit)]
    here = [outcome.point, *same]
    minima = [end for end in outcome.minima if all(apart(model, end[0], point) for point in here)]
    return replace(outcome, minima=minima), same


def connected(model: ForwardModel, one: Array, other: Array, limit: float) -> bool:
    """Return whether a path leads from one point to another on which the fitness stays below a limit.

    Points on the line between them descend across it, all side by side, for a few steps. A valley that bends is walked
    from one end where that fails, each point from where the last one came to. Runs are not counted.
    """
    model = model.aside()
    span = model.upper - model.lower
    way = _way(model, one, other) / span
    across = np.linalg.svd(way[None])[2][1:].T * span[:, None]
    points = one + np.linspace(0.0, 1.0, _STATIONS + 2)[1:-1, None] * way * span
    if np.all(_descended(model, points, across, limit)[1] <= limit):
        return True
    last, step = one, way * span / (_STATIONS + 1)
    for _ in range(_STATIONS):
        residual, jacobian = (found[0] for found in differentiate_many(model, last[None]))
        wanted = last + step
        if np.all(np.isfinite(jacobian)):
            wanted = wanted + across @ _downhill(residual + jacobian @ step, jacobian @ across, UNDAMPED)
        (last,), values = _descended(model, wanted[None], across, limit)
        if not values[0] <= limit:
            return False
    # From the last one the line leads to the end itself.
    between = last + np.linspace(0.0, 1.0, _STATIONS + 2)[1:-1, None] * _way(model, last, other)
    return bool(np.all(_descended(model, between, across, limit)[1] <= limit))


def _way(model: ForwardModel, one: Array, other: Array) -> Array:
    """From one point to another, angles by less than a turn, (parameters,)."""
    difference = other - one
    turns = 2 * np.pi * np.round(difference / (2 * np.pi))
    return np.asarray(difference - np.where(model.parameters.turning, turns, 0.0))


def _descended(model: ForwardModel, points: Array, across: Array, limit: float) -> tuple[Array, Array]:
    """Points (points, parameters) after a few steps along the columns of `across`, and their fitness, (points,)."""

    def solve(residuals: Array, jacobians: Array, damping: Array, _: Index) -> Array:
        searches = zip(residuals, jacobians @ across, damping, strict=True)
        return np.array([_downhill(*one) for one in searches]).reshape(len(residuals), across.shape[1]) @ across.T

    found = levenberg_marquardt(
        lambda points, _: differentiate_many(model, points), solve, np.clip(points, model.lower, model.upper),
        gain=0.0, close=float(np.sqrt(limit * model.rows.samples)), most=_STEPS,
        move=lambda points, step: np.clip(points + step, model.lower, model.upper),
    )  # fmt: skip
    return found.points, model.cost(found.residuals)


def _downhill(residual: Array, jacobian: Array, damping: float) -> Array:
    """A damped least-squares step from residuals (rows,) by their Jacobian (rows, directions)."""
    if not np.all(np.isfinite(residual)) or not np.all(np.isfinite(jacobian)):
        return np.zeros(jacobian.shape[1])
    return damped_step(residual, jacobian, np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), damping)


def apart(model: ForwardModel, one: Array, other: Array) -> bool:
    """Return whether two points are different machines; angles that differ by whole turns are not."""
    return bool(np.any(differing(model, one, other)))


def turn_of_samples(model: ForwardModel, uneven: float = _EVEN) -> float | None:
    """The rate [rad/s] at which a body turns once from each sample to the next; None where samples are uneven.

    Steps may be whole multiples of the shortest, where samples are missing; uneven: of it, by how much they may be off.
    """
    shortest = []
    for recording in model.measurement.recordings.values():
        steps = np.diff(recording.times)
        if steps.size == 0 or np.any(np.abs(steps - _usual(steps) * np.round(steps / _usual(steps))) > uneven * steps):
            return None
        shortest.append(_usual(steps))
    return float(2 * np.pi / max(shortest))


def _usual(steps: Array) -> float:
    """The step between samples where none are missing."""
    return float(np.median(steps[steps < 1.5 * np.min(steps)]))


def between_samples(model: ForwardModel, points: Array, name: str) -> tuple[Array, Array, Array]:
    """Channels of a recording over their spread where no samples are missing, (points, instants * channels) each.

    At the first of two samples, and a part of the way to the next: on the straight line, and by the motion itself. The
    part is no simple fraction: in the middle every other alias is the same as well.
    """
    recording = model.measurement.recordings[name]
    steps = np.diff(recording.times)
    near = np.flatnonzero(steps < 1.5 * np.min(steps))
    between = recording.times[near] + _PART * steps[near]
    order = np.argsort(times := np.append(recording.times, between), kind="stable")
    seen = np.empty((len(points), len(times), len(recording.channels)))
    seen[:, order] = model.observe(points, name, times[order])
    size = np.nanstd(recording.values, axis=0)
    seen, count = seen / np.where(size > 0.0, size, 1.0), len(recording.times)
    line = seen[:, near] + _PART * (seen[:, near + 1] - seen[:, near])
    first, straight, there = (part.reshape(len(points), -1) for part in (seen[:, near], line, seen[:, count:]))
    return first, straight, there


def within(model: ForwardModel, point: Array, parameters: Mapping[str, Value]) -> bool:
    """Return whether intervals that are wide for the mesh's own error, more than for noise, include a point already."""
    if not any(value.correction is not None and abs(value.correction) > value.std for value in parameters.values()):
        return False
    values = zip(model.names, model.parameters.to_values(point), strict=True)
    return all(parameters[name].lower <= value <= parameters[name].upper for name, value in values)


def same_at_samples(model: ForwardModel, one: Array, other: Array) -> bool:
    """Return whether two motions that fit alike at the samples are apart between them: by whole turns or swings."""
    aside = model.aside()
    for name in model.measurement.recordings:
        at, _, between = between_samples(aside, np.array([one, other]), name)
        off, apart_by = (float(np.mean((seen[1] - seen[0]) ** 2)) for seen in (at, between))
        if apart_by > max(_BETWEEN * off, _SEEN):
            return True
    return False


def relation(model: ForwardModel, one: Array, other: Array) -> str:
    """Relation of another solution to the first: a mirror image, another clock or camera, or just different."""
    if same_at_samples(model, one, other):
        return ALIAS
    changed = np.flatnonzero(differing(model, one, other))
    if np.all(model.parameters.initial[changed]):
        return "mirror images: the same marker positions with another pose"
    entries = list(model.parameters.entries.values())
    if all(entries[k].parameter.of_measurement for k in changed):
        return "one machine, recorded in different ways"
    if not np.any(differing(model, np.abs(one), np.abs(other))):
        return "mirror images: parameters with the opposite sign"
    return "different machines"
