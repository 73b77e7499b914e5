"""Elements as vectors: one element of a tile of simulations, or up to eight elements of a single simulation.

A force is written once for values of `simd`. In a tile their lanes are the simulations, in a single run neighbours of
one variant; the last batch of these repeats an element, whose force is not counted twice.
"""

from __future__ import annotations

from typing import Any

from numba import njit, types
from numba.extending import overload

from shoal.compile import simd
from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT
from shoal.mechanics.elements.families import PLAN, PLANE, Family
from shoal.mechanics.numerics.tile import Array, Tile

REST, VARIANT, TOGETHER = 2, 3, 4
"""Columns of the plan: see `families.PLAN`."""
_INLINE = {"error_model": "numpy", "forceinline": True}


@njit(error_model="numpy", forceinline=True)
def of_one_variant(family: Family, number: int) -> int:
    """Count the elements from this one on that are of its variant, at most eight."""
    return family.plan[PLAN * number + TOGETHER]  # type: ignore[no-any-return]


@njit(error_model="numpy", forceinline=True)
def together(tile: Tile, family: Family, number: int) -> int:
    """Return the number of elements from this one on that are computed at once."""
    return family.plan[PLAN * number + TOGETHER] if len(tile) == 1 else 1


def coordinate(tile: Tile, family: Family, number: int, lane: int, side: int, k: int, z: Array) -> Any:
    """Row k of `side` of the elements from this number on, of the state z."""
    raise NotImplementedError


def rows(like: tuple[int, ...], tile: Tile, family: Family, number: int, lane: int, side: int, k: int, z: Array) -> Any:
    """Rows k, k + 1, ... of `side` of the elements from this number on, a tuple as long as `like`."""
    raise NotImplementedError


def coefficients(like: tuple[int, ...], tile: Tile, family: Family, number: int, lane: int, count: int, k: int) -> Any:
    """Their coefficients k, k + 1, ... of `count`, a tuple as long as `like`."""
    raise NotImplementedError


def rests(like: tuple[int, ...], tile: Tile, family: Family, number: int, lane: int, k: int) -> Any:
    """Entries k, k + 1, ... of their reference, a tuple as long as `like`."""
    raise NotImplementedError


def kept(space: tuple[int, ...], w: Array, at: int, step: int) -> Any:
    """Return a tuple of the vectors at, at + step, ... of the work space, as long as `space`."""
    raise NotImplementedError


def kept_matrix(space: tuple[int, ...], w: Array, at: int, down: int, right: int) -> Any:
    """Return rows of vectors of the work space, `down` from row to row and `right` from column to column."""
    raise NotImplementedError


def zeros_like(a: Any) -> Any:
    """Return zero vectors, as many as a tuple has, or a matrix of them."""
    raise NotImplementedError


def coefficient(tile: Tile, family: Family, number: int, lane: int, count: int, k: int) -> Any:
    """Their coefficient k of `count`."""
    raise NotImplementedError


def rest(tile: Tile, family: Family, number: int, lane: int, k: int) -> Any:
    """Entry k of their reference."""
    raise NotImplementedError


def add_rows(tile: Tile, family: Family, number: int, lane: int, count: int, w: Array, f: Array, values: Any) -> None:
    """Add a tuple of vectors, one a row, to the rows of `count` elements in f; w: room for 8 of each."""
    raise NotImplementedError


def add_sum(tile: Tile, lane: int, count: int, w: Array, total: Array, value: Any) -> None:
    """Add a vector to total, (lanes,), in a single run the sum over `count` elements; w: room for 8."""
    raise NotImplementedError


def put(tile: Tile, lane: int, count: int, w: Array, out: Array, row: int, step: int, value: Any) -> None:
    """Write a vector to a row of out and, for `count` elements, to every step-th one from there; w: room for 8."""
    raise NotImplementedError


@overload(coordinate)
def _coordinate(tile, family, number, lane, side, k, z):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda tile, family, number, lane, side, k, z: simd.pick(EIGHT, z, family.rows, side * number + k, side)
    return lambda tile, family, number, lane, side, k, z: simd.load(
        EIGHT, z, family.rows[side * number + k] * len(tile) + lane
    )


@overload(kept, jit_options=_INLINE)
def _kept(space, w, at, step):  # type: ignore[no-untyped-def]
    width = len(EIGHT)
    return lambda space, w, at, step: simd.loads(space, EIGHT, w, width * at, width * step)


@overload(kept_matrix, jit_options=_INLINE)
def _kept_matrix(space, w, at, down, right):  # type: ignore[no-untyped-def]
    if space.count == len(PLANE):
        return lambda space, w, at, down, right: (kept(space, w, at, right), kept(space, w, at + down, right))
    return lambda space, w, at, down, right: (
        kept(space, w, at, right),
        kept(space, w, at + down, right),
        kept(space, w, at + 2 * down, right),
    )


