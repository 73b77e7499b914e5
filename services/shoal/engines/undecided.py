"""Decisions on contacts that the error of a run leaves open: near misses, light touches, the order of two impacts.

A gap of a run is known to the difference from a more careful run. Where that is more than what decides on an event (the
least gap of a near miss, the depth that a light touch would reach without the stop, the time between two impacts),
either outcome may be the true one, though both runs agree by chance. The other outcome is had by moving the limit of
that gap by just as much, and the distance of that motion is an error of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.engines.deviation import Deviation
from shoal.engines.event_comparison import Event
from shoal.mechanics.event_record import place_of
from shoal.mechanics.gap_history import GapHistory, follow, instants
from shoal.trajectory import Array

GRAZING, ORDER = "near-grazing", "order-of-impacts"


@dataclass(frozen=True)
class Undecided:
    """An open decision.

    what: GRAZING or ORDER; joints: that it is about; time [s]; margin: what decides, a gap [m or rad] or a time [s],
    and the error of that; shift: by how much less there is of a gap, by its number, for the other outcome [m or rad]
    """

    what: str
    joints: tuple[str, ...]
    time: float
    margin: float
    error: float
    shift: dict[int, float]

    @property
    def text(self) -> str:
        """One clause."""
        names, at = " and ".join(self.joints), f"t = {self.time:.6g} s"
        if self.what == GRAZING:
            return f"{names} is met or missed by {self.margin:.1e} m or rad at {at}, known to {self.error:.1e}"
        return f"impacts of {names} at {at} are {self.margin:.1e} s apart, known to {self.error:.1e} s"

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        found = {name: getattr(self, name) for name in ("what", "joints", "time", "margin", "error")}
        return {**found, "joints": list(self.joints)}


def undecided(deviation: Deviation) -> list[Undecided] | None:
    """Return the first open decision on every gap; None where the runs are too large to be followed.

    Where one run meets a limit that the other misses, the margin of either is less than their distance. deviation: of
    runs of the native engine in time. Raises InputError.
    """
    runs = deviation.one, deviation.other
    times = np.union1d(*map(instants, runs))
    one, other = (follow(scene, times, run) for scene, run in zip(deviation.scenes, runs, strict=True))
    if one is None or other is None:
        return None
    apart = deviation.factor * np.maximum.accumulate(np.abs(one.value - other.value), axis=0)
    error, events = np.maximum(apart, one.resolution), deviation.one.model["events"]
    found = sorted((*_grazes(one, events, error), *_orders(one, events, error)), key=lambda one: one.time)
    # Beyond the first event that one run does not have their distance is no error, but for what that event is about.
    parting = deviation.events
    concerned = {place_of(event) for event in parting.differs if event is not None}
    late = next((each for each in found if each.time > parting.until and concerned & {*each.joints}), None)
    first: dict[tuple[str, tuple[int, ...]], Undecided] = {}
    for each in found:
        if each.time <= parting.until or each is late:
            first.setdefault((each.what, tuple(each.shift)), each)
    return list(first.values())


def _grazes(history: GapHistory, events: Sequence[Event], error: Array) -> Iterator[Undecided]:
    """Yield near misses and light touches that are within the error of a gap."""
    for gap, joint in enumerate(history.joints):
        # A rest is told where impacts accumulate, which may be after the last sample.
        own = np.unique([event["time"] for event in events if place_of(event) == joint and event["kind"] != "rests"])
        for time, margin in zip(*history.nearest(gap), strict=True):
            known = float(error[np.searchsorted(history.times, time), gap])
            if margin <= known:
                yield Undecided(GRAZING, (joint,), float(time), float(margin), known, {gap: margin + known})
        for time in own:
            k = int(np.searchsorted(history.times, time))
            rate, change = history.before(gap, k)
            # A gap whose rate falls would have turned round at this depth below zero.
            if rate < 0.0 < change and abs(history.value[k, gap]) <= error[k, gap]:
                depth, known = 0.5 * rate * rate / change, float(error[k, gap])
                if depth <= known:
                    yield Undecided(GRAZING, (joint,), float(time), depth, known, {gap: -(depth + known)})


def _orders(history: GapHistory, events: Sequence[Event], error: Array) -> Iterator[Undecided]:
    """Yield neighbouring impacts of two gaps whose order is not known."""
    impacts = [event for event in events if event["kind"] == "impact"]
    for one, other in pairwise(impacts):
        # Those of one instant share one impact by the law of impacts.
        if place_of(one) == place_of(other) or one["time"] == other["time"]:
            continue
        first, second = (_hit(history, event, error) for event in (one, other))
        if first is None or second is None:
            continue
        margin, doubt = other["time"] - one["time"], first[2] / first[1] + second[2] / second[1]
        if margin <= doubt:
            gap, rate, _ = first
            joints = (place_of(one), place_of(other))
            yield Undecided(ORDER, joints, one["time"], margin, doubt, {gap: -rate * (margin + doubt)})


def _hit(history: GapHistory, event: Event, error: Array) -> tuple[int, float, float] | None:
    """Return the gap that an impact closes, the speed at which it does, and the error of the gap there."""
    k = int(np.searchsorted(history.times, event["time"]))
    own = (gap for gap, joint in enumerate(history.joints) if joint == place_of(event))
    falling = [gap for gap in own if history.rate[k, gap] < 0.0]
    if not falling:
        return None
    gap = min(falling, key=lambda one: abs(float(history.value[k, one])))
    return gap, -float(history.rate[k, gap]), float(error[k, gap])
