"""Probability that a limit has been exceeded, over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.instants import FEW, band, curve, time_axis
from shoal.pictures.numbers import looked_at
from shoal.pictures.style import BLUE, VERMILION, canvas, headline, log_ticks, styled
from shoal.response.limits import LimitResult

RARE = 0.1
"""Below this probability the axis is logarithmic."""


@styled
def probability(found: LimitResult) -> Figure:
    """The first passage with its interval, on a logarithmic axis if it is rare; found: of random parameters.

    Beside intervals, the least and the largest.
    """
    figure, axes = canvas()
    estimates = found.estimates
    seen = any((one.exceeded > 0).any() for one in estimates)
    rare = seen and estimates[-1].probability < RARE
    labels = ["passed by then"] if len(estimates) == 1 else ["least probable", "most probable"]
    for estimate, label, colour in zip(estimates, labels, (BLUE, VERMILION), strict=False):
        some = (estimate.exceeded > 0) | (not rare)
        drawn = (np.where(some, of, np.nan) for of in (*estimate.interval, estimate.exceeded))
        low, high, passed = (np.broadcast_to(of, found.times.shape) for of in drawn)
        band(axes, found.times, low, high, color=colour, alpha=0.25, linewidth=0)
        if some.any():
            label = f"{label}; band: 95 % confidence"
            curve(axes, found.times, passed, color=colour, label=label)
    most = estimates[-1]
    if not seen:
        axes.text(0.5, 0.5, f"no run has passed it; {most.described}", ha="center", transform=axes.transAxes)
    if rare:
        least = min(one.probability for one in estimates if one.probability > 0)
        axes.set_yscale("log")
        axes.set_ylim(least * 1e-4, most.interval[1][-1] * 3)
        log_ticks(axes)
    if len(found.times) > FEW:
        axes.set_xlim(found.times[0], found.times[-1])
    time_axis(axes, found.times)
    axes.set_ylabel("probability")
    if seen:
        axes.legend()
    chances = " to ".join(one.described for one in estimates)
    headline(figure, f"{found.limit.excluded} happens with probability {chances}, {looked_at(found.times)}")
    return figure
