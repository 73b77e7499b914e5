"""One mass matrix for all lanes, and for all components of a vector that it treats alike.

Nodes have the mass of a number times the unit matrix of the space, so that x and y share the factor: side by side they
are lanes of a system with half the rows. A single lane with few rows multiplies by the inverse, whose products, unlike
a substitution's, do not wait for each other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import overload

from shoal.compile import simd
from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT
from shoal.mechanics.numerics import row_pairs, sparse
from shoal.mechanics.numerics.row_pairs import RowPairs
from shoal.mechanics.numerics.tile import Array, Tile

FEW = 32
"""Rows up to which the inverse is multiplied by."""
BLOCK = 4
"""Vectors of the result that are summed up at once."""


class Alike(NamedTuple):
    """components: how many rows in a row share the matrix; 0 where lanes differ, then there is nothing else here.

    matrix: in the pattern, (slots,). factor: by pairs of rows. inverse: column by column, every
    number `components` times, up to whole blocks of vectors; empty where there are more than FEW rows.
    """

    components: int
    pattern: sparse.Pattern
    matrix: Array
    factor: RowPairs
    inverse: Array


def analyse(
    unknowns: int, dimensions: int, entries: dict[tuple[int, int], Array]
) -> tuple[int, dict[tuple[int, int], Array]]:
    """Return the number of components that share one matrix, the space's dimensions or 1, and its entries."""
    d = dimensions
    shared = {(i // d, j // d): value for (i, j), value in entries.items() if i % d == 0 == j % d}
    for i, j in entries:
        same = shared.get((i // d, j // d))
        if unknowns % d or i % d != j % d or same is None or not np.array_equal(same, entries[i, j]):
            return 1, entries
    complete = all((d * i + c, d * j + c) in entries for i, j in shared for c in range(d))
    return (d, shared) if complete else (1, entries)


def spread_inverse(matrix: Array, components: int) -> Array:
    """The inverse of a matrix as `Alike` keeps it."""
    rows = components * len(matrix)
    columns = np.zeros((len(matrix), -(-rows // (BLOCK * len(EIGHT))) * BLOCK * len(EIGHT)))
    columns[:, :rows] = np.repeat(np.linalg.inv(matrix), components, axis=0).T
    return columns.ravel()


_TWO, _THREE = (0,) * 2, (0,) * 3
"""Tuples as long as vectors are in the plane and in space."""


def _side_by_side(tile: Tile, space: tuple[int, ...]) -> Tile:
    """The tile whose lanes are the components of those of another one."""
    return tile * len(space)


@overload(_side_by_side)
def _choose(tile, space):  # type: ignore[no-untyped-def]
    wide = (0,) * (tile.count * space.count)
    return lambda tile, space: wide


@njit(cache=True, error_model="numpy", forceinline=True)
def solve(tile: Tile, alike: Alike, w: Array, x: Array) -> None:
    """Replace the right-hand side in x by the solution; w: room for twice the rows of the inverse. Pointers."""
    single = len(tile) == 1
    if single and alike.pattern.size <= FEW and alike.components < 3:
        if alike.components == 1:
            _multiply_inverse((0,), alike, w, x)
        else:
            _multiply_inverse(_TWO, alike, w, x)
    elif alike.components == 2:
        row_pairs.solve(_side_by_side(tile, _TWO), alike.factor, x, 2 * len(tile))
    elif alike.components == 3 and single:
        row_pairs.solve(_THREE, alike.factor, x, 3)
    else:
        # Vectors whose length is no power of two are filled up by the compiler, at several times the cost.
        row_pairs.solve(tile, alike.factor, x, alike.components * len(tile))


@njit(cache=True, error_model="numpy", forceinline=True)
def multiply(tile: Tile, alike: Alike, x: Array, y: Array) -> None:
    """y = M x. Pointers."""
    if alike.components == 1:
        _multiply(tile, alike, x, y)
    elif alike.components == 2:
        _multiply(_side_by_side(tile, _TWO), alike, x, y)
    else:
        _multiply(_side_by_side(tile, _THREE), alike, x, y)


@njit(cache=True, error_model="numpy")
def _multiply(tile: Tile, alike: Alike, x: Array, y: Array) -> None:
    width, size = len(tile), alike.pattern.size
    for k in range(size):
        simd.store(y, k * width, alike.matrix[k] * simd.load(tile, x, k * width))
    for k in range(size):
        own, total = simd.load(tile, x, k * width), simd.load(tile, y, k * width)
        for p in range(alike.pattern.column[k], alike.pattern.column[k + 1]):
            value, row = alike.matrix[size + p], alike.pattern.row[p] * width
            total = total + value * simd.load(tile, x, row)
            simd.add_to(y, row, value * own)
        simd.store(y, k * width, total)


@njit(cache=True, error_model="numpy")
def _multiply_inverse(group: tuple[int, ...], alike: Alike, w: Array, x: Array) -> None:
    """The product with the inverse; group: as long as there are components."""
    d, n, lanes = len(group), alike.pattern.size, len(EIGHT)
    rows = d * n
    vectors = -(-rows // (BLOCK * lanes)) * BLOCK
    simd.assign(w, x, rows)
    for first in range(0, vectors, BLOCK):
        a = simd.spread(EIGHT, 0.0)
        b, c, e = a, a, a
        for j in range(n):
            at = (j * vectors + first) * lanes
            force = simd.repeat(EIGHT, group, w, d * j)
            a = a + simd.load(EIGHT, alike.inverse, at) * force
            b = b + simd.load(EIGHT, alike.inverse, at + lanes) * force
            c = c + simd.load(EIGHT, alike.inverse, at + 2 * lanes) * force
            e = e + simd.load(EIGHT, alike.inverse, at + 3 * lanes) * force
        at = rows + first * lanes
        simd.store(w, at, a)
        simd.store(w, at + lanes, b)
        simd.store(w, at + 2 * lanes, c)
        simd.store(w, at + 3 * lanes, e)
    simd.assign(x, shift(w, rows), rows)
