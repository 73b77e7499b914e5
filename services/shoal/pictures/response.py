"""Uncertain positions of a marker over time: the band between its bounds, or the fan of its quantiles."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.pictures.instants import FEW, band, curve, time_axis
from shoal.pictures.numbers import length, looked_at
from shoal.pictures.style import BLUE, GREY, ORANGE, canvas, headline, styled
from shoal.response import Response
from shoal.trajectory import Array

FANS = ((0, -1, 0.2), (1, -2, 0.3), (2, -3, 0.4))
"""Pairs of quantiles, from the widest, and how dark what lies between them is."""


@styled
def response(found: Response, marker: str) -> Figure:
    """The coordinates of one marker."""
    figure, axes = canvas(2.2 + 2.2 * len(found.axes), nrows=len(found.axes), sharex=True)
    widest = 0.0
    for panel, quantity in zip(axes, found.axes, strict=True):
        widest = max(widest, _panel(panel, found, marker, quantity))
    axes[0].legend()
    time_axis(axes[-1], found.times)
    says = (
        "places of {0} are {1} apart at most, as attained by runs"
        if found.bounds is not None
        else "over all interval values, {0} scatters with a standard deviation of {1} at most"
        if found.boxes is not None
        else "{0} scatters with a standard deviation of {1} at most"
    )
    when = f", {looked_at(found.times)}" if len(found.times) <= FEW else ""
    when += f"; known error {length(found.errors.total)}" if found.errors.estimates else ""
    trust = "" if found.ok else f" ({found.status}: see the message)"
    headline(figure, f"{found.scene}: {says.format(marker, length(widest))}{when}{trust}")
    return figure


def _panel(panel: Axes, found: Response, marker: str, quantity: str) -> float:
    """One coordinate; the largest width or deviation [m]."""
    t = found.times

    def column(of: Array) -> Array:
        return found.column(marker, quantity, of)

    if found.bounds is not None:
        lower, upper, low, high = (
            column(of)
            for of in (found.bounds.lower, found.bounds.upper, found.bounds.lower_outer, found.bounds.upper_outer)
        )
        band(panel, t, lower, upper, color=BLUE, alpha=0.35, label="attained by runs")
        within = t <= found.horizon
        for outer, label in ((low, "outer bounds"), (high, None)):
            curve(panel, t, np.where(within, outer, np.nan), color=ORANGE, linestyle="--", markersize=4, label=label)
        if not within.all():
            panel.axvline(found.horizon, color=GREY, linestyle=":", label="horizon")
        widest = float(np.max(upper - lower))
    elif found.boxes is not None:
        mean, levels = found.boxes.mean, found.boxes.quantiles
        low, high = (column(of) for of in (levels[1].widest[0], levels[-2].widest[1]))
        band(panel, t, low, high, color=BLUE, alpha=0.25, linewidth=0, label="5 % and 95 % at their farthest")
        low, high = (column(of) for of in (mean.lower, mean.upper))
        band(panel, t, low, high, color=ORANGE, alpha=0.5, linewidth=1.5, label="means over the intervals")
        if found.horizon < found.times[-1]:
            panel.axvline(found.horizon, color=GREY, linestyle=":", label="horizon")
        widest = float(np.max(column(found.boxes.std.upper)))
    else:
        told = found.statistics
        assert told is not None
        quantiles = column(told.quantiles)
        for one, other, dark in FANS:
            band(panel, t, quantiles[one], quantiles[other], color=BLUE, alpha=dark, linewidth=0)
        curve(panel, t, column(told.mean), color=BLUE, label="mean; 50, 90, 98 % lie in the bands")
        widest = float(np.max(column(told.std)))
    panel.set_ylabel(f"{quantity} of {marker} [m]")
    return widest
