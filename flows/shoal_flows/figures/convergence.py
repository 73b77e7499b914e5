"""Fitness against counted evaluations: what each method pays for what it finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from shoal_flows.figures.style import GREY, METHODS, OTHER, canvas, log_ticks, styled
from shoal_flows.jobs import Fit


@styled
def convergence(fits: Sequence[Fit], title: str) -> Figure:
    """Best fitness so far over the evaluations, both logarithmic; a marker stands where a method ended."""
    figure, axes = canvas(4.6)
    for fit in fits:
        style = METHODS.get(fit.cell.method, OTHER)
        line = {key: value for key, value in style.items() if key != "marker"}
        estimate = fit.estimate
        counted, best = estimate.history
        if len(counted):
            axes.plot(counted, best, drawstyle="steps-post", **line)
        axes.plot(
            [estimate.evaluations],
            [estimate.fitness],
            **{**style, "linestyle": "none", "markersize": 8},
            label=f"{fit.cell.method} ({estimate.evaluations})",
        )
    floor = [f.estimate.model_error_rms for f in fits if f.estimate.model_error_rms is not None]
    if floor:
        things = fits[0].estimate.measurement.first.things
        level = things * float(np.min(floor)) ** 2
        axes.axhline(level, color=GREY, linewidth=1, linestyle=(0, (1, 2)))
        axes.annotate("mesh error of the model", (1, level), (0, -4), textcoords="offset points", va="top", color=GREY)
        axes.set_ylim(bottom=level / 6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    # Room for the legend above the lines.
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 1e3)
    log_ticks(axes)
    axes.set_title(title)
    axes.set_xlabel("model evaluations, every one counted")
    axes.set_ylabel("best fitness so far [m²]")
    axes.legend(title="method (evaluations)", loc="upper right")
    return figure
