"""Gap between outer and attained bounds over time, with the errors of mesh and step."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.instants import curve, time_axis
from shoal.pictures.style import GREY, LINES, VERMILION, canvas, headline, log_ticks, styled
from shoal.response import Response
from shoal.response.enclosure import Bounds
from shoal.response.study import Ends
from shoal.trajectory import Array

LEAST = 1e-12
"""[m] Below this, nothing is drawn."""


@styled
def gaps(found: Response, marker: str) -> Figure:
    """Width of the attained bounds and distance of the outer ones [m], of one marker; found: of intervals.

    Beside distributions, the scatter and the distance of the outer bounds of the mean.
    """
    what, width, beyond = _known(found)
    figure, panel = canvas()
    t, within = found.times, found.times <= found.horizon
    largest = list[float]()
    for look, quantity in zip(LINES, found.axes, strict=False):
        wide, gap = (found.column(marker, quantity, of) for of in (width, beyond))
        curve(panel, t, np.maximum(wide, LEAST), label=f"{what} of {quantity}", **look)
        curve(panel, t, np.where(within, np.maximum(gap, LEAST), np.nan), alpha=0.5, label=f"gap of {quantity}", **look)
        if within.any():
            beyond_runs = gap + found.column(marker, quantity, found.model)
            largest.append(float(beyond_runs[within].max()) / max(float(wide.max()), LEAST))
    if found.errors.total:
        panel.axhline(found.errors.total, color=VERMILION, linestyle=":", label="known error of the model")
    if not within.all():
        panel.axvline(found.horizon, color=GREY, linestyle=":", label="horizon")
    panel.set_yscale("log")
    log_ticks(panel)
    time_axis(panel, found.times)
    panel.set_ylabel(f"at {marker} [m]")
    panel.legend(fontsize=10, ncols=2)
    off = float(np.max(largest)) if largest else math.nan
    known = "are not known to be complete" if np.isnan(off) else f"are known to {off:.1e} of the {what}"
    told = "bounds" if found.boxes is None else "bounds of the mean"
    headline(figure, f"{found.scene}: {told} of {marker} {known}")
    return figure


def _known(found: Response) -> tuple[str, Array, Array]:
    """Return the name and size of the reference of the gap, and the distance of the outer bounds, (columns,) each."""
    bounds: Bounds | Ends
    if found.boxes is None:
        assert found.bounds is not None
        what, bounds = "width", found.bounds
        size = bounds.upper - bounds.lower
    else:
        what, bounds = "scatter", found.boxes.mean
        size = bounds.upper - bounds.lower + found.boxes.std.upper
    gap = np.maximum(bounds.lower - bounds.lower_outer, bounds.upper_outer - bounds.upper) - found.model
    return what, size, np.maximum(gap, 0.0)
