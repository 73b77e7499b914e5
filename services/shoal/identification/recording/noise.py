"""The noise of a recording without any model: it has large differences of fourth order, motion has small ones."""

from __future__ import annotations

import numpy as np

from shoal.identification.recording.measurement import Recording
from shoal.trajectory import Array

_ORDER = 4
_QUARTILE = 0.6744897501960817
"""Median absolute deviation of a normal distribution over its standard deviation."""


def noise_of(recording: Recording) -> Array:
    """Standard deviation of the noise of each channel, (channels,): as stated, else by differences of the data.

    A smooth motion has small fourth differences, white noise has large ones: their median tells its size, and outliers
    do not change it. Motion that the sampling does not resolve counts as noise.
    """
    estimated = np.array([differences(recording.values[:, k]) for k in range(len(recording.channels))])
    return np.where(np.isfinite(recording.noise), recording.noise, estimated)


def differences(signal: Array) -> float:
    """Standard deviation of white noise on a smooth signal, from the median of its fourth differences.

    At least that of rounding, which a signal that moves by less than its last digit between samples does not show.
    """
    known = signal[np.isfinite(signal)]
    if len(known) < _ORDER + 2:
        return float("nan")
    jumps = np.diff(known, _ORDER)
    # Of white noise of variance one: the sum of the squared binomial coefficients 1 4 6 4 1.
    size = float(np.median(np.abs(jumps)) / _QUARTILE / np.sqrt(70.0))
    digit = float(np.diff(np.unique(known)).min(initial=np.inf)) if np.ptp(known) else 0.0
    return max(size, digit / float(np.sqrt(12.0)), 1e-12 * float(np.ptp(known)), 1e-300)
