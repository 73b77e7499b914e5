"""Where a surrogate is smallest and largest over the box of germs, column by column."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np
from scipy.stats import qmc

from shoal.response.climb import Objective, climb_down
from shoal.trajectory import Array

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
SCANNED = 4096
"""Quasi-random places that are looked at, beside corners and a grid."""
MOST_CORNERS = 10
"""Parameters up to which all corners are looked at."""
ROUNDS, IDLE = 24, 4
"""Of searches, at most, and how many of them in a row have to find nothing new."""
GRID = {1: 1001, 2: 41, 3: 15, 4: 7}
"""Places along each axis of the grid, by the number of parameters."""
STEPS = 0.25, 0.1
"""Of the search along each axis from the best place that was scanned, before it goes downhill by slopes."""


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
    """lower, upper: (columns,); at_lower, at_upper: the germs there, (columns, parameters); doubt: what one of the
    last rounds of searches still gained, (columns,)
    """

    lower: Array
    upper: Array
    at_lower: Array
    at_upper: Array
    doubt: Array


def corners(parameters: int) -> Array:
    """All 2^p corners of the box."""
    return np.array(list(product((-1.0, 1.0), repeat=parameters)))


def extremes(
    surrogate: Surrogate, parameters: int, columns: int, seed: int = 0, starts: int = 1, settled: Array | None = None
) -> Extremes:
    """The extremes over [-1, 1]^p: scanned, then sought along each axis and by slopes.

    starts: how many places are sought from, the best of as many parts of what is scanned; settled: what a round of
    searches may still gain, (columns,): before that further rounds are made from elsewhere, None: one is enough
    """
    best, at = _round(surrogate, places(parameters, seed), columns, starts)
    gained = np.zeros((0, columns))
    if settled is None:
        return Extremes(best[0], -best[1], at[0], at[1], np.zeros(columns))
    for further in range(1, ROUNDS):
        also, there = _round(surrogate, places(parameters, (seed, further)), columns, starts)
        gained = np.vstack([gained, np.maximum(best - also, 0.0).max(axis=0)])[-IDLE:]
        at = np.where((also < best)[:, :, None], there, at)
        best = np.minimum(best, also)
        if len(gained) == IDLE and np.all(gained <= settled):
            break
    return Extremes(best[0], -best[1], at[0], at[1], gained.max(axis=0, initial=0.0))


def _round(surrogate: Surrogate, looked_at: Array, columns: int, starts: int) -> tuple[Array, Array]:
    """The least of both sides, (2, columns), the upper one with its sign turned, and where."""
    parameters = looked_at.shape[1]
    best = np.full((2, starts, columns), np.inf)
    at = np.zeros((2, starts, columns, parameters))
    block = max(1, 4_000_000 // max(columns, 1))
    every = np.arange(columns)
    for start in range(starts):
        # Every n-th place of Sobol's sequence lies in a part of the box of its own, where n is a power of two.
        mine = looked_at[start::starts]
        for k in range(0, len(mine), block):
            some = mine[k : k + block]
            found = surrogate(some)
            for side, sign in enumerate((1.0, -1.0)):
                least = np.argmin(sign * found, axis=0)
                value = sign * found[least, every]
                better = value < best[side, start]
                best[side, start, better], at[side, start, better] = value[better], some[least][better]
    which = np.tile(every, starts)
    for side, sign in enumerate((1.0, -1.0)):
        value, place = best[side].reshape(-1), at[side].reshape(-1, parameters)
        for step in STEPS:
            for axis in range(parameters):
                along(surrogate, sign, axis, step, value, place, which)
        climb_down(_signed(surrogate, sign, which), place, value)
        best[side], at[side] = value.reshape(starts, columns), place.reshape(starts, columns, parameters)
    first = best.argmin(axis=1)
    return np.take_along_axis(best, first[:, None], 1)[:, 0], np.take_along_axis(at, first[:, None, :, None], 1)[:, 0]


def _signed(surrogate: Surrogate, sign: float, columns: IntArray) -> Objective:
    return lambda at, searches: sign * surrogate.each(at, columns[searches])


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


def places(parameters: int, seed: int | tuple[int, int]) -> Array:
    """Where a surrogate is looked at: all over the box, its corners among them."""
    scanned = 2 * qmc.Sobol(parameters, rng=np.random.default_rng(seed)).random(SCANNED) - 1
    found = [scanned, np.zeros((1, parameters)), np.sign(scanned[: SCANNED // 8])]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    if parameters in GRID:
        axis = np.linspace(-1, 1, GRID[parameters])
        found.append(np.array(list(product(axis, repeat=parameters))))
    return np.concatenate(found)
