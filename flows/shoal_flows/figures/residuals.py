"""What each method leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from shoal_flows.figures.style import METHODS, OTHER, canvas, log_ticks, styled
from shoal_flows.jobs import Fit


@styled
def residuals(fits: Sequence[Fit], title: str) -> Figure:
    """Size of model minus measurement against time; methods that coincide lie on one line."""
    figure, axes = canvas()
    angles = all(c.quantity == "angle" for c in fits[0].estimate.measurement.first.channels)
    for fit in fits:
        style = {**METHODS.get(fit.cell.method, OTHER), "markersize": 5, "markevery": 0.12}
        size = np.linalg.norm(fit.residuals, axis=1)
        axes.plot(fit.estimate.measurement.first.times, 1e3 * size, label=fit.cell.method, **style)
    axes.set_yscale("log")
    log_ticks(axes)
    axes.set_title(title)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"distance of model and data [{'mrad' if angles else 'mm'}]")
    axes.legend(ncols=2)
    return figure
