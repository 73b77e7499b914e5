"""The fitted model over the measured motion."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.numbers import handy
from shoal.pictures.signals import LONG, FittedSignal, gaps, signals, worst
from shoal.pictures.style import BLACK, SKY, VERMILION, canvas, headline, styled

_PANELS = 6
_MANY = 150
"""From so many samples on, circles run together: then they are a band that the line lies in."""


@styled
def overlay(estimate: Estimate, title: str = "") -> Figure:
    """Each channel against time: circles (a pale band) are measured, the line is the model, gaps in the data are grey.

    At most six panels: the channels that fit worst.
    """
    found = signals(estimate)
    shown = worst(found, _PANELS)
    figure, axes = canvas(1.5 + 1.6 * len(shown), nrows=len(shown), squeeze=False)
    one_clock = len({signal.recording for signal in shown}) == 1
    for panel, signal in zip(axes[:, 0], shown, strict=True):
        _draw(panel, signal, "not fitted" if estimate.prediction else "no data")
        if not (one_clock and panel is not axes[-1, 0]):
            panel.set_xlabel("time [s]")
        else:
            panel.tick_params(labelbottom=False)
    first = axes[0, 0]
    headline(figure, title or f"{estimate.problem}: {follows(estimate)}")
    figure.align_ylabels()
    handles, labels = first.get_legend_handles_labels()
    note = f"worst {len(shown)} of {len(found)} channels" if len(shown) < len(found) else None
    figure.legend(handles, labels, loc="outside lower left", ncols=len(labels), title=note)
    return figure


def follows(estimate: Estimate) -> str:
    """Describe how closely the fit follows the data."""
    sizes: dict[str, list[float]] = {}
    for signal in signals(estimate):
        sizes.setdefault(signal.unit, []).append(signal.rms)
    parts = []
    for unit, values in sizes.items():
        size = float(np.sqrt(np.mean(np.square(values))))
        factor, handier = handy(size, unit)
        parts.append(f"{factor * size:.2g} {handier}")
    how = "follows the data to" if estimate.verdict.trusted else "is off the data by"
    return f"the model {how} {' and '.join(parts)} (RMS)"


def _draw(panel: Axes, signal: FittedSignal, gap: str) -> None:
    many = len(signal.times) > _MANY
    for k, (begin, end) in enumerate(gaps(signal)):
        panel.axvspan(begin, end, color="#EEEEEE", zorder=0, label=gap if k == 0 else None)
    panel.plot(
        signal.times,
        signal.measured,
        linestyle="none",
        marker="o",
        markersize=6 if many else 5,
        markeredgewidth=0 if many else 1,
        markerfacecolor=SKY if many else "none",
        color=SKY if many else BLACK,
        label="measured",
    )
    # Across a gap a chord would pass for the model.
    after = 1 + np.flatnonzero(np.diff(signal.times) > LONG * np.median(np.diff(signal.times)))
    model = (np.insert(values, after, np.nan) for values in (signal.times, signal.fitted))
    panel.plot(*model, color=VERMILION, linewidth=1.4, label="fitted model")
    panel.set_ylabel(f"{signal.name}\n[{signal.unit}]")
