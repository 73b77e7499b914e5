"""Words of contact events: two runs' sequences of kind and joint, compared from the beginning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.mechanics.event_record import place_of
from shoal.trajectory import Array

Event = Mapping[str, Any]
"""An event of `Trajectory.model["events"]`: time [s], joint or contact, kind."""


@dataclass(frozen=True)
class EventComparison:
    """Events of two runs, paired from the beginning as long as their words are equal.

    paired: number of pairs; time_error: the largest difference of their times, as an error [s]; differs: the next event
    of both where the words part, None where there is none; empty of equal words. Impacts in which one run comes to rest
    on a contact later than the other, whose hops fall below resolution sooner, are left out. spans: between the times
    of paired events one run may be faster than the other by a whole impact [s], (pairs, 2).
    """

    paired: int
    time_error: float
    differs: tuple[Event | None, ...]
    spans: Array = field(repr=False, compare=False)

    @property
    def until(self) -> float:
        """Instant at which the words part [s]; infinite of equal words."""
        return min((event["time"] for event in self.differs if event is not None), default=np.inf)

    @property
    def text(self) -> str:
        """Return the difference in one clause; empty of equal words."""
        described = (
            "no more" if event is None else f"{place_of(event)} {event['kind']} at t = {event['time']:.9g} s"
            for event in self.differs
        )  # fmt: skip
        return " against ".join(described)

    def beside(self, times: Array) -> Array:
        """Return at which times [s] one run is past an event and the other is not, (times,)."""
        low, high = self.spans[:, :1], self.spans[:, 1:]
        return np.asarray(np.any((low <= times) & (times <= high), axis=0))

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {"paired": self.paired, "time_error": self.time_error, "differs": self.text}


def compare(one: Sequence[Event], other: Sequence[Event], factor: float = 1.0) -> EventComparison:
    """Compare the events of two runs. factor: of the difference of two times as an error."""
    pairs: list[tuple[float, float]] = []
    i = j = 0
    while i < len(one) and j < len(other):
        if letter(one[i]) == letter(other[j]):
            pairs.append((one[i]["time"], other[j]["time"]))
            i, j = i + 1, j + 1
        elif (k := _last_hop(one, i, other[j])) is not None:
            i = k
        elif (k := _last_hop(other, j, one[i])) is not None:
            j = k
        else:
            break
    left = [next(iter(events[k:]), None) for events, k in ((one, i), (other, j))]
    spans = np.sort(np.array(pairs).reshape(-1, 2), axis=1)
    error = factor * float(np.max(np.ptp(spans, axis=1), initial=0.0))
    return EventComparison(len(pairs), error, tuple(left) if any(left) else (), spans)


def letter(event: Event) -> tuple[str, str]:
    """Return what of an event words are made of."""
    return event["kind"], place_of(event)


def _last_hop(events: Sequence[Event], first: int, rest: Event) -> int | None:
    """Return the number of the event that is a rest of the same joint; None if others than its impacts come before."""
    if rest["kind"] != "rests":
        return None
    for k in range(first, len(events)):
        if letter(events[k]) == letter(rest):
            return k
        if letter(events[k]) != ("impact", place_of(rest)):
            return None
    return None
