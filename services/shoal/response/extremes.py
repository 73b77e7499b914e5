"""Where a surrogate is smallest and largest over the box of germs, column by column."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np
from scipy.stats import qmc

from shoal.response.climb import Objective, climb_down
from shoal.response.inputs import IntArray
from shoal.response.valleys import beside
from shoal.trajectory import Array

SCANNED, FEWER = 2048, 512
"""Quasi-random places that are looked at within the box, and as many on its faces, beside corners and a grid; while a
study goes on, fewer and no grid."""
MOST_CORNERS = 10
"""Parameters up to which all corners are looked at."""
ROUNDS, IDLE = 24, 4
"""Of searches, at most, and how many of them in a row have to find nothing new."""
GRID = {1: 1001, 2: 41, 3: 15, 4: 7}
"""Places along each axis of the grid, by the number of parameters."""
HELD, AT_HAND = 4_000_000, 2**17
"""Numbers of a surrogate that are asked for and that are compared at once."""
PLACES = 2048
"""At once, where each is asked for one column."""
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
    surrogate: Surrogate,
    parameters: int,
    columns: int,
    seed: int = 0,
    starts: int = 1,
    settled: Array | None = None,
    *,
    rough: bool = False,
    known: Array | None = None,
) -> Extremes:
    """The extremes over [-1, 1]^p: scanned, then sought along each axis and by slopes.

    starts: how many places are sought from, the best of as many parts of what is scanned; settled: what a round of
    searches may still gain, (columns,): before that further rounds are made from elsewhere, None: one is enough; rough:
    fewer places are scanned; known: places from the best of which it is sought as well, (places, parameters): nothing
    that is scanned may lie in their valley, nor they in that of what is scanned
    """
    sets = _apart(places(parameters, seed, rough=rough), starts)
    best, at = _round(surrogate, sets if known is None else [*sets, known], columns)
    gained = np.zeros((0, columns))
    if settled is None:
        return Extremes(best[0], -best[1], at[0], at[1], np.zeros(columns))
    for further in range(1, ROUNDS):
        # The place of an extreme at one instant is often near that of another.
        looked_at = np.concatenate([places(parameters, (seed, further)), np.unique(at.reshape(-1, parameters), axis=0)])
        also, there = _round(surrogate, _apart(looked_at, starts), columns)
        _beside(surrogate, also, there)
        gained = np.vstack([gained, np.maximum(best - also, 0.0).max(axis=0)])[-IDLE:]
        best, at = np.minimum(best, also), np.where((also < best)[:, :, None], there, at)
        if len(gained) == IDLE and np.all(gained <= settled):
            break
    return Extremes(best[0], -best[1], at[0], at[1], gained.max(axis=0, initial=0.0))


def _apart(looked_at: Array, starts: int) -> list[Array]:
    """As many parts: every n-th place of Sobol's sequence lies in one of its own, where n is a power of two."""
    return [looked_at[start::starts] for start in range(starts)]


def _round(surrogate: Surrogate, sets: Sequence[Array], columns: int) -> tuple[Array, Array]:
    """The least of both sides, (2, columns), the upper one with its sign turned, and where.

    It is sought from the best place of each set, (places, parameters).
    """
    starts, parameters = len(sets), sets[0].shape[1]
    best = np.full((starts, 2, columns), np.inf)
    at = np.zeros((starts, 2, columns, parameters))
    every = np.arange(columns)
    for start, mine in enumerate(sets):
        for some, told in in_parts(surrogate, mine, columns):
            found = np.ascontiguousarray(told.T)
            for side, (sign, least) in enumerate(((1.0, found.argmin(axis=1)), (-1.0, found.argmax(axis=1)))):
                value = sign * found[every, least]
                better = value < best[start, side]
                best[start, side, better], at[start, side, better] = value[better], mine[some][least][better]
    which = np.tile(every, 2 * starts)
    signs = np.tile(np.repeat([1.0, -1.0], columns), starts)
    value, place = best.reshape(-1), at.reshape(-1, parameters)
    for step in STEPS:
        for axis in range(parameters):
            along(surrogate, signs, axis, step, value, place, which)
    climb_down(_signed(surrogate, signs, which), place, value)
    best, at = value.reshape(starts, 2, columns), place.reshape(starts, 2, columns, parameters)
    first = best.argmin(axis=0)[None]
    return np.take_along_axis(best, first, 0)[0], np.take_along_axis(at, first[..., None], 0)[0]


def in_parts(surrogate: Surrogate, looked_at: Array, columns: int) -> Iterator[tuple[slice, Array]]:
    """What a surrogate says at some of the places, (places, columns): so many at once as a processor has at hand."""
    whole, part = (max(1, numbers // max(columns, 1)) for numbers in (HELD, AT_HAND))
    for k in range(0, len(looked_at), whole):
        told = surrogate(looked_at[k : k + whole])
        for j in range(0, len(told), part):
            yield slice(k + j, k + min(j + part, len(told))), told[j : j + part]


def _beside(surrogate: Surrogate, best: Array, at: Array) -> None:
    """Improve both sides by other valleys, in place."""
    columns = best.shape[1]
    every, signs = np.tile(np.arange(columns), 2), np.repeat([1.0, -1.0], columns)
    beside(_signed(surrogate, signs, every), best.reshape(-1), at.reshape(-1, at.shape[2]))


def _signed(surrogate: Surrogate, signs: Array, columns: IntArray) -> Objective:
    return lambda at, searches: signs[searches] * _each(surrogate, at, columns[searches])


def _each(surrogate: Each, at: Array, columns: IntArray) -> Array:
    """One column at each place, as many at once as a processor has at hand."""
    parts = [slice(k, k + PLACES) for k in range(0, max(len(at), 1), PLACES)]
    return np.concatenate([surrogate.each(at[part], columns[part]) for part in parts])


def along(
    surrogate: Each, sign: Array | float, axis: int, step: float, best: Array, at: Array, every: IntArray
) -> None:
    """Improve all columns along one axis: at both sides and where the parabola through the three is least."""
    here, sides = best.copy(), np.stack([at, at])
    sides[:, :, axis] = np.clip(at[:, axis] + np.array([[-step], [step]]), -1, 1)
    told = sign * _each(surrogate, np.concatenate(sides), np.tile(every, 2)).reshape(2, -1)
    curved = told[0] - 2 * here + told[1]
    shift = np.divide(told[0] - told[1], 2 * curved, out=np.zeros_like(here), where=curved > 0)
    lowest = at.copy()
    lowest[:, axis] = np.clip(lowest[:, axis] + step * np.clip(shift, -2, 2), -1, 1)
    tried = [(sides[0], told[0]), (sides[1], told[1]), (lowest, sign * _each(surrogate, lowest, every))]
    for place, value in tried:
        better = value < best
        best[better], at[better] = value[better], place[better]


def places(parameters: int, seed: int | tuple[int, int], *, rough: bool = False) -> Array:
    """Where a surrogate is looked at: all over the box and its faces and edges, its corners among them."""
    drawn = 2 * qmc.Sobol(parameters, rng=np.random.default_rng(seed)).random(FEWER if rough else SCANNED) - 1
    found = [drawn, np.clip(2 * drawn, -1, 1), np.zeros((1, parameters)), np.sign(drawn[:FEWER])]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    if parameters in GRID and not rough:
        axis = np.linspace(-1, 1, GRID[parameters])
        found.append(np.array(list(product(axis, repeat=parameters))))
    return np.concatenate(found)
