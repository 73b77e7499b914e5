"""Pictures as bytes, drawn in the worker processes: each function is called there by its name."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure
from shoal.engines.compare import Comparison
from shoal.identification import Measurement

from shoal_flows.figures import titles
from shoal_flows.figures.convergence import convergence
from shoal_flows.figures.engines import engines
from shoal_flows.figures.mesh_error import mesh_error
from shoal_flows.figures.residuals import residuals
from shoal_flows.figures.style import png, svg
from shoal_flows.figures.trajectory import trajectory
from shoal_flows.jobs import Cell, Fit, fit

Picture = tuple[bytes, bytes]
"""The same picture as PNG and as SVG."""


def fitted(cell: Cell, measurement: Measurement) -> tuple[Fit, bytes]:
    """One optimisation and its picture as PNG."""
    found = fit(cell, measurement)
    return found, png(trajectory(found, f"{cell.problem}: {cell.name}, RMS {found.estimate.rms:.2e}"))


def draw_trajectory(fits: Sequence[Fit], name: str) -> Picture:
    """The model of the best fit over the data."""
    return _both(trajectory(titles.best(fits), titles.follows(name, fits)))


def draw_convergence(fits: Sequence[Fit], name: str) -> Picture:
    """Fitness against evaluations."""
    return _both(convergence(fits, titles.pays(name, fits)))


def draw_residuals(fits: Sequence[Fit], name: str) -> Picture:
    """What each method leaves."""
    return _both(residuals(fits, titles.leaves(name, fits)))


def draw_mesh_error(fits: Sequence[Fit], name: str) -> Picture:
    """Error against mesh."""
    return _both(mesh_error(fits, titles.refines(name, fits)))


def draw_engines(comparison: Comparison, marker: str) -> Picture:
    """The engines over each other."""
    return _both(engines(comparison, marker, titles.agrees(comparison, marker)))


def _both(figure: Figure) -> Picture:
    return png(figure), svg(figure)
