"""Derived rows of a state: vectors that are affine in the coordinates, on which forces, constraints and markers act."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from shoal.compile.vector import add_product, clear, copy
from shoal.mechanics.numerics.tile import Array, Index, Tile


class Derived(NamedTuple):
    """Row `first` + r: constant[r] + sum of coefficient[t] z[source[t]] over start[r] <= t < start[r+1].

    first: number of the unknowns, which come before.
    """

    first: int
    start: Index
    source: Index
    coefficient: Array
    constant: Array


@njit(cache=True, error_model="numpy", forceinline=True)
def derive(tile: Tile, d: Derived, z: Array, begin: int, end: int, moving: bool) -> None:
    """Fill the derived rows of z from row `begin` up to row `end`; for rates (moving) the constants do not count."""
    for row in range(begin, end):
        r = row - d.first
        if moving:
            clear(tile, z, row)
        else:
            copy(tile, z, row, d.constant, r)
        for t in range(d.start[r], d.start[r + 1]):
            add_product(tile, z, row, d.coefficient, t, z, d.source[t])


@njit(cache=True, error_model="numpy")
def fold(tile: Tile, d: Derived, f: Array, end: int) -> None:
    """Pass the forces on the derived rows up to `end` to the unknowns they depend on (transpose of `derive`)."""
    for row in range(d.first, end):
        r = row - d.first
        for t in range(d.start[r], d.start[r + 1]):
            add_product(tile, f, d.source[t], d.coefficient, t, f, row)
