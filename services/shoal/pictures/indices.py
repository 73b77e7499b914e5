"""Which parameters a marker's scatter is owed to, over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.style import LINES, canvas, headline, styled
from shoal.response import Response

MOST = 6
"""Parameters that are drawn, those with the largest shares."""


@styled
def indices(found: Response, marker: str) -> Figure:
    """Total Sobol indices of the coordinates of one marker; found: of random parameters."""
    assert found.statistics is not None
    figure, axes = canvas(2.2 + 2.0 * len(found.axes), nrows=len(found.axes), sharex=True)
    total = {quantity: found.column(marker, quantity, found.statistics.total) for quantity in found.axes}
    largest = np.max([np.nan_to_num(of).max(axis=1) for of in total.values()], axis=0)
    shown = sorted(np.argsort(-largest, kind="stable")[:MOST].tolist())
    for panel, (quantity, of) in zip(axes, total.items(), strict=True):
        for look, k in zip(LINES, shown, strict=False):
            panel.plot(found.times, of[k], label=found.inputs.names[k], **look)
        panel.set_ylim(-0.03, 1.05)
        panel.set_ylabel(f"share of {quantity} of {marker}")
    axes[0].legend(fontsize=10)
    axes[-1].set_xlabel("time [s]")
    first = found.inputs.names[int(np.argmax(largest))]
    headline(figure, f"{found.scene}: {marker} scatters most by {first} (total Sobol indices)")
    return figure
