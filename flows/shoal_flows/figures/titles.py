"""What a picture says, in its title: sentences from the numbers that it shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shoal.engines.compare import Comparison

from shoal_flows.jobs import Fit

_AS_GOOD = 1.01
"""A fitness within this factor of the best is as good as the best."""


def best(fits: Sequence[Fit]) -> Fit:
    """The first of the fits that is as good as the best."""
    lowest = min(f.estimate.fitness for f in fits)
    return next(f for f in fits if f.estimate.fitness <= _AS_GOOD * lowest)


def pays(name: str, fits: Sequence[Fit]) -> str:
    """How many runs the cheapest and the dearest of the good methods need."""
    level = _AS_GOOD * min(f.estimate.fitness for f in fits)
    good = sorted((f.estimate.evaluations, f.cell.method) for f in fits if f.estimate.fitness <= level)
    if len(good) < 2:
        return f"{name}: {good[0][1]} needs {good[0][0]} runs of the model"
    return f"{name}: {good[0][1]} needs {good[0][0]} runs, {good[-1][1]} {good[-1][0]}"


def leaves(name: str, fits: Sequence[Fit]) -> str:
    """Who found the minimum and who did not."""
    level = _AS_GOOD * min(f.estimate.fitness for f in fits)
    short = [f.cell.method for f in fits if f.estimate.fitness > level]
    if not short:
        return f"{name}: every method leaves the same remainder"
    return f"{name}: {' and '.join(short)} did not reach the best fit"


def follows(name: str, fits: Sequence[Fit]) -> str:
    """How closely the best fit follows the data."""
    unit = "mrad" if all(c.quantity == "angle" for c in fits[0].estimate.measurement.first.channels) else "mm"
    return f"{name}: the fitted model follows the data to {1e3 * best(fits).estimate.rms:.2g} {unit} (RMS)"


def refines(name: str, fits: Sequence[Fit]) -> str:
    """What the finest mesh gains on the coarsest."""
    first, last = (_error(fits[k]) for k in (0, -1))
    return f"{name}: {fits[0].cell.name} is off by {first:.2g}°, {fits[-1].cell.name} by {last:.1g}°"


def agrees(comparison: Comparison, marker: str) -> str:
    """How far apart the engines come out at a marker."""
    found = [row["largest"] for row in comparison.differences() if row["marker"] == marker]
    if not found or None in found:
        return f"{comparison.scene.name}: {marker} by each engine"
    return f"{len(comparison.trajectories)} engines place {marker} within {1e6 * max(found):.2g} µm of each other"


def _error(fit: Fit) -> float:
    estimate = fit.estimate
    return float(np.degrees(max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())))
