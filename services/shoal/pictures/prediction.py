"""Held-out data: measured and predicted, and the error within the predicted band."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.identification.recording.units import of_channel
from shoal.identification.uncertainty.prediction import Prediction
from shoal.pictures.numbers import handy
from shoal.pictures.style import BLACK, ORANGE, VERMILION, canvas, headline, styled

_PANELS = 6


@styled
def prediction(estimate: Estimate) -> Figure:
    """Left, samples that were not fitted, the model and its band; right, model minus measurement in the same band.

    At most six channels, those that leave their band the farthest.
    """
    found = [(one, k) for one in estimate.prediction for k in range(one.measured.shape[1])]
    shown = sorted(sorted(range(len(found)), key=lambda n: -_misfit(*found[n]))[:_PANELS])
    figure, axes = canvas(1.9 + 1.8 * len(shown), ncols=2, nrows=len(shown), squeeze=False)
    for row, number in zip(axes, shown, strict=True):
        one, k = found[number]
        channel = estimate.measurement.recordings[one.recording].channels[k]
        several = len(estimate.measurement.recordings) > 1
        name = f"{one.recording}: " * several + channel.name
        _signal(row[0], one, k, f"{name}\n[{of_channel(channel)}]")
        _error(row[1], one, k, of_channel(channel))
    for panel in axes[-1]:
        panel.set_xlabel("time [s]")
    headline(figure, f"{estimate.problem}: {told(estimate)}")
    figure.align_ylabels()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=len(labels))
    return figure


def told(estimate: Estimate) -> str:
    """Describe how many windows agree with their prediction."""
    inside = [one.inside for one in estimate.prediction]
    if len(inside) == 1:
        kinds = {True: "is predicted as stated", False: "is predicted worse than stated", None: "has no stated error"}
        return f"the window that was held out {kinds[inside[0]]}"
    unknown = f", {inside.count(None)} without a stated error" if None in inside else ""
    return f"{inside.count(True)} of {len(inside)} windows that were held out are predicted as stated{unknown}"


def _misfit(one: Prediction, k: int) -> float:
    error = np.abs(one.predicted[:, k] - one.measured[:, k])
    known = np.isfinite(error)
    if not np.any(known):
        return -1.0
    half = one.half[known, k]
    size = float(np.mean(half)) if np.all(np.isfinite(half)) else float(np.std(one.measured[known, k]))
    return float(np.mean(error[known])) / max(size, 1e-300)


def _signal(panel: Axes, one: Prediction, k: int, label: str) -> None:
    predicted, half = one.predicted[:, k], one.half[:, k]
    panel.fill_between(
        one.times, predicted - half, predicted + half, color=ORANGE, alpha=0.3, linewidth=0, label="95 % band"
    )
    panel.plot(one.times, one.measured[:, k], ".", color=BLACK, markersize=3, label="measured, not fitted")
    panel.plot(one.times, predicted, color=VERMILION, linewidth=1.4, label="predicted")
    panel.set_ylabel(label)


def _error(panel: Axes, one: Prediction, k: int, unit: str) -> None:
    error, half = one.predicted[:, k] - one.measured[:, k], one.half[:, k]
    sizes = np.abs(np.concatenate([error, half]))
    factor, handier = handy(float(np.max(sizes[np.isfinite(sizes)], initial=0.0)), unit)
    panel.fill_between(one.times, -factor * half, factor * half, color=ORANGE, alpha=0.3, linewidth=0)
    panel.plot(one.times, factor * error, ".", color=BLACK, markersize=3)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.margins(y=0.25)
    panel.set_ylabel(f"error [{handier}]")
