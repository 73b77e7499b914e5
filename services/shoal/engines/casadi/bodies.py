"""A body in the plane as CasADi expressions: where its places are and which way they point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca

from shoal.engines.casadi.element import CableElement, cable_element
from shoal.engines.sections import Sections
from shoal.scene import Rod
from shoal.scene.record import Vector


class PlacedBody(Protocol):
    """A body or the ground, whose places are expressions in the coordinates q."""

    def point(self, place: Vector) -> Any:
        """Position [m] of a place given in the body's frame, (2,)."""
        ...

    def angle(self, place: Vector) -> Any:
        """Direction of the body, of a cable its tangent, at a place [rad]."""
        ...


@dataclass(frozen=True)
class PlacedRigid:
    """A rigid body with its origin [m], (2,), and its absolute angle [rad]."""

    origin: Any
    turn: Any

    def point(self, place: Vector) -> Any:
        """Position [m] of a place given in the body's frame, (2,)."""
        return self.origin + turned(self.turn, place)

    def angle(self, place: Vector) -> Any:
        """The absolute angle [rad], the same everywhere."""
        return self.turn


@dataclass(frozen=True)
class PlacedCable:
    """A cable with its nodes, each (r, r') of shape (4,), evenly spaced by h [m]."""

    rod: Rod
    nodes: tuple[Any, ...]

    @property
    def h(self) -> float:
        """Length of one element [m]."""
        return self.rod.length / self.rod.elements

    @property
    def element(self) -> CableElement:
        """The element's energies."""
        return cable_element(self.rod.quadrature)

    def elements(self) -> Iterator[Any]:
        """Nodal values of each element, (8,)."""
        return (ca.vertcat(*pair) for pair in zip(self.nodes[:-1], self.nodes[1:], strict=True))

    @property
    def sections(self) -> Sections:
        """The elements' masses and stiffnesses."""
        return Sections.of(self.rod)

    def point(self, place: Vector) -> Any:
        """Position [m] of a place given as (s, 0), (2,)."""
        return self._field(place)[0]

    def angle(self, place: Vector) -> Any:
        """Direction of the tangent at a place given as (s, 0) [rad], in (-pi, pi]."""
        slope = self._field(place)[1]
        return ca.atan2(slope[1], slope[0])

    def _field(self, place: Vector) -> tuple[Any, Any]:
        index, s = cable_place(self.rod, place)
        position, slope = self.element.field(ca.vertcat(*self.nodes[index : index + 2]), s, self.h)
        return position, slope


def cable_place(rod: Rod, place: Vector) -> tuple[int, float]:
    """Element index and arc length within it [m] of the place (s, 0) on a cable."""
    h = rod.length / rod.elements
    index = min(int(place[0] / h + 1e-9), rod.elements - 1)
    return index, place[0] - index * h


def turned(angle: Any, place: Vector) -> Any:
    """A vector of the body's frame turned by an angle [rad], (2,)."""
    x, y = place
    return ca.vertcat(ca.cos(angle) * x - ca.sin(angle) * y, ca.sin(angle) * x + ca.cos(angle) * y)
