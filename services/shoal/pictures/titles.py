"""Titles of pictures: sentences from the numbers that they show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.engines.compare import Comparison
from shoal.error_budget import ErrorBudget
from shoal.identification import Estimate
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.numbers import length
from shoal.trajectory import Trajectory

_AS_GOOD = 1.01
"""A fitness within this factor of the best is as good as the best."""


def best(estimates: Mapping[str, Estimate]) -> Estimate:
    """The first of the estimates that is as good as the best."""
    lowest = min(e.fitness for e in estimates.values())
    return next(e for e in estimates.values() if e.fitness <= _AS_GOOD * lowest)


def pays(name: str, estimates: Mapping[str, Estimate]) -> str:
    """Return the numbers of runs of the cheapest and the dearest good method."""
    level = _AS_GOOD * min(e.fitness for e in estimates.values())
    good = sorted((e.evaluations, e.method) for e in estimates.values() if e.fitness <= level)
    if len(good) < 2:
        return f"{name}: {good[0][1]} needs {good[0][0]} runs of the model"
    return f"{name}: {good[0][1]} needs {good[0][0]} runs, {good[-1][1]} {good[-1][0]}"


def leaves(name: str, estimates: Mapping[str, Estimate]) -> str:
    """Return which methods found the minimum and which did not."""
    level = _AS_GOOD * min(e.fitness for e in estimates.values())
    short = [e.method for e in estimates.values() if e.fitness > level]
    if not short:
        return f"{name}: every method leaves the same remainder"
    return f"{name}: {' and '.join(short)} did not reach the best fit"


def refines(name: str, estimates: Mapping[str, Estimate]) -> str:
    """Return the gain of the finest mesh over the coarsest."""
    labels = list(estimates)
    first, last = (_error(estimates[labels[k]]) for k in (0, -1))
    return f"{name}: {labels[0]} is off by {first:.2g}°, {labels[-1]} by {last:.2g}°"


def ends(name: str, found: DrawnMotion, errors: ErrorBudget | None = None) -> str:
    """Return the final position of the last marker, and its known error."""
    marker, path = list(found.markers.items())[-1]
    place = f"({', '.join(f'{x:.3g}' for x in path[-1])})".replace("-", "−")
    return f"{name}: {marker} is at {place} m after {found.times[-1]:.3g} s{_known(errors)}"


def rejected(name: str, trajectory: Trajectory) -> str:
    """Return the title of a rejected run."""
    return f"{name}: not to be trusted ({trajectory.status[0]})"


def reaches(name: str, found: DrawnMotion, errors: ErrorBudget | None = None) -> str:
    """Return the range of the marker that moves most."""
    spans = {marker: np.ptp(path, axis=0) for marker, path in found.markers.items()}
    marker = max(spans, key=lambda one: float(np.max(spans[one])))
    *first, last = (f"{length(float(span))} in {axis}" for span, axis in zip(spans[marker], "xyz", strict=False))
    return f"{name}: {marker} moves within {', '.join(first)} and {last} in {found.span:.3g} s{_known(errors)}"


def _known(errors: ErrorBudget | None) -> str:
    return f"; known error {length(errors.total)}" if errors is not None and errors.estimates else ""


def agrees(comparison: Comparison, marker: str) -> str:
    """Return the distance of the engines at a marker."""
    found = [row["largest"] for row in comparison.differences() if row["marker"] == marker]
    if not found or None in found:
        return f"{comparison.scene.name}: {marker} by each engine"
    apart = f"{len(comparison.trajectories)} engines place {marker} within {length(max(found))} of each other"
    return f"{comparison.scene.name}: {apart}{_known(comparison.errors)}"


def _error(estimate: Estimate) -> float:
    return float(np.degrees(max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())))
