"""Fixed steps that suit the requested times, and the coordinates Exudyn passed through on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.trajectory import Array

Indices = npt.NDArray[np.int64]
LARGEST_RECORD = 5_000_000
"""Coordinates (and as many velocities) kept of one run; beyond, only every n-th step is kept."""


@dataclass(frozen=True)
class Steps:
    """`count` steps of `size` [s]; `kept` are the indices of those recorded, increasing, from 0 to count.

    runs: number of equal steps and end [s] of successive runs; more than one where functions of time have
    breakpoints, and then `size` is the longest step.
    """

    wanted: Array
    count: int
    size: float
    kept: Indices
    runs: tuple[tuple[int, float], ...]

    @property
    def instants(self) -> Array:
        """Return the instants at which steps begin and end [s], (count + 1,)."""
        if len(self.runs) == 1:
            return np.multiply(np.arange(self.count + 1), self.size, dtype=float)
        ends = [0.0, *(end for _, end in self.runs)]
        parts = [
            begin + (end - begin) * np.arange(1, count + 1) / count
            for (count, end), begin in zip(self.runs, ends, strict=False)
        ]
        return np.concatenate([[0.0], *parts])


def choose_steps(wanted: Array, step: float, unknowns: int, halts: Array | None = None) -> Steps:
    """Steps no longer than `step` [s] (but for round-off) that meet the wanted times [s] where possible.

    halts: times that steps must end at [s], increasing.
    """
    last = float(wanted[-1])
    inside = [] if halts is None else halts[(halts > 1e-12 * last) & (halts < last * (1 - 1e-12))].tolist()
    if inside:
        return _in_spans(wanted, step, unknowns, [*inside, last])
    between = np.diff(wanted, prepend=0.0)
    interval = float(np.min(between[between > 0], initial=last))
    if last == 0:
        size, count = step, 0
    elif _multiples(wanted, step):
        size, count = step, round(last / step)
    else:
        common = interval if interval >= step and _multiples(wanted, interval) else last
        size = common / math.ceil(common / step - 1e-9)
        count = round(last / size)
    stride = max(1, math.ceil(count * unknowns / LARGEST_RECORD))
    before = np.floor(wanted / size + 1e-9).astype(np.int64)
    kept = np.unique(np.concatenate([np.arange(0, count, stride), before, before + 1, [count]]))
    return Steps(wanted, count, size, kept[kept <= count], ((count, count * size),))


def _in_spans(wanted: Array, step: float, unknowns: int, ends: list[float]) -> Steps:
    begins = [0.0, *ends[:-1]]
    counts = [max(1, math.ceil((end - begin) / step - 1e-9)) for begin, end in zip(begins, ends, strict=True)]
    total = sum(counts)
    steps = Steps(wanted, total, step, np.zeros(0, dtype=np.int64), tuple(zip(counts, ends, strict=True)))
    stride = max(1, math.ceil(total * unknowns / LARGEST_RECORD))
    before = np.searchsorted(steps.instants, wanted + 1e-9 * step, side="right") - 1
    kept = np.unique(np.concatenate([np.arange(0, total, stride), before, before + 1, [0], np.cumsum(counts)]))
    return replace(steps, kept=kept[kept <= total])


def _multiples(times: Array, interval: float) -> bool:
    ratio = times / interval
    return bool(np.allclose(ratio, np.round(ratio), rtol=1e-12, atol=1e-9))


@dataclass
class KeptStates:
    """Coordinates and velocities at the kept steps, (kept, unknowns); not a number where the run did not get."""

    steps: Steps
    reference: Array
    """Coordinates [m or rad] of the undeformed start, from which Exudyn counts, (unknowns,)."""
    shortened: bool = False
    """Whether Exudyn shortens steps where it has to: kept is the first that ends at a kept instant or later."""
    times: Array = field(init=False)
    """Time of each kept step [s], (kept,)."""
    q: Array = field(init=False)
    v: Array = field(init=False)
    seen: int = field(default=0, init=False)
    filled: int = field(default=0, init=False)
    resumed: bool = field(default=False, init=False)
    """Whether the next call is that of the initialisation of a run that goes on where the last one ended."""

    def __post_init__(self) -> None:
        self.q = np.full((len(self.steps.kept), self.reference.size), np.nan)
        self.v = np.full_like(self.q, np.nan)
        self.times = self.steps.instants[self.steps.kept]

    def take(self, mbs: Any, time: float) -> bool:
        """Exudyn's call after the initialisation and after each step."""
        if self.resumed:
            self.resumed = False
            return True
        while self._due(time):
            self.times[self.filled] = time if self.shortened else self.times[self.filled]
            # GetODE2CoordinatesTotal, which adds the reference, aborts beyond about 100 coordinates (Exudyn 1.13.6).
            self.q[self.filled] = self.reference + mbs.systemData.GetODE2Coordinates()
            self.v[self.filled] = mbs.systemData.GetODE2Coordinates_t()
            self.filled += 1
        self.seen += 1
        return True

    def _due(self, time: float) -> bool:
        if self.filled == len(self.times):
            return False
        if self.shortened:
            return bool(time >= self.times[self.filled] - 1e-6 * self.steps.size)
        return bool(self.steps.kept[self.filled] == self.seen)

    def at_wanted(self) -> tuple[Array, Array]:
        """Coordinates and velocities at the wanted times, (samples, unknowns) each; cubic Hermite between steps."""
        row = np.searchsorted(self.times, self.steps.wanted + 1e-9 * self.steps.size, side="right") - 1
        row = np.clip(row, 0, max(len(self.times) - 2, 0))
        after = np.minimum(row + 1, len(self.times) - 1)
        # Of a thinned record the last two kept steps need not be neighbours.
        size = np.where(self.times[after] > self.times[row], self.times[after] - self.times[row], self.steps.size)[
            :, None
        ]
        s = (self.steps.wanted - self.times[row])[:, None] / size
        s = np.where(np.abs(s - np.round(s)) < 1e-6, np.round(s), s)
        q0, q1, v0, v1 = self.q[row], self.q[after], self.v[row] * size, self.v[after] * size
        q = (1 + 2 * s) * (1 - s) ** 2 * q0 + s * (1 - s) ** 2 * v0 + s**2 * (3 - 2 * s) * q1 + s**2 * (s - 1) * v1
        v = 6 * s * (1 - s) * (q1 - q0) + (1 - s) * (1 - 3 * s) * v0 + s * (3 * s - 2) * v1
        return q, v / size
