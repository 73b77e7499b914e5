"""Residuals of each method."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.signals import residuals
from shoal.pictures.style import METHODS, OTHER, canvas, headline, log_ticks, styled

_PANELS = 4


@styled
def remainders(estimates: Mapping[str, Estimate], title: str) -> Figure:
    """Size of model minus measurement against time, a panel per recording (at most four); methods that coincide lie
    on one line. A sample without any value shows as a gap.
    """
    first = next(iter(estimates.values()))
    recordings = dict(list(first.measurement.recordings.items())[:_PANELS])
    several = len({estimate.method for estimate in estimates.values()}) < len(estimates)
    figure, axes = canvas(2.2 + 2.0 * len(recordings), nrows=len(recordings), squeeze=False)
    for panel, (name, recording) in zip(axes[:, 0], recordings.items(), strict=True):
        lengths = all(channel.is_position for channel in recording.channels)
        for k, (key, estimate) in enumerate(estimates.items()):
            # Marks of lines that coincide stand beside each other.
            style = {**METHODS.get(estimate.method, OTHER), "markersize": 6, "markevery": (0.03 * k, 0.15)}
            off = residuals(estimate)[name]
            size = np.where(np.any(np.isfinite(off), axis=1), np.sqrt(np.nansum(off**2, axis=1)), np.nan)
            panel.plot(recording.times, 1e3 * size, label=key if several else estimate.method, **style)
        panel.set_yscale("log")
        log_ticks(panel)
        where = f"{name}: " if len(first.measurement.recordings) > 1 else ""
        panel.set_ylabel(f"{where}distance of model\nand data [{'mm' if lengths else '1e-3 SI units'}]")
    headline(figure, title)
    axes[-1, 0].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
    return figure
