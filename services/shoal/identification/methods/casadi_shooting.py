"""CasADi's direct single shooting with exact derivatives: the inverse baseline of another engine."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points
from shoal.trajectory import Array


def casadi(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IPOPT on CasADi's own model, from every start; initial angles and rates from one marker's position only."""
    from shoal.engines.casadi_shooting import identify_initial_angles

    paths = [p.path for p in model.problem.parameters.values()]
    channels = model.measurement.channels
    markers = {c.marker for c in channels}
    if not all(path.startswith("initial.") for path in paths):
        raise InputError("method: casadi finds initial angles and rates only; use least-squares for other parameters")
    if len(markers) != 1 or [c.quantity for c in channels] != ["x", "y"]:
        raise InputError("method: casadi takes x and y of one marker; use least-squares for other channels")
    rows: list[tuple[int, float, float]] = []
    ends: list[tuple[Array, float, str]] = []
    for start in starting_points(model):
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
        model.counter.evaluations += result.evaluations
        ends.append((np.asarray(result.values), float(result.fitness), result.message))
        rows.append((len(rows), min(end[1] for end in ends), float(result.fitness)))
        progress(*rows[-1])
    point, fitness, message = min(ends, key=lambda end: end[1])
    return Outcome(point, fitness, rows, message, [(p, f) for p, f, _ in ends if p is not point])
