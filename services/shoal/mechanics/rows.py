"""Rows of a state for vectors: a vector's own unknowns, or derived rows."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.derived import Derived
from shoal.mechanics.numerics.tile import Number, index, stacked


class Rows:
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
