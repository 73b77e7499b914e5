"""The record of the events of contacts: impacts, openings, and the rest in which impacts accumulate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from shoal.mechanics.numerics.tile import Array

LAST = 3
"""Impacts whose times give the limit of a geometric sequence (Aitken's delta-squared process)."""


def recorded(log: Array, names: Sequence[str], closed: Array) -> list[dict[str, Any]]:
    """Return events in the order of time: time [s], joint, kind, and the impulse [N s or N m s] of impacts.

    log: time, gap and impulse of each, which is negative where a contact opens, (events, 3). names: joints of the gaps.
    closed: which gaps are closed at the end, not 0. A gap that stays closed after several impacts `rests` from where
    their times accumulate, with the number of `impacts`; it follows the last of these in the list.
    """
    found: list[dict[str, Any]] = []
    impacts: dict[int, list[int]] = {}
    rests: dict[int, dict[str, Any]] = {}

    def rest(gap: int) -> None:
        """Let the impacts of a gap so far end in rest."""
        places = impacts.pop(gap, [])
        if len(places) > 1:
            times = [found[k]["time"] for k in places]
            rests[places[-1]] = {"time": _limit(times), "joint": names[gap], "kind": "rests", "impacts": len(places)}

    for time, number, push in log.tolist():
        gap = int(number)
        event = {"time": time, "joint": names[gap], "kind": "opens"}
        if push >= 0.0:
            event |= {"kind": "impact", "impulse": push}
            impacts.setdefault(gap, []).append(len(found))
        else:
            rest(gap)
        found.append(event)
    for gap in [gap for gap in impacts if closed[gap] != 0.0]:
        rest(gap)
    return [each for k, event in enumerate(found) for each in (event, rests.get(k)) if each is not None]


def _limit(times: Sequence[float]) -> float:
    """Return the time [s] where the impacts accumulate: hops under a constant acceleration last ever shorter by one
    factor, the restitution.
    """
    if len(times) < LAST:
        return times[-1]
    first, second = times[-2] - times[-3], times[-1] - times[-2]
    return times[-1] + second * second / (first - second) if first > second else times[-1]
