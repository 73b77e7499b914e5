"""Bode's diagram of a linear model: amplitude and phase of every output for every input, over the frequency.

Of an open loop Nyquist's diagram as well.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.mechanics.linear_model import LinearModel
from shoal.pictures.style import canvas, headline, styled

DECADES = 1.5
"""Decades beyond the slowest and the fastest pole that are drawn."""
POINTS = 800
NEAR = 3.0
"""Half the width of Nyquist's diagram, in which the point -1 and the circle of gain 1 are seen."""


@styled
def bode(found: LinearModel) -> Figure:
    """Amplitudes [dB] and phases [degrees] over the frequency [Hz]."""
    if found.margins is None:
        figure, (amplitude, phase) = canvas(5.4, nrows=2, sharex=True)
    else:
        figure, ((amplitude, nyquist), (phase, below)) = canvas(5.4, nrows=2, ncols=2)
        amplitude.sharex(phase)
        below.remove()
        nyquist.set_subplotspec(nyquist.get_gridspec()[:, 1])
    sizes = np.abs(found.poles[np.abs(found.poles) > 0.0]) / (2 * np.pi)
    low, high = (float(np.log10(part)) for part in ((min(sizes), max(sizes)) if len(sizes) else (1.0, 1.0)))
    frequencies = np.logspace(low - DECADES, high + DECADES, POINTS)
    answer = found.response(2 * np.pi * frequencies)
    for i, output in enumerate(found.outputs):
        for k, given in enumerate(found.inputs):
            size = np.abs(answer[:, i, k])
            if not np.any(size > 0.0):
                continue
            label = f"{output} by {given}"
            amplitude.plot(frequencies, 20.0 * np.log10(np.maximum(size, 1e-300)), label=label)
            phase.plot(frequencies, np.degrees(np.unwrap(np.angle(answer[:, i, k]))), label=label)
    if found.margins is not None:
        _nyquist(nyquist, answer[:, 0, 0])
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


def _nyquist(axes: Axes, answer: npt.NDArray[np.complex128]) -> None:
    """Draw an open loop in the complex plane, for positive and, dashed, negative frequencies, near the point -1."""
    axes.plot(answer.real, answer.imag)
    axes.plot(answer.real, -answer.imag, linestyle="--", alpha=0.5)
    around = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(around), np.sin(around), color="0.7", linewidth=0.8)
    axes.plot([-1.0], [0.0], marker="+", color="black")
    axes.set_xlim(-NEAR, NEAR)
    axes.set_ylim(-NEAR, NEAR)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
