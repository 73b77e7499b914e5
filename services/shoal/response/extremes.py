"""Where a surrogate is smallest and largest over the box of germs, column by column."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np
from scipy.stats import qmc

from shoal.trajectory import Array

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
SCANNED = 4096
"""Quasi-random places that are looked at, beside corners and a grid."""
MOST_CORNERS = 10
"""Parameters up to which all corners are looked at."""
GRID = {1: 1001, 2: 41, 3: 15, 4: 7}
"""Places along each axis of the grid, by the number of parameters."""
STEPS = 0.25, 0.1, 0.04, 0.015, 0.005, 0.001, 0.0002
"""Of the search along each axis from the best place that was scanned."""


class Each(Protocol):
    """One column at any germ without a run."""

    def each(self, germs: Array, columns: IntArray) -> Array:
        """(places,)."""
        ...


class Surrogate(Each, Protocol):
    """Answers at any germ without a run."""

    def __call__(self, germs: Array) -> Array:
        """(places, columns)."""
        ...


@dataclass(frozen=True)
class Extremes:
    """lower, upper: (columns,); at_lower, at_upper: the germs there, (columns, parameters)."""

    lower: Array
    upper: Array
    at_lower: Array
    at_upper: Array


def corners(parameters: int) -> Array:
    """All 2^p corners of the box."""
    return np.array(list(product((-1.0, 1.0), repeat=parameters)))


def extremes(surrogate: Surrogate, parameters: int, columns: int, seed: int = 0, starts: int = 1) -> Extremes:
    """The extremes over [-1, 1]^p: scanned, then sought along each axis by parabolas.

    starts: how many places are sought from, the best of as many shares of what is scanned; more scanned with more
    """
    best = [np.full((starts, columns), np.inf), np.full((starts, columns), np.inf)]
    at = [np.zeros((starts, columns, parameters)), np.zeros((starts, columns, parameters))]
    block = max(1, 4_000_000 // max(columns, 1))
    every = np.arange(columns)
    for start in range(starts):
        looked_at = places(parameters, seed + start)
        for k in range(0, len(looked_at), block):
            some = looked_at[k : k + block]
            found = surrogate(some)
            for side, sign in enumerate((1.0, -1.0)):
                least = np.argmin(sign * found, axis=0)
                value = sign * found[least, every]
                better = value < best[side][start]
                best[side][start, better], at[side][start, better] = value[better], some[least][better]
    for side, sign in enumerate((1.0, -1.0)):
        value, place = best[side].reshape(-1), at[side].reshape(-1, parameters)
        for step in STEPS:
            for axis in range(parameters):
                along(surrogate, sign, axis, step, value, place, np.tile(every, starts))
    first = [np.argmin(one, axis=0) for one in best]
    lower, upper = (one[k, every] for one, k in zip(best, first, strict=True))
    return Extremes(lower, -upper, *(one[k, every] for one, k in zip(at, first, strict=True)))


def along(surrogate: Each, sign: float, axis: int, step: float, best: Array, at: Array, every: IntArray) -> None:
    """Improve all columns along one axis: at both sides and where the parabola through the three is least."""
    here, sides, tried = best.copy(), [], []
    for way in (-step, step):
        place = at.copy()
        place[:, axis] = np.clip(place[:, axis] + way, -1, 1)
        tried.append(place)
        sides.append(sign * surrogate.each(place, every))
    curved = sides[0] - 2 * here + sides[1]
    shift = np.divide(sides[0] - sides[1], 2 * curved, out=np.zeros_like(here), where=curved > 0)
    place = at.copy()
    place[:, axis] = np.clip(place[:, axis] + step * np.clip(shift, -2, 2), -1, 1)
    tried.append(place)
    sides.append(sign * surrogate.each(place, every))
    for place, value in zip(tried, sides, strict=True):
        better = value < best
        best[better], at[better] = value[better], place[better]


def places(parameters: int, seed: int) -> Array:
    """Where a surrogate is looked at: all over the box, its corners among them."""
    scanned = 2 * qmc.Sobol(parameters, rng=seed).random(SCANNED) - 1
    found = [np.zeros((1, parameters)), scanned, np.sign(scanned[: SCANNED // 8])]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    if parameters in GRID:
        axis = np.linspace(-1, 1, GRID[parameters])
        found.append(np.array(list(product(axis, repeat=parameters))))
    return np.concatenate(found)