@overload(zeros_like, jit_options=_INLINE)
def _zeros_like(a):  # type: ignore[no-untyped-def]
    if not isinstance(a, types.BaseTuple):
        return lambda a: simd.spread(EIGHT, 0.0)
    if len(a) == 1:
        return lambda a: (zeros_like(a[0]),)
    return lambda a: (zeros_like(a[0]), *zeros_like(a[1:]))


@overload(rows, jit_options=_INLINE)
def _rows(like, tile, family, number, lane, side, k, z):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda like, tile, family, number, lane, side, k, z: simd.picks(
            like, EIGHT, z, family.rows, side * number + k, side, 1, 0
        )
    return lambda like, tile, family, number, lane, side, k, z: simd.loads_rows(
        like, EIGHT, z, family.rows, side * number + k, lane, len(tile)
    )


@overload(coefficients, jit_options=_INLINE)
def _coefficients(like, tile, family, number, lane, count, k):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda like, tile, family, number, lane, count, k: simd.gathers(
            like, EIGHT, family.coefficients, count * number + k, count
        )
    return lambda like, tile, family, number, lane, count, k: simd.loads(
        like, EIGHT, family.coefficients, (count * number + k) * len(tile) + lane, len(tile)
    )


@overload(rests, jit_options=_INLINE)
def _rests(like, tile, family, number, lane, k):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda like, tile, family, number, lane, k: simd.picks(
            like, EIGHT, shift(family.reference, k), family.plan, PLAN * number + REST, PLAN, 0, 1
        )
    return lambda like, tile, family, number, lane, k: simd.loads(
        like, EIGHT, family.reference, (family.plan[PLAN * number + REST] + k) * len(tile) + lane, len(tile)
    )


@njit(error_model="numpy", forceinline=True)
def nodal(k, tile, space, family, number, lane, count, z):  # type: ignore[no-untyped-def]
    """Vector k of `count` of the elements from this number on, a tuple as long as `space`."""
    return rows(space, tile, family, number, lane, len(space) * count, len(space) * k, z)


@overload(coefficient)
def _coefficient(tile, family, number, lane, count, k):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda tile, family, number, lane, count, k: simd.gather(
            EIGHT, family.coefficients, count * number + k, count
        )
    return lambda tile, family, number, lane, count, k: simd.load(
        EIGHT, family.coefficients, (count * number + k) * len(tile) + lane
    )


@overload(rest)
def _rest(tile, family, number, lane, k):  # type: ignore[no-untyped-def]
    if tile.count == 1:
        return lambda tile, family, number, lane, k: simd.pick(
            EIGHT, shift(family.reference, k), family.plan, PLAN * number + REST, PLAN
        )
    return lambda tile, family, number, lane, k: simd.load(
        EIGHT, family.reference, (family.plan[PLAN * number + REST] + k) * len(tile) + lane
    )


@overload(add_rows)
def _add_rows(tile, family, number, lane, count, w, f, values):  # type: ignore[no-untyped-def]
    side = values.count

    def single(tile, family, number, lane, count, w, f, values):  # type: ignore[no-untyped-def]
        for k in range(side):
            simd.store(w, len(EIGHT) * k, values[k])
        for other in range(count):
            first = side * (number + other)
            for k in range(side):
                f[family.rows[first + k]] += w[len(EIGHT) * k + other]

    def wide(tile, family, number, lane, count, w, f, values):  # type: ignore[no-untyped-def]
        for k in range(side):
            simd.add_to(f, family.rows[side * number + k] * len(tile) + lane, values[k])

    return single if tile.count == 1 else wide


@overload(add_sum)
def _add_sum(tile, lane, count, w, total, value):  # type: ignore[no-untyped-def]
    def single(tile, lane, count, w, total, value):  # type: ignore[no-untyped-def]
        simd.store(w, 0, value)
        for other in range(count):
            total[0] += w[other]

    def wide(tile, lane, count, w, total, value):  # type: ignore[no-untyped-def]
        simd.add_to(total, lane, value)

    return single if tile.count == 1 else wide


@overload(put)
def _put(tile, lane, count, w, out, row, step, value):  # type: ignore[no-untyped-def]
    def single(tile, lane, count, w, out, row, step, value):  # type: ignore[no-untyped-def]
        simd.store(w, 0, value)
        for other in range(count):
            out[row + step * other] = w[other]

    def wide(tile, lane, count, w, out, row, step, value):  # type: ignore[no-untyped-def]
        simd.store(out, row * len(tile) + lane, value)

    return single if tile.count == 1 else wide
