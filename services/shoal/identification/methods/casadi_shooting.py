"""CasADi's direct single shooting with exact derivatives: the inverse baseline of another engine."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.outcome import Outcome
from shoal.identification.recording import Clocked
from shoal.identification.starts import starting_points


def casadi(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IPOPT on CasADi's own model, from the better start; initial angles and rates from one marker's position only."""
    from shoal.engines.casadi_shooting import identify_initial_angles

    entries = model.parameters.entries.values()
    paths = [entry.parameter.path or "" for entry in entries]
    recording = model.measurement.first
    channels = recording.channels
    if len(model.measurement.recordings) > 1 or model.problem.ties or recording.stated != Clocked():
        raise InputError("method: casadi takes one recording without ties, clock and camera; use least-squares")
    markers = {c.marker for c in channels}
    if not all(path.startswith("initial.") for path in paths) or np.any(model.parameters.logarithmic):
        raise InputError("method: casadi finds initial angles and rates only; use least-squares for other parameters")
    if not np.all(np.isfinite(recording.values)):
        raise InputError("method: casadi takes no gaps; use least-squares")
    if len(markers) != 1 or [c.quantity for c in channels] != ["x", "y"]:
        raise InputError("method: casadi takes x and y of one marker; use least-squares for other channels")
    starts = starting_points(model)
    # Shooting from a wrong elbow branch ends in a false minimum: one run of each start tells which is right.
    start = starts[int(np.argmin(model.fitness(starts)))]
    result = identify_initial_angles(
        model.scene,
        paths,
        start,
        model.lower,
        model.upper,
        recording.times,
        channels[0].marker,
        recording.values,
    )
    fitness = float(result.fitness)
    model.counter.charge(result.evaluations, np.asarray(result.values), fitness)
    progress(result.iterations, fitness, fitness)
    return Outcome(np.asarray(result.values), fitness, [(result.iterations, fitness, fitness)], result.message)
