"""Substitution two rows at a time, with one factor for all lanes.

Rows of a node depend on the same others: taken together they load these once. Where only one of two rows has an entry
the other gets a zero. With an odd number of rows the first is alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.simd import load, store
from shoal.mechanics.numerics.sparse import Pattern
from shoal.mechanics.numerics.tile import Array, Index, Tile


class RowPairs(NamedTuple):
    """A factor L D L' by pairs q of the rows 2 q - odd and 2 q - odd + 1; without the first of pair 0 if odd.

    size: number of pairs. For the forward substitution: entries before[q] to before[q + 1] are columns `left` of L with
    a number for each row of the pair; for the backward one after[q] to after[q + 1] are its rows `below`, with a number
    for each column of the pair.
    own: L between the rows of a pair; diagonal: 1/D, two a pair.
    """

    size: int
    odd: int
    before: Index
    left: Index
    lefts: Array
    after: Index
    below: Index
    belows: Array
    own: Array
    diagonal: Array


def paired(pattern: Pattern, factor: Array) -> RowPairs:
    """The factor that `sparse.factor` left in (slots,)."""
    n = pattern.size
    odd, count = n % 2, (n + 1) // 2
    column, row, values = np.repeat(np.arange(n), np.diff(pattern.column)), pattern.row.astype(np.int64), factor[n:]
    same = (row + odd) // 2 == (column + odd) // 2
    own, diagonal = np.zeros(count), np.zeros(2 * count)
    own[(row[same] + odd) // 2], diagonal[odd:] = values[same], factor[:n]
    before, left, lefts = _grouped(row[~same] + odd, column[~same], values[~same], count, n)
    after, below, belows = _grouped(column[~same] + odd, row[~same], values[~same], count, n)
    return RowPairs(count, odd, before, left, lefts, after, below, belows, own, diagonal)


def _grouped(mine: Index, other: Index, values: Array, count: int, n: int) -> tuple[Index, Index, Array]:
    """By pairs: where their entries begin, the other index of these, and two numbers for each."""
    keys, place = np.unique(mine // 2 * n + other, return_inverse=True)
    numbers = np.zeros((len(keys), 2))
    numbers[place, mine % 2] = values
    begins = np.searchsorted(keys, n * np.arange(count + 1))
    return begins.astype(np.int64), (keys % max(n, 1)).astype(np.int32), numbers.ravel()


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def solve(tile: Tile, pairs: RowPairs, x: Array, width: int) -> None:
    """Replace the right-hand side in x, (rows, width), by the solution; width: a multiple of the tile's. Pointers.

    A row is taken tile by tile: the parts do not wait for each other, and each fits into the processor's registers.
    """
    odd = pairs.odd
    for q in range(odd, pairs.size):
        at = (2 * q - odd) * width
        for part in range(0, width, len(tile)):
            first, second = load(tile, x, at + part), load(tile, x, at + width + part)
            for p in range(pairs.before[q], pairs.before[q + 1]):
                known = load(tile, x, pairs.left[p] * width + part)
                first, second = first - pairs.lefts[2 * p] * known, second - pairs.lefts[2 * p + 1] * known
            store(x, at + part, first)
            store(x, at + width + part, second - pairs.own[q] * first)
    for q in range(pairs.size - 1, odd - 1, -1):
        at = (2 * q - odd) * width
        for part in range(0, width, len(tile)):
            first = pairs.diagonal[2 * q] * load(tile, x, at + part)
            second = pairs.diagonal[2 * q + 1] * load(tile, x, at + width + part)
            for p in range(pairs.after[q], pairs.after[q + 1]):
                known = load(tile, x, pairs.below[p] * width + part)
                first, second = first - pairs.belows[2 * p] * known, second - pairs.belows[2 * p + 1] * known
            store(x, at + part, first - pairs.own[q] * second)
            store(x, at + width + part, second)
    if odd:
        for part in range(0, width, len(tile)):
            alone = pairs.diagonal[1] * load(tile, x, part)
            for p in range(pairs.after[0], pairs.after[1]):
                alone = alone - pairs.belows[2 * p + 1] * load(tile, x, pairs.below[p] * width + part)
            store(x, part, alone)
