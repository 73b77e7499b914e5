"""Points and directions of bodies as affine functions of the coordinates.

A planar vector is one complex number x + iy; a coordinate is a real unknown with a complex coefficient. What joints
share is eliminated by substituting such expressions: a point shared by two bodies, a direction kept by a weld, a
place on a fixed line (one unknown). No multiplier, no drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Number = Any
"""A real or complex scalar, or an array of one number per lane."""


def is_zero(value: Number) -> bool:
    """Whether a coefficient vanishes in every lane."""
    return not np.any(value)


@dataclass(frozen=True)
class Affine:
    """constant + sum of coefficient * unknown; unknowns are real and numbered, coefficients complex."""

    terms: Mapping[int, Number]
    constant: Number = 0.0

    def __add__(self, other: Affine) -> Affine:
        terms = dict(self.terms)
        for unknown, coefficient in other.terms.items():
            terms[unknown] = terms[unknown] + coefficient if unknown in terms else coefficient
        kept = {unknown: coefficient for unknown, coefficient in terms.items() if not is_zero(coefficient)}
        return Affine(kept, self.constant + other.constant)

    def __mul__(self, factor: Number) -> Affine:
        return Affine({unknown: c * factor for unknown, c in self.terms.items()}, self.constant * factor)

    def __sub__(self, other: Affine) -> Affine:
        return self + other * -1.0

    @property
    def pair(self) -> tuple[int, int] | None:
        """The two unknowns that are the x and y of this vector, if it is just that."""
        if len(self.terms) == 2 and is_zero(self.constant):
            (first, x), (second, y) = self.terms.items()
            if np.all(x == 1.0) and np.all(y == 1j):
                return first, second
        return None


def fixed(value: Number) -> Affine:
    """A vector that does not move."""
    return Affine({}, value)
