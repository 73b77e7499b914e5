"""Least constraint of eight lanes at once, where none of them is near a singular position.

The steps are those of `projection`, on vectors, with one order of the rows for all lanes: the next one is that of which
most is left in the lane where least is. Rows of which nothing is left in any lane are redundant. Where little is left,
or in some lanes only, a position is near a singular one, and the lanes go one by one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT, heaviside, larger, least, load, root, spread, store
from shoal.mechanics.constraints import Constraints
from shoal.mechanics.least.projection import NOTHING, TIE
from shoal.mechanics.numerics.tile import Array, Index

APART = 1e-3
"""What must be left of an independent row, as a part of its length, in every lane."""
ALONE = -1
"""The rank of rows that go lane by lane."""


class GroupWork(NamedTuple):
    """Room for eight lanes, all (..., 8).

    rows: (constraints, unknowns). triangle: (constraints, constraints), by basis row and constraint. norms, left,
    wanted, multiplier: by constraint, left being squares of lengths. y: (unknowns,). order: of the constraints.
    """

    rows: Array
    triangle: Array
    norms: Array
    left: Array
    wanted: Array
    multiplier: Array
    y: Array
    order: Index


def room(width: int, count: int, unknowns: int) -> GroupWork:
    """Room as arrays, for no group where there is a single lane."""
    lanes = len(EIGHT) if width >= len(EIGHT) else 0
    sizes = count * unknowns, count * count, count, count, count, count, unknowns
    rows, triangle, norms, left, wanted, multiplier, y = (np.zeros(size * lanes) for size in sizes)
    return GroupWork(rows, triangle, norms, left, wanted, multiplier, y, np.zeros(count, dtype=np.int64))


@njit(error_model="numpy", forceinline=True)
def _dot(n: int, x: Array, one: int, y: Array, other: int) -> Any:
    """x . y of rows that begin at these entries, in two sums, which do not wait for each other."""
    first, second = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    for i in range(0, n - n % 2, 2):
        at = len(EIGHT) * i
        first = first + load(EIGHT, x, one + at) * load(EIGHT, y, other + at)
        at += len(EIGHT)
        second = second + load(EIGHT, x, one + at) * load(EIGHT, y, other + at)
    if n % 2 == 1:
        at = len(EIGHT) * (n - 1)
        first = first + load(EIGHT, x, one + at) * load(EIGHT, y, other + at)
    return first + second


@njit(error_model="numpy", forceinline=True)
def _add(n: int, y: Array, other: int, factor: Any, x: Array, one: int) -> Any:
    """y += factor x; returns y . y."""
    square = spread(EIGHT, 0.0)
    for i in range(n):
        at = len(EIGHT) * i
        value = load(EIGHT, y, other + at) + factor * load(EIGHT, x, one + at)
        store(y, other + at, value)
        square = square + value * value
    return square


@njit(cache=True, error_model="numpy")
def orthonormalise(w: GroupWork, count: int, n: int, width: int, lane: int, given: Array, tolerance: float) -> int:
    """Make rows, given as (constraints * unknowns, width) from a lane on, an orthonormal basis; their rank, or ALONE.

    tolerance: that of a singular position, as in `projection.orthonormalise`.
    """
    e, apart = len(EIGHT), max(APART, tolerance) ** 2
    for k in range(count):
        square = spread(EIGHT, 0.0)
        for i in range(n):
            value = load(EIGHT, given, (k * n + i) * width + lane)
            store(w.rows, (k * n + i) * e, value)
            square = square + value * value
        if not least(square) > 0.0:
            return ALONE
        norm = root(square)
        shrink = 1.0 / norm
        for i in range(n):
            store(w.rows, (k * n + i) * e, shrink * load(EIGHT, w.rows, (k * n + i) * e))
        store(w.norms, k * e, norm)
        store(w.left, k * e, spread(EIGHT, 1.0))
        w.order[k] = k
    for k in range(count):
        place, most = k, -1.0
        for j in range(k, count):
            length = least(load(EIGHT, w.left, w.order[j] * e))
            if length > TIE * most:
                place, most = j, length
        if not most > apart:
            return k if _are_gone(w, k, count, tolerance) else ALONE
        row = w.order[place]
        w.order[place], w.order[k] = w.order[k], row
        here = row * n * e
        square = load(EIGHT, w.left, row * e)
        for j in range(k):  # again, so that round-off of the first time does not stay
            basis = w.order[j] * n * e
            more = _dot(n, w.rows, basis, w.rows, here)
            entry = (j * count + row) * e
            store(w.triangle, entry, load(EIGHT, w.triangle, entry) + more)
            square = _add(n, w.rows, here, -more, w.rows, basis)
        length = root(square)
        store(w.triangle, (k * count + row) * e, length)
        shrink = 1.0 / length
        for i in range(n):
            store(w.rows, here + i * e, shrink * load(EIGHT, w.rows, here + i * e))
        for j in range(k + 1, count):
            other = w.order[j]
            part = _dot(n, w.rows, here, w.rows, other * n * e)
            store(w.triangle, (k * count + other) * e, part)
            store(w.left, other * e, _add(n, w.rows, other * n * e, -part, w.rows, here))
    return count


@njit(cache=True, error_model="numpy")
def raise_closeness(w: GroupWork, rank: int, count: int, lane: int, closeness: Array) -> None:
    """Raise the inverse square of the smallest distance from singular, (width,), to that of the last basis row."""
    if rank > 0:
        length = load(EIGHT, w.triangle, ((rank - 1) * count + w.order[rank - 1]) * len(EIGHT))
        store(closeness, lane, larger(load(EIGHT, closeness, lane), 1.0 / (length * length)))


@njit(error_model="numpy", forceinline=True)
def _are_gone(w: GroupWork, rank: int, count: int, tolerance: float) -> bool:
    """Return whether nothing is left of the rows beyond a rank in any lane."""
    most = spread(EIGHT, 0.0)
    for j in range(rank, count):
        most = larger(most, load(EIGHT, w.left, w.order[j] * len(EIGHT)))
    return least(-most) >= -(tolerance**2)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def third_derivative(
    c: Constraints,
    w: GroupWork,
    rank: int,
    number: int,
    n: int,
    width: int,
    lane: int,
    v: Array,
    turning: Array,
    still: float,
    out: Array,
) -> bool:
    """The row by the third derivatives that a dependent row adds, (unknowns, width); whether it vanishes in all lanes.

    turning: dC_q/dt (entries, width) of the rates v. still: see `many.STILL`.
    """
    e = len(EIGHT)
    _depend(w, rank, c.size, number)
    for i in range(n):
        store(w.y, i * e, spread(EIGHT, 0.0))
    pace, part = spread(EIGHT, 0.0), 0
    for k in range(c.size):
        weight, fastest = load(EIGHT, w.wanted, k * e), spread(EIGHT, 0.0)
        for entry in range(c.entry[k], c.entry[k + 1]):
            at, change = c.column[entry] * e, load(EIGHT, turning, entry * width + lane)
            store(w.y, at, load(EIGHT, w.y, at) + 3.0 * weight * change)
            fastest = larger(fastest, load(EIGHT, v, c.column[entry] * width + lane))
        while part < c.parts and c.target[part] < c.entry[k + 1]:
            if c.source[part] >= 0:
                each = weight * load(EIGHT, c.coefficient, part * width + lane)
                pace = pace + larger(each, each) * fastest
            part += 1
    for i in range(n):
        store(out, i * width + lane, load(EIGHT, w.y, i * e))
    square, limit = _dot(n, w.y, 0, w.y, 0), still * pace
    return least(limit * limit - square) >= 0.0  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def depends(w: GroupWork, rank: int, n: int, width: int, lane: int, row: Array, tolerance: float) -> bool:
    """Return whether a row, (unknowns, width), depends on the basis in all lanes, as in `projection.extend`."""
    e, square = len(EIGHT), spread(EIGHT, 0.0)
    for i in range(n):
        value = load(EIGHT, row, i * width + lane)
        store(w.y, i * e, value)
        square = square + value * value
    left = square
    for _ in range(2):
        for j in range(rank):
            basis = w.order[j] * n * e
            left = _add(n, w.y, 0, -_dot(n, w.rows, basis, w.y, 0), w.rows, basis)
    return least((tolerance * tolerance) * square - left) >= 0.0  # type: ignore[no-any-return]


@njit(error_model="numpy", forceinline=True)
def _depend(w: GroupWork, rank: int, count: int, number: int) -> None:
    """The combination of rows that vanishes with the dependent row order[number], by constraint into w.wanted."""
    e, row = len(EIGHT), w.order[number]
    for k in range(count):
        store(w.wanted, k * e, spread(EIGHT, 0.0))
    store(w.wanted, row * e, spread(EIGHT, 1.0))
    for k in range(rank - 1, -1, -1):
        total = load(EIGHT, w.triangle, (k * count + row) * e)
        for j in range(k + 1, rank):
            other = w.order[j]
            total = total + load(EIGHT, w.triangle, (k * count + other) * e) * load(EIGHT, w.wanted, other * e)
        store(w.wanted, w.order[k] * e, -total / load(EIGHT, w.triangle, (k * count + w.order[k]) * e))
    largest = spread(EIGHT, 0.0)
    for k in range(count):
        largest = larger(largest, load(EIGHT, w.wanted, k * e))
    for k in range(count):
        share = load(EIGHT, w.wanted, k * e)
        counts = heaviside(larger(share, share) - NOTHING * largest)
        store(w.wanted, k * e, counts * share / load(EIGHT, w.norms, k * e))


@njit(cache=True, error_model="numpy")
def move(w: GroupWork, rank: int, count: int, n: int, width: int, lane: int, gap: Array, y: Array) -> None:
    """Change y by the least norm so that row . y = -gap; gap: (constraints, width), y: (unknowns, width).

    What changes along the basis is left in w.wanted.
    """
    e = len(EIGHT)
    for i in range(n):
        store(w.y, i * e, load(EIGHT, y, i * width + lane))
    for k in range(rank):
        row = w.order[k]
        total = -load(EIGHT, gap, row * width + lane) / load(EIGHT, w.norms, row * e)
        for j in range(k):
            total = total - load(EIGHT, w.triangle, (j * count + row) * e) * load(EIGHT, w.multiplier, j * e)
        store(w.multiplier, k * e, total / load(EIGHT, w.triangle, (k * count + row) * e))
    for j in range(rank):
        basis = w.order[j] * n * e
        change = load(EIGHT, w.multiplier, j * e) - _dot(n, w.rows, basis, w.y, 0)
        store(w.wanted, j * e, change)
        _add(n, w.y, 0, change, w.rows, basis)
    for i in range(n):
        store(y, i * width + lane, load(EIGHT, w.y, i * e))


@njit(cache=True, error_model="numpy")
def take_out(w: GroupWork, rank: int, n: int, width: int, lane: int, y: Array) -> None:
    """Take what is along the basis out of y, (unknowns, width), and off the change along the basis in w.wanted."""
    e = len(EIGHT)
    for i in range(n):
        store(w.y, i * e, load(EIGHT, y, i * width + lane))
    for j in range(rank):
        basis = w.order[j] * n * e
        part = _dot(n, w.rows, basis, w.y, 0)
        store(w.wanted, j * e, load(EIGHT, w.wanted, j * e) - part)
        _add(n, w.y, 0, -part, w.rows, basis)
    for i in range(n):
        store(y, i * width + lane, load(EIGHT, w.y, i * e))


@njit(cache=True, error_model="numpy")
def multipliers(w: GroupWork, rank: int, count: int, width: int, lane: int, out: Array) -> None:
    """lambda, (constraints, width), with sum of lambda * row = -(change along the basis), that of `move`."""
    e = len(EIGHT)
    for k in range(rank, count):
        store(out, w.order[k] * width + lane, spread(EIGHT, 0.0))
    for k in range(rank - 1, -1, -1):
        row = w.order[k]
        total = -load(EIGHT, w.wanted, k * e)
        for j in range(k + 1, rank):
            # Multipliers are times their norms here.
            other = w.order[j]
            total = total - load(EIGHT, w.triangle, (k * count + other) * e) * load(EIGHT, w.multiplier, other * e)
        total = total / load(EIGHT, w.triangle, (k * count + row) * e)
        store(w.multiplier, row * e, total)
        store(out, row * width + lane, total / load(EIGHT, w.norms, row * e))
