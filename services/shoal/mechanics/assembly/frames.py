"""How every kind of body hangs on the coordinates: any material point and direction as an affine vector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.affine import Affine, Number, fixed


@dataclass(frozen=True)
class PointFrame:
    """A point mass: a position and no direction."""

    name: str
    origin: Affine

    def point(self, p: Number) -> Affine:
        """The point itself, which is the only one there is."""
        if np.any(p):
            raise InputError(f"bodies.{self.name}: a point mass has only the point [0, 0]")
        return self.origin

    def direction(self, p: Number) -> Affine:
        """A point mass has none; its marker reports the angle zero."""
        return fixed(1.0)


@dataclass(frozen=True)
class RigidFrame:
    """A rigid body: position r of its origin and unit vector e, both affine in the coordinates."""

    origin: Affine
    axis: Affine

    def point(self, p: Number) -> Affine:
        """The material point p = x + iy [m]."""
        offset: Affine = self.axis * p
        return self.origin + offset

    def direction(self, p: Number) -> Affine:
        """A vector along the body's x axis."""
        return self.axis


@dataclass(frozen=True)
class BeamFrame:
    """A flexible rod: the nodal vectors of its equally spaced nodes, and the element that interpolates them.

    nodes: one tuple of vectors per node (position first), as the element's module orders them.
    """

    name: str
    element: Any
    length: Number
    nodes: tuple[tuple[Affine, ...], ...]

    @property
    def element_length(self) -> Number:
        """Length of one element [m]."""
        return self.length / (len(self.nodes) - 1)

    def vectors(self, number: int) -> list[Affine]:
        """The nodal vectors of an element."""
        return [*self.nodes[number], *self.nodes[number + 1]]

    def point(self, p: Number) -> Affine:
        """The material point at the arc length p = s + iy [m], y off the axis."""
        node = self.node(p)
        if node is not None and is_on_axis(p):
            return self.nodes[node][0]
        return self._blend(p, self.element.position_shape)

    def direction(self, p: Number) -> Affine:
        """A vector along the axis (of a section that shears: perpendicular to it) at the arc length p [m]."""
        return self._blend(p, self.element.direction_shape)

    def node(self, p: Number) -> int | None:
        """The node at the arc length p, if there is one."""
        place = np.real(p) / self.length * (len(self.nodes) - 1)
        nearest = int(np.rint(np.asarray(place).flat[0]))
        return nearest if np.all(np.abs(place - nearest) < 1e-9) else None

    def _blend(self, p: Number, shape: Any) -> Affine:
        elements = len(self.nodes) - 1
        place = np.real(p) / np.asarray(self.length) * elements
        number = min(int(np.min(place) + 1e-9), elements - 1)
        if np.max(place) > number + 1 + 1e-9:
            raise InputError("markers: a marker must stay in one element of its cable while a length varies")
        weights = shape(place - number, np.imag(p), np.asarray(self.element_length))
        total = fixed(0.0)
        for weight, vector in zip(weights, self.vectors(number), strict=True):
            if np.any(weight):
                total = total + vector * weight
        return total


def is_on_axis(p: Number) -> bool:
    """Whether a place of a rod has no offset from its axis."""
    return not np.any(np.imag(p))


Frame = PointFrame | RigidFrame | BeamFrame
