"""The axes of joints: which are parallel, square or in one place, for all the rounding of a file."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.imported.rounding import ROUNDED, Array
from shoal.imported.source import Source


@dataclass
class Axes:
    """Unit vectors along joints that have to agree, in the ground's axes: of parallel ones the first."""

    known: list[Array] = field(default_factory=list)

    def trued(self, axis: Array) -> Array:
        """A unit vector, exactly parallel or square to those so far to which it is so but for the rounding of a file.

        Joints of one body or of a loop would else contradict each other by as little, and lock.
        """
        for known in self.known:
            if are_parallel(known, axis):
                return known * np.sign(known @ axis)
        square = np.array([known for known in self.known if are_square(known, axis)])
        if square.size:
            axis = axis - np.linalg.pinv(square, rcond=np.sqrt(ROUNDED)) @ (square @ axis)
        self.known.append(axis / np.linalg.norm(axis))
        return self.known[-1]


def are_parallel(one: Array, other: Array) -> bool:
    """Return whether two unit vectors are along one line."""
    return bool(np.linalg.norm(np.cross(one, other)) < ROUNDED)


def are_square(one: Array, other: Array) -> bool:
    """Return whether two unit vectors are at a right angle."""
    return bool(abs(one @ other) < ROUNDED)


def span(source: Source, own: list[int]) -> bool:
    """Return whether the axes of three joints are those of a space."""
    return bool(abs(np.linalg.det(source.data.xaxis[own])) > ROUNDED)


def meet(source: Source, own: list[int]) -> bool:
    """Return whether joints are in one place, to 1e-9 m."""
    return all(np.allclose(source.data.xanchor[one], source.data.xanchor[own[0]], atol=1e-9) for one in own)
