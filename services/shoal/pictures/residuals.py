"""Residuals of each channel: against the noise, and their autocorrelation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.numbers import handy
from shoal.pictures.signals import FittedSignal, signals, worst
from shoal.pictures.style import BLACK, BLUE, ORANGE, canvas, headline, styled
from shoal.trajectory import Array

_PANELS = 4
_LAGS = 40
NORMAL_95 = 1.96


@styled
def residuals(estimate: Estimate) -> Figure:
    """Left, model minus measurement with the band that holds 95 % of the noise; right, its autocorrelation with the
    band that holds 95 % of the autocorrelations of white noise (Bartlett 1946). At most four channels, the worst.
    """
    shown = worst(signals(estimate), _PANELS)
    figure, axes = canvas(1.9 + 1.8 * len(shown), ncols=2, nrows=len(shown), squeeze=False, width_ratios=[1.7, 1])
    for (left, right), signal in zip(axes, shown, strict=True):
        _against_time(left, signal)
        _against_lag(right, signal)
    axes[-1, 0].set_xlabel("time [s]")
    axes[-1, 1].set_xlabel("lag [samples]")
    headline(figure, f"{estimate.problem}: {white(estimate)}")
    figure.align_ylabels()
    bands = [band for panel in axes[0] for band in panel.get_legend_handles_labels()[0]]
    figure.legend(handles=bands, loc="outside lower left", ncols=1)
    return figure


def autocorrelation(residual: Array, most: int = _LAGS) -> Array:
    """Autocorrelation at the lags 0, 1, ..., (lags,), of a residual with gaps (nan), about its mean."""
    centred = residual - np.nanmean(residual)
    known = np.isfinite(centred)
    filled = np.where(known, centred, 0.0)
    count = min(most, max(1, int(known.sum()) // 4))
    power = float(filled @ filled) / max(1, int(known.sum()))
    found = np.ones(count + 1)
    for lag in range(1, count + 1):
        pairs = int(np.sum(known[lag:] & known[:-lag]))
        found[lag] = filled[lag:] @ filled[:-lag] / max(pairs, 1) / power if power > 0 else 0.0
    return found


def white(estimate: Estimate) -> str:
    """Describe the verdict's tests of the residuals' correlation, and how many lags lie outside the band."""
    counts = [_outside(signal) for signal in signals(estimate)]
    outside, lags = sum(o for o, _ in counts), sum(n for _, n in counts)
    tests = estimate.residual_tests
    found = tests.correlation if tests.made else "not tested"
    return f"correlation of the residuals: {found} ({100 * outside / max(lags, 1):.0f} % of lags outside the band)"


def _outside(signal: FittedSignal) -> tuple[int, int]:
    found = autocorrelation(signal.residual)[1:]
    return int(np.sum(np.abs(found) > _band(signal))), len(found)


def _band(signal: FittedSignal) -> float:
    return NORMAL_95 / float(np.sqrt(max(1, np.isfinite(signal.residual).sum())))


def _against_time(panel: Axes, signal: FittedSignal) -> None:
    known = signal.residual[np.isfinite(signal.residual)]
    factor, unit = handy(float(np.max(np.abs(known), initial=0.0)), signal.unit)
    if np.isfinite(signal.noise):
        half = factor * NORMAL_95 * signal.noise
        source = "stated" if signal.stated else "by differences"
        panel.axhspan(-half, half, color=ORANGE, alpha=0.3, linewidth=0, label=f"left: 95 % of the noise, {source}")
    panel.plot(signal.times, factor * signal.residual, ".", color=BLACK, markersize=3)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.margins(y=0.25)
    panel.set_ylabel(f"{signal.name}\n[{unit}]")


def _against_lag(panel: Axes, signal: FittedSignal) -> None:
    found = autocorrelation(signal.residual)
    lags = np.arange(1, len(found))
    panel.axhspan(
        -_band(signal), _band(signal), color=ORANGE, alpha=0.3, linewidth=0, label="right: 95 % of white noise"
    )
    panel.vlines(lags, 0.0, found[1:], color=BLUE, linewidth=1.5)
    panel.plot(lags, found[1:], "o", color=BLUE, markersize=3)
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_ylim(-1.05, 1.05)
    panel.set_ylabel("autocorrelation")
