"""Sobol indices of a marker over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.instants import band, curve, time_axis
from shoal.pictures.style import LINES, canvas, headline, styled
from shoal.response import Response
from shoal.trajectory import Array

MOST = 6
"""Parameters that are drawn, those with the largest shares."""


@styled
def indices(found: Response, marker: str) -> Figure:
    """Total Sobol indices of the coordinates of one marker; found: of random parameters.

    Beside intervals, from the least to the largest.
    """
    names, low, high = _totals(found)
    figure, axes = canvas(2.2 + 2.0 * len(found.axes), nrows=len(found.axes), sharex=True)
    t = found.times
    ends = {axis: [found.column(marker, axis, of) for of in (low, high)] for axis in found.axes}
    largest = np.max([np.nan_to_num(of).max(axis=1) for _, of in ends.values()], axis=0)
    shown = sorted(np.argsort(-largest, kind="stable")[:MOST].tolist())
    for panel, (quantity, (least, most)) in zip(axes, ends.items(), strict=True):
        for look, k in zip(LINES, shown, strict=False):
            curve(panel, t, most[k], label=names[k], **look)
            if found.boxes is not None:
                curve(panel, t, least[k], **look)
                band(panel, t, least[k], most[k], color=look["color"], alpha=0.2, linewidth=0)
        panel.set_ylim(-0.03, 1.05)
        panel.set_ylabel(f"share of {quantity} of {marker}")
    axes[0].legend(fontsize=10)
    time_axis(axes[-1], found.times)
    first = names[int(np.argmax(largest))]
    which = "total Sobol indices" + ("" if found.boxes is None else ", between bounds")
    headline(figure, f"{found.scene}: {marker} scatters most by {first} ({which})")
    return figure


def _totals(found: Response) -> tuple[list[str], Array, Array]:
    """Random parameters, and their least and largest indices, (parameters, columns)."""
    if found.boxes is None:
        assert found.statistics is not None
        return found.inputs.names, found.statistics.total, found.statistics.total
    assert found.boxes.shares is not None
    return found.random, *found.boxes.shares[1]
