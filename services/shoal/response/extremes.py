"""Least and largest values of a surrogate over the box of standardised variables, column by column.

Places all over the box are scanned, then searches go downhill from the best of them by quasi-Newton steps (BFGS:
Nocedal and Wright, Numerical Optimization, 2006, chapter 6) that are cut off at the faces of the box, along which they
may go on (Bertsekas, Projected Newton methods for optimization problems with simple constraints, SIAM Journal on
Control and Optimization 20, 1982). They follow narrow valleys that lie across the axes, such as those of equal phase at
long times.

Where most parameters are at an end of theirs and one decides the phase, there is a valley for every cycle along that
axis, all nearly as deep and too narrow for a scan of the whole box. Each has its deepest place elsewhere along it, so
that one that is less deep here may be the deepest there: several are followed down.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np
from scipy.stats import qmc

from shoal.response.inputs import IntArray
from shoal.trajectory import Array

DIFFERENCE = 1e-6
"""Step of central differences in xi: about the cube root of the rounding unit."""
FIRST_LENGTH = 0.1
"""Length of the first step."""
DESCENTS = 30
"""Quasi-Newton steps, at most."""
SETTLED = 1e-12
"""Relative gain at which a descent ends."""
BACK = 0.25
"""Factor on a step that leads uphill (backtracking)."""

Objective = Callable[[Array, IntArray], Array]
"""Places, (places, parameters), and which searches they belong to, (places,), to values, (places,)."""


def climb_down(objective: Objective, at: Array, value: Array) -> None:
    """Improve places, (searches, parameters), and values, (searches,), in place."""
    count = len(at)
    every = np.arange(count)
    slope, curved = _slopes(objective, at, value, every)
    inverse = _begun(slope, curved)
    longest, size = np.full(count, np.inf), np.abs(value).max(initial=0.0)
    for _ in range(DESCENTS):
        some = every
        x, g, h = at[some], slope[some], inverse[some]
        bound = ((x <= -1) & (g > 0)) | ((x >= 1) & (g < 0))
        free = np.where(bound, 0.0, g)
        step = np.where(bound, 0.0, -np.einsum("nij,nj->ni", h, free))
        uphill = np.einsum("ni,ni->n", step, free) >= 0
        if uphill.any():
            inverse[some[uphill]] = _begun(free[uphill], curved[some[uphill]])
            step[uphill] = -np.einsum("nij,nj->ni", inverse[some[uphill]], free[uphill])
        length = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, longest[some] / np.maximum(length, 1e-300))[:, None]
        new, found = _tried(objective, x, step, g, value[some], some)
        better = found < value[some]
        gain = value[some] - found
        longest[some] = np.where(better, np.inf, BACK * np.minimum(length, longest[some]))
        moved = some[better]
        if len(moved):
            before, old = at[moved].copy(), slope[moved].copy()
            at[moved], value[moved] = new[better], found[better]
            slope[moved], curved[moved] = _slopes(objective, at[moved], value[moved], moved)
            _learn(inverse, moved, at[moved] - before, slope[moved] - old)
        going = np.where(better, gain > SETTLED * size, longest[some] > DIFFERENCE)
        every = some[going & (length > DIFFERENCE**2)]
        if not len(every):
            return


def _slopes(objective: Objective, at: Array, value: Array, searches: IntArray) -> tuple[Array, Array]:
    """Return slopes by differences of second order, inwards at a face, and curvatures along each axis.

    Those of first order are off by half a difference times the curvature: across a narrow valley more than what is
    gained along it.
    """
    parameters = at.shape[1]
    one = np.where(at - DIFFERENCE < -1, DIFFERENCE, -DIFFERENCE)
    other = np.where(np.abs(at - one) > 1, 2 * one, -one)
    ways = np.stack([one, other])
    # All places that are needed, (ways, axes, searches, parameters), at one go.
    beside = at + ways.transpose(0, 2, 1)[..., None] * np.eye(parameters)[:, None]
    answers = objective(beside.reshape(-1, parameters), np.tile(searches, 2 * parameters))
    chords = (answers.reshape(2, parameters, len(at)).transpose(0, 2, 1) - value[:, None]) / ways
    found = (chords[0] * other - chords[1] * one) / (other - one)
    return found, 2 * (chords[1] - chords[0]) / (other - one)


def _begun(slope: Array, curved: Array) -> Array:
    """Inverse curvatures: a first step has its length, or ends where an axis that is more curved is lowest."""
    size = np.linalg.norm(slope, axis=1, keepdims=True)
    scale = np.divide(FIRST_LENGTH, size, out=np.zeros_like(size), where=size > 0)
    scale = np.divide(scale, np.maximum(scale * curved, 1.0))
    return np.asarray(scale[:, :, None] * np.eye(slope.shape[1]))


def _tried(
    objective: Objective,
    x: Array,
    step: Array,
    slope: Array,
    value: Array,
    searches: IntArray,
) -> tuple[Array, Array]:
    """The best of a whole step and of the lowest point of the parabola along it."""
    new = np.clip(x + step, -1, 1)
    found = objective(new, searches)
    taken = new - x
    falls = np.einsum("ni,ni->n", slope, taken)
    curved = found - value - falls
    share = np.divide(-falls, 2 * curved, out=np.full_like(falls, 2.0), where=curved > 0)
    other = np.clip(x + np.clip(share, 0.05, 3.0)[:, None] * taken, -1, 1)
    also = objective(other, searches)
    lower = also < found
    return np.where(lower[:, None], other, new), np.where(lower, also, found)


def _learn(inverse: Array, searches: IntArray, moved: Array, turned: Array) -> None:
    """Enter a step and the change of slope along it into inverse curvatures."""
    along = np.einsum("ni,ni->n", moved, turned)
    curved = along > 1e-10 * np.linalg.norm(moved, axis=1) * np.linalg.norm(turned, axis=1)
    searches, moved, turned, along = searches[curved], moved[curved], turned[curved], along[curved]
    h = inverse[searches]
    image = np.einsum("nij,nj->ni", h, turned)
    whole = 1 + np.einsum("ni,ni->n", turned, image) / along
    outer = np.einsum("ni,nj->nij", image, moved)
    inverse[searches] = (
        h
        + (whole / along)[:, None, None] * np.einsum("ni,nj->nij", moved, moved)
        - (outer + np.swapaxes(outer, 1, 2)) / along[:, None, None]
    )


LINE = 129
"""Places along each axis."""
VALLEY_STEPS = 0.25, 0.02
"""Lengths, in the distance of two places, in which each valley is refined."""
FOLLOWED = 4
"""Valleys along each axis that are followed, beside that of the place itself."""
OWN_VALLEY = 0.25 * 2 / (LINE - 1)
"""A valley so near is the place's own."""
BLOCK = 200_000
"""Places that are evaluated together."""


