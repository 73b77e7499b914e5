"""A rod as a chain of equal finite elements inside Exudyn: where a place is, and integrals along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.engines.exudyn.bodies import Place
from shoal.engines.sections import Sections
from shoal.scene import Rod
from shoal.trajectory import Array

gauss = np.polynomial.legendre.leggauss
"""Points and weights on [-1, 1]."""


def cross(a: Array, b: Array) -> Array:
    """The component of a x b out of the plane, (...,)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


@dataclass(frozen=True)
class Chain:
    """A rod as elements of equal length along it; columns: coordinates of each element, (elements, nodes, per node)."""

    rod: Rod
    sections: Sections
    elements: list[Any]
    columns: npt.NDArray[np.int64]

    @property
    def size(self) -> float:
        """Length of one element [m]."""
        return self.rod.length / self.rod.elements

    def find(self, place: Place) -> tuple[int, float]:
        """The element that holds a place on the axis, and the normalised coordinate there in [-1, 1]."""
        index = min(int(place[0] / self.size), self.rod.elements - 1)
        return index, 2 * (place[0] / self.size - index) - 1

    def values(self, shape: Array, q: Array) -> Array:
        """Interpolate in each element by `shape` (points, functions): (rows, elements, points, components)."""
        functions, elements = shape.shape[1], len(self.elements)
        here: Array = q[:, self.columns].reshape(len(q), elements, functions, -1)
        return np.asarray(np.einsum("pf,refc->repc", shape, here))

    def total(self, weights: Array, density: Array, factor: Array) -> Array:
        """Integral over the rod of a density at the points of every element, (rows, elements, points, ...).

        factor: of each element, (elements,).
        """
        return np.tensordot(np.einsum("e,re...->r...", factor, density), weights * self.size / 2, axes=(1, 0))
