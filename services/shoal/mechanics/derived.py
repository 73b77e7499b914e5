"""Derived rows of a state: vectors that are affine in the coordinates, on which forces, constraints and markers act."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.vector import add_product, clear, copy
from shoal.mechanics.affine import Affine
from shoal.mechanics.numerics.tile import Array, Index, Number, Tile, index, stacked


class Derived(NamedTuple):
    """Row `first` + r: constant[r] + sum of coefficient[t] z[source[t]] over start[r] <= t < start[r+1].

    first: number of the unknowns, which come before.
    """

    first: int
    start: Index
    source: Index
    coefficient: Array
    constant: Array


class RowAllocator:
    """Hands out the rows of vectors, in the order in which they are asked for."""

    def __init__(self, unknowns: int) -> None:
        self.unknowns = self.size = unknowns
        self._vectors: list[Affine] = []
        self._known: dict[int, tuple[int, ...]] = {}

    def of(self, vector: Affine) -> tuple[int, ...]:
        """The row of every component of a vector."""
        if vector.own is not None:
            return vector.own
        if id(vector) not in self._known:
            end = self.size + len(vector.constant)
            self._known[id(vector)] = tuple(range(self.size, end))
            self._vectors.append(vector)
            self.size = end
        return self._known[id(vector)]

    def of_all(self, vectors: list[Affine]) -> list[int]:
        """The rows of vectors, one after the other."""
        return [row for vector in vectors for row in self.of(vector)]

    def derived(self) -> Derived:
        """All derived rows handed out so far."""
        start, source = [0], []
        coefficients: list[Number] = []
        constants: list[Number] = []
        for vector in self._vectors:
            for k, constant in enumerate(vector.constant):
                for unknown, c in vector.terms.items():
                    if np.any(c[k]):
                        source.append(unknown)
                        coefficients.append(c[k])
                start.append(len(source))
                constants.append(constant)
        return Derived(self.unknowns, index(start), index(source), stacked(coefficients), stacked(constants))


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
