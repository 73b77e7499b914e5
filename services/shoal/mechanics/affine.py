"""Points and directions of bodies as affine functions of the coordinates, in complex numbers.

A planar vector is one complex number x + iy, and every coordinate pair (x, y) of the model one
complex unknown. A point of a rigid body is then r + p e with complex p, and what joints share is
eliminated by substituting such expressions: no multiplier, no drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Number = Any
"""A complex scalar, or an array of one complex number per lane."""


def is_zero(value: Number) -> bool:
    """Whether a coefficient vanishes in every lane."""
    return not np.any(value)


@dataclass(frozen=True)
class Affine:
    """constant + sum of coefficient * pair; pairs are numbered complex unknowns."""

    terms: Mapping[int, Number]
    constant: Number = 0.0

    def __add__(self, other: Affine) -> Affine:
        terms = dict(self.terms)
        for pair, coefficient in other.terms.items():
            terms[pair] = terms[pair] + coefficient if pair in terms else coefficient
        kept = {pair: coefficient for pair, coefficient in terms.items() if not is_zero(coefficient)}
        return Affine(kept, self.constant + other.constant)

    def __mul__(self, factor: Number) -> Affine:
        return Affine({pair: c * factor for pair, c in self.terms.items()}, self.constant * factor)

    def __sub__(self, other: Affine) -> Affine:
        return self + other * -1.0

    @property
    def pair(self) -> int | None:
        """The pair this is, if it is just one."""
        if len(self.terms) == 1 and is_zero(self.constant):
            pair, coefficient = next(iter(self.terms.items()))
            if np.all(coefficient == 1.0):
                return pair
        return None


def fixed(value: Number) -> Affine:
    """A vector that does not move."""
    return Affine({}, value)
