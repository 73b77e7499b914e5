"""Description of a kind of flexible element for placement and model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from shoal.mechanics.elements.families import Entry
from shoal.mechanics.numerics.tile import Number
from shoal.scene import Rod
from shoal.scene.sections import Section

Shape = Callable[[Number, Number, Number], list[Number]]


@dataclass(frozen=True)
class Element:
    """A kind of flexible element with two nodes.

    family: the type of its kernel's arrays. nodal_vectors: (rod, arc length [m]) -> the vectors a node has besides its
    position, in the unstrained rod, along its own frame, (2, ...). position_shape, direction_shape: (fraction x, height
    y [m], element length [m]) -> the factors of the nodal vectors of both nodes. clamped: which of a node's vectors a
    clamp holds. normal: whether that one, and what direction_shape gives, is along the section, a right angle to the
    left of the axis. mass: (density, section, length) -> consistent mass on the nodal vectors. weight: (mass per
    length, length) -> load of a unit acceleration. part: (rod, section, length, nodal vectors at rest) -> one element
    for its kernel. stretching: (axial stiffness EA [N], length) -> stiffness against stretching on the nodal vectors,
    the same for every direction, if the element has one. products: what its nodes need held, (i, j, value) for the dot
    product of the i-th and the j-th of a node's vectors besides its position. director: the axis of the section (1: y,
    2: z) that a node has as a vector, next to its slope; other: the same element with the other one. In space vectors
    have three components.
    """

    family: type
    nodal_vectors: Callable[[Rod, Number], list[Number]]
    position_shape: Shape
    direction_shape: Shape
    mass: Callable[[Number, Section, Number], list[list[Number]]]
    weight: Callable[[Number, Number], list[Number]]
    part: Callable[[Rod, Section, Number, list[Number]], Entry]
    clamped: int = 0
    normal: bool = False
    stretching: Callable[[Number, Number], list[list[Number]]] | None = None
    products: tuple[tuple[int, int, float], ...] = ()
    director: int | None = None
    other: Element | None = None
