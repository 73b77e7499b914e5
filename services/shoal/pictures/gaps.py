"""How well bounds are known over time, beside what mesh and step are off by."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.style import GREY, LINES, ORANGE, VERMILION, canvas, headline, log_ticks, styled
from shoal.response import Response

LEAST = 1e-12
"""[m] Below this, nothing is drawn."""


@styled
def gaps(found: Response, marker: str) -> Figure:
    """Width of the attained bounds and distance of the outer ones [m], of one marker; found: of intervals."""
    assert found.bounds is not None
    bounds = found.bounds
    figure, panel = canvas()
    beyond = np.maximum(bounds.lower - bounds.lower_outer, bounds.upper_outer - bounds.upper)
    within = found.times <= found.horizon
    for look, quantity in zip(LINES, found.axes, strict=False):
        width = found.column(marker, quantity, bounds.upper - bounds.lower)
        gap = found.column(marker, quantity, beyond)
        panel.plot(found.times, np.maximum(width, LEAST), label=f"width of {quantity}", **look)
        panel.plot(found.times[within], np.maximum(gap[within], LEAST), alpha=0.5, label=f"gap of {quantity}", **look)
    for error, name, colour in ((found.mesh_error, "mesh error", VERMILION), (found.step_error, "step error", ORANGE)):
        if error:
            panel.axhline(error, color=colour, linestyle=":", label=name)
    if not within.all():
        panel.axvline(found.horizon, color=GREY, linestyle=":", label="horizon")
    panel.set_yscale("log")
    log_ticks(panel)
    panel.set_xlabel("time [s]")
    panel.set_ylabel(f"at {marker} [m]")
    panel.legend(fontsize=10, ncols=2)
    off = float(np.max([found.gap(marker, quantity) for quantity in found.axes]))
    known = "are not known to be complete" if np.isnan(off) else f"are known to {off:.1e} of the width"
    headline(figure, f"{found.scene}: bounds of {marker} {known}")
    return figure
