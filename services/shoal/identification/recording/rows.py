"""What the rows of a residual vector are: one for each number that was measured, over all recordings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.noise import noise_of
from shoal.trajectory import Array


@dataclass(frozen=True)
class Rows:
    """The rows of a measurement; those of priors, at the end of a residual vector, are not among them.

    recording, time, channel: number of the recording, time by its clock [s] and number of the channel, (rows,) each
    """

    measurement: Measurement
    recording: Array
    time: Array
    channel: Array

    @classmethod
    def of(cls, measurement: Measurement) -> Rows:
        """The rows in the order of recordings, samples and channels, without gaps."""
        parts = []
        for number, recording in enumerate(measurement.recordings.values()):
            sample, channel = np.nonzero(np.isfinite(recording.values))
            parts.append((np.full(len(sample), number), recording.times[sample], channel))
        return cls(measurement, *(np.concatenate(column) for column in zip(*parts, strict=True)))

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
        """What a deviation is multiplied by, (rows,): channels count by their noise, if it is stated."""
        return np.ones(len(self.time)) if self.noise is None else self.noise / self._stated

    @cached_property
    def estimated(self) -> Array:
        """Noise of each row, (rows,): as stated, else as the recording tells it without any model."""
        sizes = [noise_of(recording) for recording in self.measurement.recordings.values()]
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
        """How many instants were measured."""
        return sum(int(np.any(np.isfinite(r.values), axis=1).sum()) for r in self.measurement.recordings.values())

    @cached_property
    def things(self) -> float:
        """How many positions and angles an instant shows, on average."""
        runs = self.measurement.recordings.values()
        return sum(r.things * len(r.times) for r in runs) / sum(len(r.times) for r in runs)
