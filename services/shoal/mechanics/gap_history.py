"""Gaps of one-sided constraints along a motion: their values, how near they come to closing, and motions of others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shoal.mechanics.analysis import evaluations
from shoal.mechanics.gaps import shifted
from shoal.mechanics.integrators import facts
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import SINGLE, Array, Flags
from shoal.mechanics.runs import Runs
from shoal.mechanics.simulate import runs, simulate
from shoal.mechanics.workspace import at_start
from shoal.scene import Scene
from shoal.trajectory import Trajectory

PARTS = 8
"""Samples of a step of an adaptive integrator: so many as those of `contact_events`, which look for events."""
AFTER = 1e-3
"""Part of the time to the next event at which rates are those after an event."""
ROOM = 2**25
"""Coordinates and rates that are kept at most (a quarter of a gigabyte)."""


@dataclass(frozen=True)
class GapHistory:
    """Gaps of a run at instants close enough to see every approach.

    times [s]: (samples,); smooth: which of them are not at an event of any gap, or so soon after it that rates may be
    those before, (samples,); fields: what states the gaps; value [m or rad], rate: (samples, gaps). resolution: gaps
    below it are closed
    """

    times: Array
    smooth: Flags
    fields: tuple[str, ...]
    value: Array
    rate: Array
    resolution: float

    @property
    def joints(self) -> list[str]:
        """The joint or contact of every gap."""
        return [field.split(".")[1] for field in self.fields]

    def nearest(self, gap: int) -> tuple[Array, Array]:
        """Return times and values of the least values that a gap passes while it is open.

        By the cubic polynomials through values and rates of neighbouring samples.
        """
        left, right = self.rate[:-1, gap], self.rate[1:, gap]
        open_ = self.value[:, gap] > self.resolution
        k = np.flatnonzero((left < 0.0) & (right > 0.0) & open_[:-1] & open_[1:] & self.smooth[:-1])
        step = self.times[k + 1] - self.times[k]
        a, b = self.rate[k, gap] * step, self.rate[k + 1, gap] * step
        rise = self.value[k + 1, gap] - self.value[k, gap]
        # g(x) = g0 + a x + c x^2 + d x^3, 0 < x < 1, whose slope falls from a < 0 to b > 0 through one root.
        c, d = 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise
        root = np.sqrt(np.maximum(c * c - 3.0 * a * d, 0.0))
        # Each form where its terms have one sign: values that are round-off may make c negative, and d positive.
        x = np.where(c < 0.0, (root - c) / np.where(c < 0.0, 3.0 * d, 1.0), -a / np.where(c < 0.0, 1.0, c + root))
        return self.times[k] + x * step, self.value[k, gap] + x * (a + x * (c + x * d))

    def before(self, gap: int, sample: int) -> tuple[float, float]:
        """Return the rate of a gap at a sample and how fast it changed before; not at all at the first one."""
        if sample == 0:
            return float(self.rate[0, gap]), 0.0
        change = self.rate[sample, gap] - self.rate[sample - 1, gap]
        return float(self.rate[sample, gap]), float(change / (self.times[sample] - self.times[sample - 1]))


def instants(run: Trajectory) -> Array:
    """Return times [s] that show all approaches of a run of the native engine.

    They are parts of its steps, its events, at which the rates are those before, and instants AFTER these.
    """
    end, parts = float(run.times[-1]), PARTS if facts(run.model["integrator"]).adaptive else 1
    ends, after = _stretches(run)
    grid = np.linspace(0.0, end, parts * run.steps + 1)
    between = np.concatenate([after, 0.5 * (ends[1:] + ends[:-1])])
    found = np.unique(np.concatenate([grid, ends, between, run.times]))
    return np.asarray(found[found <= end])


def _stretches(run: Trajectory) -> tuple[Array, Array]:
    """Return the times of events, with the beginning and the end, and when rates after each but the last are known."""
    times = [event["time"] for event in run.model["events"] if event["kind"] != "rests"]
    ends = np.unique([0.0, *times, float(run.times[-1])])
    after = ends[:-1] + AFTER * np.diff(ends)
    if 0.0 not in times:
        after[0] = 0.0
    return ends, after


def follow(scene: Scene, times: Array, run: Trajectory) -> GapHistory | None:
    """Return the gaps of a run of a scene at given times, from 0 on; None of one that is too large.

    The run is made again: what samples it does not change it. Raises InputError.
    """
    machine = Machine.of(scene)
    model = runs(machine, scene.solver, float(times[-1])).model
    if 2 * len(times) * model.unknowns > ROOM:
        return None
    states = simulate(scene, times, machine=machine, whole=True).states
    arrays, room = at_start(states.model, SINGLE, slice(0, 1))
    evaluations.enter(arrays, room)
    value, rate = evaluations.follow_gaps(SINGLE, arrays, room, states.q[..., 0], states.v[..., 0])
    ends, after = _stretches(run)
    last = np.searchsorted(ends, times, side="right") - 1
    smooth = times >= np.append(after, np.inf)[last]
    return GapHistory(times, smooth, model.gap_fields, value, rate, model.gaps.resolution)


def moved(scene: Scene, times: Array, shifts: Mapping[int, float]) -> Trajectory:
    """Return the motion with other limits. shifts: how much less of a gap there is [m or rad], by its number."""
    own = runs(Machine.of(scene), scene.solver, float(times[-1]))
    gaps = shifted(own.model.gaps, shifts)
    return Runs(own.scene, replace(own.model, gaps=gaps, shared_tiles={}), own.choice).run(times)
