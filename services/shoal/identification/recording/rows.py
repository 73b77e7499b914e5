"""Rows of a residual vector: one for each number that was measured, over all recordings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.identification.recording.measurement import Measurement, Recording, noise_of
from shoal.identification.recording.source import Channel
from shoal.identification.recording.units import of_channels
from shoal.trajectory import Array

_LEAST = 1e-6
"""Of the spread of a channel: no sensor is so good, whatever its samples show."""


@dataclass(frozen=True)
class ResidualRows:
    """The rows of a measurement; those of priors, at the end of a residual vector, are not among them.

    recording, time, channel: number of the recording, time by its clock [s] and number of the channel, (rows,) each
    whole: the measurement of which this is a part, or itself; by it a noise that is not stated is estimated
    """

    measurement: Measurement
    recording: Array
    time: Array
    channel: Array
    whole: Measurement

    @classmethod
    def of(cls, measurement: Measurement, whole: Measurement | None = None) -> ResidualRows:
        """The rows in the order of recordings, samples and channels, without gaps."""
        parts = []
        for number, recording in enumerate(measurement.recordings.values()):
            sample, channel = np.nonzero(np.isfinite(recording.values))
            parts.append((np.full(len(sample), number), recording.times[sample], channel))
        recordings, times, channels = (np.concatenate(column) for column in zip(*parts, strict=True))
        is_part = whole is not None and _channels_of(measurement) == _channels_of(whole)
        return cls(measurement, recordings, times, channels, whole if whole and is_part else measurement)

    @cached_property
    def _stated(self) -> Array:
        """Stated standard deviation of each row, (rows,), nan where it is not."""
        runs = self.measurement.recordings.values()
        return np.concatenate([np.broadcast_to(r.noise, r.values.shape)[np.isfinite(r.values)] for r in runs])

    @cached_property
    def noise(self) -> float | None:
        """Standard deviation of a (weighted) row if the noise of every channel is stated, else None."""
        noise = self._stated
        return float(np.exp(np.mean(np.log(noise)))) if np.all(np.isfinite(noise)) else None

    @cached_property
    def weight(self) -> Array:
        """Weight of each row, (rows,): channels count by their noise, relative to its geometric mean.

        Where it is not stated all count alike, but for channels of different units, of which a metre and a radian are
        not alike: these count by the noise that the data show.
        """
        if self.noise is not None:
            return np.asarray(self.noise / self._stated)
        if of_channels(self.whole):
            return np.ones(len(self.time))
        return np.asarray(np.exp(np.mean(np.log(self._shown))) / self._shown)

    @cached_property
    def shown(self) -> float:
        """Standard deviation of a weighted row: as stated, else as the data show; the geometric mean of all rows."""
        return float(np.exp(np.mean(np.log(self._shown * self.weight))))

    @cached_property
    def _shown(self) -> Array:
        return self._each([_beside(recording) for recording in self.whole.recordings.values()])

    @cached_property
    def estimated(self) -> Array:
        """Noise of each row, (rows,): as stated, else as estimated from the recording without a model."""
        return self._each([noise_of(recording) for recording in self.whole.recordings.values()])

    def _each(self, sizes: list[Array]) -> Array:
        """A number of each channel of each recording, for each row."""
        return np.array([sizes[r][c] for r, c in zip(self.recording, self.channel, strict=True)])

    @cached_property
    def signal(self) -> float:
        """Standard deviation of the weighted data about the mean of each channel."""
        parts = []
        for recording in self.measurement.recordings.values():
            known = np.isfinite(recording.values)
            mean = np.sum(recording.values, axis=0, where=known) / np.maximum(np.sum(known, axis=0), 1)
            parts.append((recording.values - mean)[known])
        return float(np.sqrt(np.mean((np.concatenate(parts) * self.weight) ** 2)))

    @cached_property
    def samples(self) -> int:
        """Number of measured instants."""
        return sum(int(np.any(np.isfinite(r.values), axis=1).sum()) for r in self.measurement.recordings.values())

    @cached_property
    def things(self) -> float:
        """Mean number of positions and angles that an instant shows."""
        runs = self.measurement.recordings.values()
        return sum(r.things * len(r.times) for r in runs) / sum(len(r.times) for r in runs)


def _channels_of(measurement: Measurement) -> list[tuple[Channel, ...]]:
    return [recording.channels for recording in measurement.recordings.values()]


def _beside(recording: Recording) -> Array:
    """Noise of each channel, (channels,), by which it counts beside others: stated, else estimated, but never nothing.

    Of a signal that is free of noise, or does not move, differences show none.
    """
    spread = np.nanstd(recording.values, axis=0)
    largest = np.nanmax(np.abs(recording.values), axis=0)
    size = np.where(spread > 0.0, spread, np.where(largest > 0.0, largest, 1.0))
    return np.asarray(np.fmax(noise_of(recording), _LEAST * size))
