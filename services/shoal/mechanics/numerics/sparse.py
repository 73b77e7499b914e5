"""Sparse LDL' factorisation of symmetric matrices with a fixed pattern, lane by lane.

The pattern is worked out once in Python (symbolic elimination); the compiled kernels then only
follow index lists, so factoring and solving cost what the pattern needs: linear in the number of
elements for chains.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit

from shoal.compile import simd
from shoal.compile.vector import add_product, copy, scale, subtract_dot
from shoal.mechanics.numerics.tile import Array, Index, Tile

if TYPE_CHECKING:
    import scipy.sparse


KEPT = 500
"""Rows of a matrix up to which its pattern is kept: runs side by side ask for it again, and it takes little memory."""


class Pattern(NamedTuple):
    """Lower triangle by columns, fill included. Slots 0..n-1 are the diagonal, then the columns in order.

    size: number of rows, n. column[k]:column[k+1] are the entries of column k, `row` their rows; entry p is slot n + p.
    Pairs pair[k]:pair[k+1] change slot `target` of column k, (i, k), by (i, j) and (k, j), j < k, in the slots left
    and right. The same entries by rows, for the forward substitution: slot[p] and other[p] (the column) of row i for
    p in across[i]:across[i+1]. by_column holds the slots in the order of the columns.
    """

    size: int
    column: Index
    row: Index
    pair: Index
    target: Index
    left: Index
    right: Index
    across: Index
    slot: Index
    other: Index
    by_column: Index

    @property
    def slots(self) -> int:
        """Length of a value array, per lane."""
        return self.size + len(self.row)


def analyse(size: int, entries: Iterable[tuple[int, int]]) -> tuple[Pattern, dict[tuple[int, int], int]]:
    """Pattern of the factor of a matrix with these entries, and the slot of each (row, column), row >= column.

    Small ones are kept and shared by all that ask for the same: they are not to be changed.
    """
    if size > KEPT:
        return _analysed(size, entries)
    return _kept(size, frozenset((i, j) for i, j in entries))


@lru_cache(maxsize=16)
def _kept(size: int, entries: frozenset[tuple[int, int]]) -> tuple[Pattern, dict[tuple[int, int], int]]:
    return _analysed(size, entries)


def _analysed(size: int, entries: Iterable[tuple[int, int]]) -> tuple[Pattern, dict[tuple[int, int], int]]:
    below: list[set[int]] = [set() for _ in range(size)]
    for i, j in entries:
        if i != j:
            below[min(i, j)].add(max(i, j))
    for k in range(size):
        if below[k]:
            parent = min(below[k])
            below[parent] |= below[k] - {parent}
    every = np.arange(size)
    counts = np.array([len(rows) for rows in below], dtype=np.int64)
    column = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
    row, owner = np.fromiter(chain.from_iterable(map(sorted, below)), np.int64), np.repeat(every, counts)
    by_row = np.argsort(row * size + owner)
    left, right = _pairs(column)
    order = np.argsort((row[right] * size + owner[left]) * size + row[left])
    left, right = left[order], right[order]
    target = np.searchsorted(owner * size + row, row[right] * size + row[left])
    pair = np.searchsorted(row[right], np.arange(size + 1))
    across = np.searchsorted(row[by_row], np.arange(size + 1))
    slot = {(k, k): k for k in range(size)}
    slot |= zip(zip(row.tolist(), owner.tolist(), strict=True), range(size, size + len(row)), strict=True)

    def short(values: Index) -> Index:
        """Long chains are limited by memory traffic."""
        return values.astype(np.int32)

    pattern = Pattern(
        size,
        column,
        short(row),
        pair,
        short(size + target),
        short(size + left),
        short(size + right),
        across,
        short(size + by_row),
        short(owner[by_row]),
        short(size + np.arange(len(row))),
    )
    return pattern, slot


def _pairs(column: Index) -> tuple[Index, Index]:
    """Every two entries of a column, the lower and the upper one of each pair."""
    counts = np.diff(column)
    lower, upper = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for count in np.unique(counts):
        one, other = np.triu_indices(count, 1)
        begin = column[:-1][counts == count][:, None]
        lower.append((begin + other).ravel())
        upper.append((begin + one).ravel())
    return np.concatenate(lower), np.concatenate(upper)


def matrix(pattern: Pattern, values: Array) -> scipy.sparse.csc_array:
    """The symmetric matrix of one lane whose lower triangle lies in the slots of a pattern."""
    import scipy.sparse

    n = pattern.size
    lower = scipy.sparse.csc_array((values[n:], pattern.row, pattern.column), shape=(n, n))
    return scipy.sparse.csc_array(lower + lower.T + scipy.sparse.diags_array(values[:n]))


def dense(pattern: Pattern, values: Array) -> Array:
    """The same as an array, (n, n)."""
    n = pattern.size
    full = np.zeros((n, n))
    full[pattern.row, np.repeat(np.arange(n), np.diff(pattern.column))] = values[n:]
    return full + full.T + np.diag(values[:n])


@njit(cache=True, error_model="numpy")
def factor(tile: Tile, pattern: Pattern, values: Array) -> None:
    """Replace the matrix (slots, lanes) by L below the diagonal and 1/D on it. Pointers."""
    for k in range(pattern.size):
        pivot = finish_row(tile, pattern, values, k)
        simd.store(values, k * len(tile), 1.0 / pivot)
        start_column(tile, pattern, values, k)


# Until row i is finished it is that of L D. The pairs of a column are one flat loop, which is foreseen.


@njit(error_model="numpy", forceinline=True)
def finish_row(tile: Tile, pattern: Pattern, values: Array, k: int) -> Any:
    """Turn row k of L D into that of L; returns D_k. Pointers."""
    width = len(tile)
    pivot = simd.load(tile, values, k * width)
    for p in range(pattern.across[k], pattern.across[k + 1]):
        entry = simd.load(tile, values, pattern.slot[p] * width)
        finished = entry * simd.load(tile, values, pattern.other[p] * width)
        simd.store(values, pattern.slot[p] * width, finished)
        pivot = pivot - entry * finished
    return pivot


@njit(error_model="numpy", forceinline=True)
def start_column(tile: Tile, pattern: Pattern, values: Array, k: int) -> None:
    """Column k of L D. Pointers."""
    width = len(tile)
    for p in range(pattern.pair[k], pattern.pair[k + 1]):
        left = simd.load(tile, values, pattern.left[p] * width)
        right = simd.load(tile, values, pattern.right[p] * width)
        simd.add_to(values, pattern.target[p] * width, -left * right)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def solve(tile: Tile, pattern: Pattern, factors: Array, x: Array, first: int) -> None:
    """Replace the right-hand side in the rows of x from `first` on by the solution. Pointers."""
    _substitute(tile, pattern, factors, x, first)
    backward(tile, pattern, factors, factors, x, first)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def forward(tile: Tile, pattern: Pattern, factors: Array, root: Array, x: Array, first: int) -> None:
    """x <- D^-1/2 L^-1 x in the rows of x from `first` on; root: D^-1/2, (n, lanes). Pointers."""
    _substitute(tile, pattern, factors, x, first)
    for i in range(pattern.size):
        scale(tile, x, first + i, root, i)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _substitute(tile: Tile, pattern: Pattern, factors: Array, x: Array, first: int) -> None:
    """x <- L^-1 x."""
    for i in range(pattern.size):
        begin, end = pattern.across[i], pattern.across[i + 1]
        subtract_dot(tile, x, first + i, factors, pattern.slot, pattern.other, begin, end, first)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def backward(tile: Tile, pattern: Pattern, factors: Array, root: Array, x: Array, first: int) -> None:
    """x <- L^-T D^-1/2 x in the rows of x from `first` on; root: D^-1/2, or D^-1 in its place, (n, lanes). Pointers."""
    for k in range(pattern.size - 1, -1, -1):
        scale(tile, x, first + k, root, k)
        begin, end = pattern.column[k], pattern.column[k + 1]
        subtract_dot(tile, x, first + k, factors, pattern.by_column, pattern.row, begin, end, first)


@njit(cache=True, error_model="numpy")
def multiply(tile: Tile, pattern: Pattern, values: Array, x: Array, y: Array) -> None:
    """y = A x for the unfactored symmetric matrix (slots, lanes); x, y: (rows, lanes). Pointers."""
    size = pattern.size
    for k in range(size):
        copy(tile, y, k, x, k)
        scale(tile, y, k, values, k)
    for k in range(size):
        for p in range(pattern.column[k], pattern.column[k + 1]):
            add_product(tile, y, pattern.row[p], values, size + p, x, k)
            add_product(tile, y, k, values, size + p, x, pattern.row[p])
