"""Measured and fitted signals of an estimate, one by one, over all its recordings and channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shoal.identification import Estimate
from shoal.identification.recording.measurement import noise_of
from shoal.identification.recording.source import Channel
from shoal.identification.recording.units import of_channel
from shoal.trajectory import Array

LONG = 1.9
"""A step of time that is so many times the usual one is a gap."""


@dataclass(frozen=True)
class FittedSignal:
    """One channel of one recording: times by its clock [s], measured (nan in gaps) and fitted values, all (samples,).

    noise: standard deviation as stated, else estimated from differences of the data
    name: channel, and recording where there are several
    """

    name: str
    recording: str
    channel: Channel
    times: Array
    measured: Array
    fitted: Array
    noise: float
    stated: bool

    @property
    def residual(self) -> Array:
        """Model minus measurement, (samples,), nan in gaps."""
        return self.fitted - self.measured

    @property
    def rms(self) -> float:
        """Root of the mean squared residual, 0 where nothing was measured."""
        known = self.residual[np.isfinite(self.residual)]
        return float(np.sqrt(np.mean(known**2))) if known.size else 0.0

    @property
    def unit(self) -> str:
        """Return the unit of the values."""
        return of_channel(self.channel)

    @property
    def misfit(self) -> float:
        """RMS over the noise, or over the spread of the signal where no noise is known."""
        size = self.noise if np.isfinite(self.noise) else float(np.nanstd(self.measured))
        return self.rms / max(size, 1e-300)


def signals(estimate: Estimate) -> list[FittedSignal]:
    """Every channel of every recording, in their order."""
    recordings = estimate.measurement.recordings
    found = []
    for name, recording in recordings.items():
        noise = noise_of(recording)
        for k, channel in enumerate(recording.channels):
            what = channel.name
            found.append(
                FittedSignal(
                    f"{name}: {what}" if len(recordings) > 1 else what,
                    name,
                    channel,
                    recording.times,
                    recording.values[:, k],
                    estimate.predicted[name][:, k],
                    float(noise[k]),
                    bool(np.isfinite(recording.noise[k])),
                )
            )
    return found


def worst(found: Sequence[FittedSignal], most: int) -> list[FittedSignal]:
    """At most `most` signals, those with the largest misfit, in their order."""
    chosen = sorted(range(len(found)), key=lambda k: -found[k].misfit)[:most]
    return [found[k] for k in sorted(chosen)]


def residuals(estimate: Estimate) -> dict[str, Array]:
    """Model minus measurement by recording, (samples, channels) each, nan in gaps."""
    return {name: estimate.predicted[name] - r.values for name, r in estimate.measurement.recordings.items()}


def gaps(signal: FittedSignal) -> list[tuple[float, float]]:
    """Intervals of time [s] in which nothing was measured: samples without a value, and steps far above the usual."""
    known = signal.times[np.isfinite(signal.measured)]
    if len(known) < 2:
        return []
    usual = float(np.median(np.diff(signal.times)))
    long = np.flatnonzero(np.diff(known) > LONG * usual)
    found = [(float(known[k]), float(known[k + 1])) for k in long]
    if signal.times[-1] - known[-1] > LONG * usual:
        found.append((float(known[-1]), float(signal.times[-1])))
    return found