def search_valleys(objective: Objective, best: Array, at: Array) -> None:
    """Improve values, (searches,), and places, (searches, parameters), in place: downhill from the deepest valleys that
    are predicted along each axis by the parabola through three neighbours.
    """
    line = np.linspace(-1, 1, LINE)
    block = max(1, BLOCK // LINE)
    for axis in range(at.shape[1]):
        for k in range(0, len(at), block):
            some: IntArray = np.arange(k, min(k + block, len(at)))
            _search_axis(objective, best, at, axis, line, some)


def _search_axis(objective: Objective, best: Array, at: Array, axis: int, line: Array, some: IntArray) -> None:
    """Search further valleys of some searches along one axis."""
    places = np.repeat(at[some], LINE, axis=0)
    places[:, axis] = np.tile(line, len(some))
    search, where = _valleys(objective(places, np.repeat(some, LINE)).reshape(len(some), LINE), line)
    other = np.abs(where - at[some[search], axis]) > OWN_VALLEY
    search, where = some[search[other]], where[other]
    if not len(search):
        return
    for width in VALLEY_STEPS:
        three = np.repeat(at[search][None], 3, axis=0)
        three[:, :, axis] = np.clip(where + width * (line[1] - line[0]) * np.array([[-1], [0], [1]]), -1, 1)
        sides = objective(three.reshape(-1, at.shape[1]), np.tile(search, 3)).reshape(3, -1)
        where, depth = _vertex(sides, three[:, :, axis])
    order = np.lexsort((depth, search))
    search, where = search[order], where[order]
    chosen = np.arange(len(search)) - np.searchsorted(search, search) < FOLLOWED
    search, place = search[chosen], at[search[chosen]]
    place[:, axis] = np.clip(where[chosen], -1, 1)
    found = objective(place, search)
    climb_down(lambda x, searches: objective(x, search[searches]), place, found)
    order = np.argsort(-found, kind="stable")
    order = order[found[order] < best[search[order]]]
    # The deepest of one search is entered last.
    best[search[order]], at[search[order]] = found[order], place[order]


def _valleys(value: Array, line: Array) -> tuple[IntArray, Array]:
    """Return the search and the approximate place of every valley, (valleys,) each; value: (searches, places)."""
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


SCANNED, FEWER = 2048, 512
"""Quasi-random places that are scanned within the box, and as many on its faces, beside corners and a grid; while a
study goes on, fewer and no grid."""
MOST_CORNERS = 10
"""Parameters up to which all corners are scanned."""
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
    """Surrogate of one column at each place."""

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return the column of each place, (places,)."""
        ...


class Surrogate(Each, Protocol):
    """Answers at any place without a run."""

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        ...


@dataclass(frozen=True)
class Extremes:
    """lower, upper: (columns,); at_lower, at_upper: the standardised variables there, (columns, parameters); doubt:
    what one of the last rounds of searches still gained, (columns,)
    """

    lower: Array
    upper: Array
    at_lower: Array
    at_upper: Array
    doubt: Array


def corners(parameters: int) -> Array:
    """Return all 2^p corners of the box."""
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
        scanned = np.concatenate([places(parameters, (seed, further)), np.unique(at.reshape(-1, parameters), axis=0)])
        also, there = _round(surrogate, _apart(scanned, starts), columns)
        _search_sides(surrogate, also, there)
        gained = np.vstack([gained, np.maximum(best - also, 0.0).max(axis=0)])[-IDLE:]
        best, at = np.minimum(best, also), np.where((also < best)[:, :, None], there, at)
        if len(gained) == IDLE and np.all(gained <= settled):
            break
    return Extremes(best[0], -best[1], at[0], at[1], gained.max(axis=0, initial=0.0))


def _apart(scanned: Array, starts: int) -> list[Array]:
    """Split places into parts: every n-th place of Sobol's sequence lies in one of its own, n a power of two."""
    return [scanned[start::starts] for start in range(starts)]


def _round(surrogate: Surrogate, sets: Sequence[Array], columns: int) -> tuple[Array, Array]:
    """The least of both sides, (2, columns), the upper one with its sign turned, and where.

    It is sought from the best place of each set, (places, parameters).
    """
    starts, parameters = len(sets), sets[0].shape[1]
    best = np.full((starts, 2, columns), np.inf)
    at = np.zeros((starts, 2, columns, parameters))
    every = np.arange(columns)
    for start, mine in enumerate(sets):
        for some, answers in in_parts(surrogate, mine, columns):
            found = np.ascontiguousarray(answers.T)
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


def in_parts(surrogate: Surrogate, scanned: Array, columns: int) -> Iterator[tuple[slice, Array]]:
    """Yield answers of a surrogate, (places, columns), in blocks that fit the processor's cache."""
    whole, part = (max(1, numbers // max(columns, 1)) for numbers in (HELD, AT_HAND))
    for k in range(0, len(scanned), whole):
        answers = surrogate(scanned[k : k + whole])
        for j in range(0, len(answers), part):
            yield slice(k + j, k + min(j + part, len(answers))), answers[j : j + part]


def _search_sides(surrogate: Surrogate, best: Array, at: Array) -> None:
    """Improve both sides by other valleys, in place."""
    columns = best.shape[1]
    every, signs = np.tile(np.arange(columns), 2), np.repeat([1.0, -1.0], columns)
    search_valleys(_signed(surrogate, signs, every), best.reshape(-1), at.reshape(-1, at.shape[2]))


def _signed(surrogate: Surrogate, signs: Array, columns: IntArray) -> Objective:
    return lambda at, searches: signs[searches] * _each(surrogate, at, columns[searches])


def _each(surrogate: Each, at: Array, columns: IntArray) -> Array:
    """Return one column at each place, in blocks that fit the processor's cache."""
    parts = [slice(k, k + PLACES) for k in range(0, max(len(at), 1), PLACES)]
    return np.concatenate([surrogate.each(at[part], columns[part]) for part in parts])


def along(
    surrogate: Each, sign: Array | float, axis: int, step: float, best: Array, at: Array, every: IntArray
) -> None:
    """Improve all columns along one axis: at both sides and where the parabola through the three is least."""
    here, sides = best.copy(), np.stack([at, at])
    sides[:, :, axis] = np.clip(at[:, axis] + np.array([[-step], [step]]), -1, 1)
    answers = sign * _each(surrogate, np.concatenate(sides), np.tile(every, 2)).reshape(2, -1)
    curved = answers[0] - 2 * here + answers[1]
    shift = np.divide(answers[0] - answers[1], 2 * curved, out=np.zeros_like(here), where=curved > 0)
    lowest = at.copy()
    lowest[:, axis] = np.clip(lowest[:, axis] + step * np.clip(shift, -2, 2), -1, 1)
    tried = [(sides[0], answers[0]), (sides[1], answers[1]), (lowest, sign * _each(surrogate, lowest, every))]
    for place, value in tried:
        better = value < best
        best[better], at[better] = value[better], place[better]


def places(parameters: int, seed: int | tuple[int, int], *, rough: bool = False) -> Array:
    """Return places all over the box and its faces and edges, its corners among them."""
    drawn = 2 * qmc.Sobol(parameters, rng=np.random.default_rng(seed)).random(FEWER if rough else SCANNED) - 1
    found = [drawn, np.clip(2 * drawn, -1, 1), np.zeros((1, parameters)), np.sign(drawn[:FEWER])]
    if parameters <= MOST_CORNERS:
        found.append(corners(parameters))
    if parameters in GRID and not rough:
        axis = np.linspace(-1, 1, GRID[parameters])
        found.append(np.array(list(product(axis, repeat=parameters))))
    return np.concatenate(found)
