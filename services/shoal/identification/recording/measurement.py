"""Measured motion as samples: one recording, or several with their known truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.identification.conventions import MAD, PRECISION
from shoal.identification.recording.source import Channel, Clocked
from shoal.trajectory import Array

IntArray = npt.NDArray[np.intp]

FEWEST = 3
"""Samples without which there is no motion: two show no acceleration."""


@dataclass(frozen=True)
class HeldOut:
    """Samples of a window that is predicted instead of fitted.

    window [s]: as stated, by the clock of the table; times [s], (samples,), and values, (samples, channels): as
    those of the recording
    """

    window: tuple[float, float]
    times: Array
    values: Array


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples of one run. times [s]: (samples,), by the recording's clock, from the start of the motion to fit on.

    values: (samples, channels) in SI units, nan where nothing was measured
    noise: standard deviation of each channel, (channels,), nan where it is not stated
    stated: clock, position of the camera, fields of the scene of this run
    origin: where the data come from; notes: what was found and mended in them
    held: windows that are not fitted, whose samples are not among the others
    begin [s]: when the motion starts, by the clock of the table
    table: digest of the file that it is read from, all of it; empty if there is none
    turns [rad]: whole turns that were taken off the channels, (channels,) or the same for all
    """

    times: Array
    channels: tuple[Channel, ...]
    values: Array
    origin: str
    noise: Array
    stated: Clocked = field(default_factory=Clocked)
    notes: tuple[str, ...] = ()
    held: tuple[HeldOut, ...] = ()
    begin: float = 0.0
    table: str = ""
    turns: Array | float = 0.0

    def holding(self, windows: Sequence[tuple[float, float]], begin: float = 0.0) -> Recording:
        """With the samples of these windows [s] held out; begin [s]: the motion's start by their clock.

        Raises InputError for a window without a sample, and where too few are left to be fitted.
        """
        fitted, held = np.ones(len(self.times), dtype=bool), []
        for window in sorted(windows):
            low, high = window[0] - begin - 1e-9, window[1] - begin + 1e-9
            inside = fitted & (self.times >= low) & (self.times <= high)
            if not np.any(np.isfinite(self.values[inside])):
                span = f"{self.times[0] + begin:g} s to {self.times[-1] + begin:g} s"
                empty = f"all cells of its {np.count_nonzero(inside)} rows are empty"
                why = empty if np.any(inside) else f"the recording covers {span}"
                raise InputError(f"hold_out: no sample from {window[0]:g} s to {window[1]:g} s; {why}")
            held.append(HeldOut(window, self.times[inside], self.values[inside]))
            fitted &= ~inside
        left = np.isfinite(self.values[fitted]).sum(axis=0)
        if not np.all(left) or np.count_nonzero(fitted) < FEWEST:
            raise InputError(f"hold_out: {np.count_nonzero(fitted)} samples are left to fit; hold out less")
        count = len(self.times) - np.count_nonzero(fitted)
        origin = f"{self.origin}, {count} of them held out" if held else self.origin
        return replace(self, times=self.times[fitted], values=self.values[fitted], held=tuple(held), origin=origin)

    @property
    def things(self) -> int:
        """Number of observed things: positions (x and y count as one), angles, and what sensors show."""
        return len({(c.place, c.to, "position" if c.is_position else c.quantity) for c in self.channels})

    def numbers(self, times: Array) -> IntArray:
        """Return the numbers, from 0, of samples at these times [s], those held out counted."""
        known = np.unique(np.concatenate([self.times, *(one.times for one in self.held)]))
        return np.searchsorted(known, times - 1e-12)

    def until(self, end: float) -> Recording:
        """The samples up to a time [s]."""
        keep = self.times <= end + 1e-12
        return replace(self, times=self.times[keep], values=self.values[keep])

    def every(self, step: int) -> Recording:
        """Every `step`-th sample."""
        return replace(self, times=self.times[::step], values=self.values[::step])


@dataclass(frozen=True, eq=False)
class Measurement:
    """The recordings by name, and the parameters of computed data (`truth`), for the report."""

    recordings: Mapping[str, Recording]
    truth: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def single(
        cls,
        times: Array,
        channels: tuple[Channel, ...],
        values: Array,
        origin: str,
        truth: Mapping[str, float] | None = None,
        noise: float | None = None,
    ) -> Measurement:
        """One recording without a name. noise: standard deviation of its channels, if known. Raises InputError."""
        if noise is not None and not (np.isfinite(noise) and noise > 0):
            raise InputError(
                f"noise: a standard deviation above 0, or None if it is not known, is needed, found {noise:g}"
            )
        sizes = np.full(len(channels), np.nan if noise is None else noise)
        return cls({"recording": Recording(times, channels, values, origin, sizes)}, truth or {})

    @property
    def first(self) -> Recording:
        """The first of the recordings."""
        return next(iter(self.recordings.values()))

    @property
    def origin(self) -> str:
        """Origin of the data."""
        many = len(self.recordings) > 1
        return "; ".join(f"{name}: {r.origin}" if many else r.origin for name, r in self.recordings.items())

    @property
    def end(self) -> float:
        """The last time of a sample [s]."""
        return max(float(recording.times[-1]) for recording in self.recordings.values())

    def until(self, end: float) -> Measurement:
        """The samples up to a time [s]."""
        return self.changed(lambda recording: recording.until(end))

    def changed(self, change: Callable[[Recording], Recording]) -> Measurement:
        """With a change of every recording."""
        return replace(self, recordings={name: change(recording) for name, recording in self.recordings.items()})


_ORDER = 4
"""Order of the differences: they keep 16 sin^4(pi f) of a motion of f periods a sample."""


def noise_of(recording: Recording) -> Array:
    """Standard deviation of the noise of each channel, (channels,): as stated, else by differences of the data.

    A smooth motion has small fourth differences, white noise has large ones: their median shows its size, and outliers
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
    size = float(np.median(np.abs(jumps)) * MAD / np.sqrt(70.0))
    digit = float(np.diff(np.unique(known)).min(initial=np.inf)) if np.ptp(known) else 0.0
    return max(size, digit / float(np.sqrt(12.0)), PRECISION * float(np.ptp(known)), 1e-300)
