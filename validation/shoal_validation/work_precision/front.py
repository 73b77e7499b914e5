"""The methods that nothing beats: no other run is both faster and nearer."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from shoal_validation.work_precision.contract import Point

GAIN = 0.05
"""How much nearer than all faster points a point of the front has to be, as a part."""


def front(points: Iterable[Point], floor: float) -> list[Point]:
    """The believed points, faster to nearer, each nearer by `GAIN` than all faster ones.

    floor: error of the reference [m], below which points cannot be told apart
    """
    best, found = float("inf"), []
    for point in sorted(points, key=lambda point: (point.seconds, point.error)):
        if point.ok and max(point.error, floor) < best * (1 - GAIN):
            best = max(point.error, floor)
            found.append(point)
    return found


def cheapest(
    points: Iterable[Point], reach: float, seconds: Callable[[Point], float | None] = lambda point: point.seconds
) -> Point | None:
    """The believed point of least cost with an error of at most `reach` [m], if there is one."""
    there = [point for point in points if point.ok and point.error <= reach and seconds(point) is not None]
    return min(there, key=lambda point: seconds(point) or 0.0, default=None)
