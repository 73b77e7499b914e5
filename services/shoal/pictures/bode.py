"""Bode's diagram of a linear model: amplitude and phase of every output for every input, over the frequency."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.mechanics.linear_model import LinearModel
from shoal.pictures.style import canvas, headline, styled

DECADES = 1.5
"""Decades beyond the slowest and the fastest pole that are drawn."""
POINTS = 800


@styled
def bode(found: LinearModel) -> Figure:
    """Amplitudes [dB] and phases [degrees] over the frequency [Hz]."""
    figure, axes = canvas(5.4, nrows=2, sharex=True)
    sizes = np.abs(found.poles[np.abs(found.poles) > 0.0]) / (2 * np.pi)
    low, high = (float(np.log10(part)) for part in ((min(sizes), max(sizes)) if len(sizes) else (1.0, 1.0)))
    frequencies = np.logspace(low - DECADES, high + DECADES, POINTS)
    answer = found.response(2 * np.pi * frequencies)
    amplitude, phase = axes
    for i, output in enumerate(found.outputs):
        for k, given in enumerate(found.inputs):
            size = np.abs(answer[:, i, k])
            if not np.any(size > 0.0):
                continue
            label = f"{output} by {given}"
            amplitude.plot(frequencies, 20.0 * np.log10(np.maximum(size, 1e-300)), label=label)
            phase.plot(frequencies, np.degrees(np.unwrap(np.angle(answer[:, i, k]))), label=label)
    phase.set_xscale("log")
    amplitude.set_ylabel("amplitude [dB]")
    phase.set_ylabel("phase [degrees]")
    phase.set_xlabel("frequency [Hz]")
    amplitude.legend()
    headline(
        figure,
        f"{found.scene.name}: linear model about the {found.about}" + (f"; {found.message}" if found.message else ""),
    )
    return figure
