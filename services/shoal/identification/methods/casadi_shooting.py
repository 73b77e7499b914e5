"""CasADi's direct single shooting with exact derivatives: the inverse baseline of another engine."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points


def casadi(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IPOPT on CasADi's own model, from the better start; initial angles and rates from one marker's position only."""
    from shoal.engines.casadi_shooting import identify_initial_angles

    paths = [p.path for p in model.problem.parameters.values()]
    channels = model.measurement.channels
    markers = {c.marker for c in channels}
    if not all(path.startswith("initial.") for path in paths):
        raise InputError("method: casadi finds initial angles and rates only; use least-squares for other parameters")
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
        model.measurement.times,
        channels[0].marker,
        model.measurement.values,
    )
    fitness = float(result.fitness)
    model.counter.charge(result.evaluations, np.asarray(result.values), fitness)
    progress(result.iterations, fitness, fitness)
    return Outcome(np.asarray(result.values), fitness, [(result.iterations, fitness, fitness)], result.message)
