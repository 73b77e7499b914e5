"""Other valleys along the axes through the places where a surrogate is least so far.

Where most parameters are at an end of theirs and one decides the phase, there is a valley for every cycle along that
axis, all nearly as deep and too narrow for a scan of the whole box. Each has its deepest place elsewhere along it, so
that one that is less deep here may be the deepest there: several are followed down.
"""

from __future__ import annotations

import numpy as np

from shoal.response.climb import Objective, climb_down
from shoal.response.inputs import IntArray
from shoal.trajectory import Array

LINE = 129
"""Places along each axis."""
FINER = 0.25, 0.02
"""Lengths, in the distance of two places, in which each valley is looked at again."""
DEEPEST = 4
"""Valleys along each axis that are followed, beside that of the place itself."""
OWN = 0.25 * 2 / (LINE - 1)
"""A valley so near is the place's own."""
BLOCK = 200_000
"""Places that are looked at together."""


def beside(objective: Objective, best: Array, at: Array) -> None:
    """Improve values, (searches,), and places, (searches, parameters), in place: downhill from the deepest valleys that
    are foretold along each axis by the parabola through three neighbours.
    """
    line = np.linspace(-1, 1, LINE)
    block = max(1, BLOCK // LINE)
    for axis in range(at.shape[1]):
        for k in range(0, len(at), block):
            some: IntArray = np.arange(k, min(k + block, len(at)))
            _along(objective, best, at, axis, line, some)


def _along(objective: Objective, best: Array, at: Array, axis: int, line: Array, some: IntArray) -> None:
    """Of some searches, along one axis."""
    places = np.repeat(at[some], LINE, axis=0)
    places[:, axis] = np.tile(line, len(some))
    search, where = _valleys(objective(places, np.repeat(some, LINE)).reshape(len(some), LINE), line)
    other = np.abs(where - at[some[search], axis]) > OWN
    search, where = some[search[other]], where[other]
    if not len(search):
        return
    for width in FINER:
        three = np.repeat(at[search][None], 3, axis=0)
        three[:, :, axis] = np.clip(where + width * (line[1] - line[0]) * np.array([[-1], [0], [1]]), -1, 1)
        sides = objective(three.reshape(-1, at.shape[1]), np.tile(search, 3)).reshape(3, -1)
        where, depth = _vertex(sides, three[:, :, axis])
    order = np.lexsort((depth, search))
    search, where = search[order], where[order]
    chosen = np.arange(len(search)) - np.searchsorted(search, search) < DEEPEST
    search, place = search[chosen], at[search[chosen]]
    place[:, axis] = np.clip(where[chosen], -1, 1)
    found = objective(place, search)
    climb_down(lambda x, searches: objective(x, search[searches]), place, found)
    order = np.argsort(-found, kind="stable")
    order = order[found[order] < best[search[order]]]
    # The deepest of one search is entered last.
    best[search[order]], at[search[order]] = found[order], place[order]


def _valleys(value: Array, line: Array) -> tuple[IntArray, Array]:
    """Every valley: of which search, and about where, (valleys,) each; value: (searches, places)."""
    left, middle, right = value[:, :-2], value[:, 1:-1], value[:, 2:]
    search, k = np.nonzero((middle <= left) & (middle <= right))
    three = np.stack([part[search, k] for part in (left, middle, right)])
    return search, _vertex(three, np.stack([line[k], line[k + 1], line[k + 2]]))[0]


def _vertex(value: Array, where: Array) -> tuple[Array, Array]:
    """Place and value of the lowest point of a parabola through three, (3, valleys), or of the middle one."""
    curved = value[0] - 2 * value[1] + value[2]
    bent = curved > 0
    safe, slope = np.where(bent, curved, 1.0), np.where(bent, value[0] - value[2], 0.0)
    step = 0.5 * (where[2] - where[0])
    return where[1] + np.clip(0.5 * slope / safe, -1, 1) * step, value[1] - slope**2 / (8 * safe)
