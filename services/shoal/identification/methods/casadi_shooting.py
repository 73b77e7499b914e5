"""CasADi's direct single and multiple shooting with exact derivatives: the inverse baselines of another engine."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from shoal.errors import InputError
from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.source import Clocked

if TYPE_CHECKING:
    from shoal.engines.casadi.shooting import ShootingResult


def casadi(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IPOPT on CasADi's own model, from the better start; initial angles and rates from one marker's position only."""
    with model.off_the_clock():  # slow to import
        from shoal.engines.casadi.shooting import identify_initial_angles

    return _shoot(model, identify_initial_angles, progress)


def casadi_multiple(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """The same with the record in segments whose first states are unknowns too, for long and chaotic motions."""
    with model.off_the_clock():  # slow to import
        from shoal.engines.casadi.multiple_shooting import identify_by_segments

    return _shoot(model, identify_by_segments, progress)


def _shoot(model: ForwardModel, search: Callable[..., ShootingResult], progress: Progress) -> Outcome:
    paths, marker = _question(model)
    recording = model.measurement.first
    starts = starting_points(model)
    # Shooting from a wrong elbow branch ends in a false minimum: one run of each start tells which is right.
    start = starts[int(np.argmin(model.fitness(starts)))]
    limit = None if model.deadline is None else model.deadline.remaining
    box = (model.lower, model.upper)
    result = search(model.scene, paths, start, *box, recording.times, marker, recording.values, limit=limit)
    model.counter.charge(result.evaluations, result.values, result.fitness)
    if result.out_of_time:
        raise TimeIsUp
    rows = [(result.iterations, result.fitness, result.fitness)]
    progress(*rows[0])
    return Outcome(result.values, result.fitness, rows, result.message)


def _question(model: ForwardModel) -> tuple[list[str], str]:
    """Paths of the parameters and the observed marker. Raises InputError for what shooting does not answer."""
    recording = model.measurement.first
    channels = recording.channels
    if len(model.measurement.recordings) > 1 or model.problem.ties or recording.stated != Clocked():
        raise InputError("method: casadi takes one recording without ties, clock and camera; use least-squares")
    if model.problem.loss != "squares" or model.parameters.priors:
        raise InputError("method: casadi takes no priors and no loss but squares; use least-squares")
    if not np.allclose(model.rows.weight, 1.0):
        raise InputError("method: casadi takes channels of equal noise; use least-squares")
    if not np.all(model.parameters.initial) or np.any(model.parameters.logarithmic):
        raise InputError("method: casadi finds initial angles and rates only; use least-squares for other parameters")
    if not np.all(np.isfinite(recording.values)):
        raise InputError("method: casadi takes no gaps; use least-squares")
    if len({c.marker for c in channels}) != 1 or [c.quantity for c in channels] != ["x", "y"]:
        raise InputError("method: casadi takes x and y of one marker; use least-squares for other channels")
    return list(model.parameters.paths), channels[0].marker
