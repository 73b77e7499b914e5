"""The flexible elements: what the placement and the model need to know of each, in one list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shoal.mechanics.assembly.affine import Number
from shoal.mechanics.elements import ancf_cable, ancf_full, beam
from shoal.scene import Rod

Shape = Callable[[Number, Number, Number], list[Number]]


@dataclass(frozen=True)
class Element:
    """A kind of flexible element with two nodes.

    nodal_vectors: (rod, arc length [m]) -> the vectors a node has besides its position, in the unstrained rod, along
    its own frame (complex). position_shape, direction_shape: (fraction x, height y [m], element length [m]) -> the
    factors of the nodal vectors of both nodes. clamped: which of a node's vectors a clamp holds, and the factor that
    turns the rod's direction into that vector. mass, weight: (density, height, width, length) -> consistent mass on
    the nodal vectors and load of a unit acceleration.
    """

    nodal_vectors: Callable[[Rod, Number], list[Number]]
    position_shape: Shape
    direction_shape: Shape
    clamped: int
    clamp_turn: complex
    mass: Callable[[Number, Number, Number, Number], list[list[Number]]]
    weight: Callable[[Number, Number, Number, Number], list[Number]]


def _tangent(rod: Rod, s: Number) -> Number:
    return np.exp(1j * rod.turn(s)) if rod.curvature else 1.0 + 0.0j * s


def _curvature(rod: Rod, s: Number) -> Number:
    return sum(k * s**power for power, k in enumerate(rod.curvature)) + 0.0 * s


def _full_direction(x: Number, y: Number, length: Number) -> list[Number]:
    """The section's direction r_y, turned back by a right angle."""
    zero = 0.0 * length
    return [zero, zero, -1j * (1 - x) + zero, zero, zero, -1j * x + zero]


ELEMENTS = {
    "ancf-cable": Element(
        nodal_vectors=lambda rod, s: [_tangent(rod, s)],
        position_shape=lambda x, y, length: ancf_cable.position_shape(x, length),
        direction_shape=lambda x, y, length: ancf_cable.slope_shape(x, length),
        clamped=0,
        clamp_turn=1.0,
        mass=lambda density, height, width, length: ancf_cable.mass_matrix(density * height * width, length),
        weight=lambda density, height, width, length: ancf_cable.weight(density * height * width, length),
    ),
    "ancf-quintic": Element(
        nodal_vectors=lambda rod, s: [_tangent(rod, s), 1j * _curvature(rod, s) * _tangent(rod, s)],
        position_shape=lambda x, y, length: beam.position_shape(beam.QUINTIC, x, length),
        direction_shape=lambda x, y, length: beam.slope_shape(beam.QUINTIC, x, length),
        clamped=0,
        clamp_turn=1.0,
        mass=lambda density, height, width, length: beam.mass_matrix(beam.QUINTIC, density * height * width, length),
        weight=lambda density, height, width, length: beam.weight(beam.QUINTIC, density * height * width, length),
    ),
    "ancf-full": Element(
        nodal_vectors=lambda rod, s: [1.0 + 0.0j * s, 1.0j + 0.0j * s],
        position_shape=ancf_full.position_shape,
        direction_shape=_full_direction,
        clamped=1,
        clamp_turn=1j,
        mass=lambda density, height, width, length: ancf_full.mass_matrix(density, length, height, width),
        weight=lambda density, height, width, length: ancf_full.weight(density, length, height, width),
    ),
}
