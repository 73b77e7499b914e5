"""Pictures as bytes, drawn in the worker processes: each function is called there by its name."""

from __future__ import annotations

from collections.abc import Sequence

from shoal.engines.compare import Comparison
from shoal.identification import Measurement

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
    return found, png(trajectory(found))


def draw_best(fits: Sequence[Fit], title: str) -> Picture:
    """The model of the best fit over the data."""
    figure = trajectory(min(fits, key=lambda f: f.estimate.fitness), title)
    return png(figure), svg(figure)


def draw_convergence(fits: Sequence[Fit], title: str) -> Picture:
    """Fitness against evaluations."""
    figure = convergence(fits, title)
    return png(figure), svg(figure)


def draw_residuals(fits: Sequence[Fit], title: str) -> Picture:
    """What each method leaves."""
    figure = residuals(fits, title)
    return png(figure), svg(figure)


def draw_engines(comparison: Comparison, marker: str, title: str) -> Picture:
    """The engines over each other."""
    figure = engines(comparison, marker, title)
    return png(figure), svg(figure)


def draw_mesh_error(fits: Sequence[Fit], title: str) -> Picture:
    """Error against mesh."""
    figure = mesh_error(fits, title)
    return png(figure), svg(figure)
