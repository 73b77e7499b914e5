"""Kinematics of every kind of body: any material point and direction as an affine vector of the coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.elements.element import Element
from shoal.mechanics.modal.modes import ModalIntegrals
from shoal.mechanics.numerics.tile import Number

Place = tuple[Number, ...]
"""A place in a body's frame [m]; of a rod the arc length and the height above the axis."""


@dataclass(frozen=True)
class PointFrame:
    """A point mass: a position and no direction."""

    name: str
    origin: Affine

    def point(self, place: Place) -> Affine:
        """The point itself, which is the only one there is."""
        if np.any(place):
            raise InputError(f"bodies.{self.name}: a point mass has only the point [0, 0]")
        return self.origin

    def direction(self, place: Place) -> Affine:
        """A point mass has none; its marker reports the angle zero."""
        return fixed(np.eye(len(self.origin.constant))[0][:, None])

    @property
    def vectors(self) -> list[Affine]:
        """The vectors that are its coordinates when it is free."""
        return [self.origin]


@dataclass(frozen=True)
class RigidFrame:
    """A rigid body: the position of its origin and the directors along its axes, all affine in the coordinates."""

    origin: Affine
    directors: tuple[Affine, ...]

    def point(self, place: Place) -> Affine:
        """The material point at a place."""
        return self.origin + combined(self.directors, place)

    def direction(self, place: Place) -> Affine:
        """A vector along the body's x axis."""
        return self.directors[0]

    @property
    def vectors(self) -> list[Affine]:
        """The vectors that are its coordinates when it is free: in the plane the first director turns the second."""
        return [self.origin, *(self.directors[:1] if len(self.directors) == plane.DIMENSIONS else self.directors)]


@dataclass(frozen=True)
class ModalFrame(RigidFrame):
    """A body that bends by modes in a frame that moves: the frame, and for every mode q a vector q e along it.

    The frame of a rod that stretches is longer by its even strain, and the vector of a mode by which it stretches is
    q e less the stretch times e_perp.
    """

    modes: ModalIntegrals
    amplitudes: tuple[Affine, ...]

    def point(self, place: Place) -> Affine:
        """Return the material point with a place in the undeformed body."""
        return super().point(place) + self._sum(self.modes.shapes(place)[0])

    def direction(self, place: Place) -> Affine:
        """A vector along what was the body's x axis there."""
        return self.directors[0] + self._sum(self.modes.shapes(place)[1])

    @property
    def vectors(self) -> list[Affine]:
        """The vectors that are its coordinates when it is free."""
        return [self.origin, self.directors[0], *self.amplitudes]

    @property
    def measured(self) -> list[tuple[Affine, Number]]:
        """Return of every mode a vector whose part along the frame is its amplitude plus a length [m]."""
        length, along = self.modes.length, self.modes.along
        stretching = [one.turned(plane.QUARTER) for one in self.amplitudes[: max(along - 1, 0)]]
        even = [(self.directors[0] * length, length)] if along else []
        return [*((one, 0.0) for one in self.amplitudes), *even, *((one, 0.0) for one in stretching)]

    def _sum(self, factors: list[Any]) -> Affine:
        """The sum of complex numbers times the amplitudes; i turns by a right angle."""
        factors = factors[: len(self.amplitudes)]
        both = (*self.amplitudes, *(one.turned(plane.QUARTER) for one in self.amplitudes))
        return combined(both, (*np.real(factors), *np.imag(factors)))


@dataclass(frozen=True)
class BeamFrame:
    """A flexible rod: the nodal vectors of its equally spaced nodes, and the element that interpolates them.

    nodes: one tuple of vectors per node (position first), as the element's file orders them. axes: of sections in
    space, by node and axis, those further ones that joints hold as vectors; they follow from slope and director.
    """

    name: str
    element: Element
    length: Number
    nodes: tuple[tuple[Affine, ...], ...]
    axes: dict[tuple[int, int], Affine] = field(default_factory=dict)

    @property
    def element_length(self) -> Number:
        """Length of one element [m]."""
        return self.length / (len(self.nodes) - 1)

    @property
    def vectors(self) -> list[Affine]:
        """The vectors that are its coordinates when it is free."""
        return [vector for node in self.nodes for vector in node]

    def of_element(self, number: int) -> list[Affine]:
        """The nodal vectors of an element."""
        return [*self.nodes[number], *self.nodes[number + 1]]

    def point(self, place: Place) -> Affine:
        """The material point at an arc length and a height above the axis [m]."""
        node = self.node(place)
        if node is not None and is_on_axis(place):
            return self.nodes[node][0]
        return self._blend(place, self.element.position_shape)

    def direction(self, place: Place) -> Affine:
        """A vector along the axis (of a section that shears: perpendicular to it) at an arc length [m]."""
        found = self._blend(place, self.element.direction_shape)
        return found.turned(plane.QUARTER.T) if self.element.normal else found

    def node(self, place: Place) -> int | None:
        """The node at an arc length, if there is one."""
        number = place[0] / self.length * (len(self.nodes) - 1)
        nearest = int(np.rint(np.asarray(number).flat[0]))
        return nearest if np.all(np.abs(number - nearest) < 1e-9) else None

    def _blend(self, place: Place, shape: Any) -> Affine:
        elements = len(self.nodes) - 1
        where = place[0] / np.asarray(self.length) * elements
        number = min(int(np.min(where) + 1e-9), elements - 1)
        if np.max(where) > number + 1 + 1e-9:
            raise InputError("markers: a marker must stay in one element of its cable while a length varies")
        weights = shape(where - number, place[1], np.asarray(self.element_length))
        return combined(tuple(self.of_element(number)), tuple(weights))


def is_on_axis(place: Place) -> bool:
    """Return whether a place of a rod has no offset from its axis."""
    return not any(np.any(offset) for offset in place[1:])


Frame = PointFrame | RigidFrame | BeamFrame
