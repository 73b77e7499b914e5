"""The flexible rod as Exudyn's ANCF cable, with its energy recomputed from the element's own definition.

Found from the residual of ObjectANCFCable2D, to 1e-14 of the force: the axial strain is |r'| - 1 and the
curvature (r' x r'') / |r'|^2, with derivatives by the arc length of the undeformed rod.
useReducedOrderIntegration 0 takes 5 Gauss points for the axial strain and 3 for the curvature;
1 takes 4 and 2 Gauss points; 2 takes 3 Lobatto points (ends and middle) and 2 Gauss points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.engines.exudyn.bodies import BodyPart, Energy, Place, PointMotion, System
from shoal.engines.exudyn.chain import Chain, cross, gauss
from shoal.engines.poses import InitialPose, normal
from shoal.engines.sections import Sections
from shoal.scene import Rod
from shoal.trajectory import Array

LOBATTO_3 = (np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3)
RULES = {"full": (0, gauss(5), gauss(3)), "reduced": (2, LOBATTO_3, gauss(2))}
"""Exudyn's number of a quadrature; its points and weights, axial then bending."""


def add_cables(
    system: System, kind: str, rod: Rod, sections: Sections, nodes: list[Any], more: Mapping[str, Any]
) -> list[Any]:
    """Enter the elements of a rod between its nodes, and their weight. more: fields of that kind alone."""
    found = []
    for k, pair in enumerate(pairwise(nodes)):
        cable = system.add(
            kind,
            length=rod.length / rod.elements,
            massPerLength=sections.mass[k],
            bendingStiffness=sections.bending[k],
            axialStiffness=sections.axial[k],
            bendingDamping=rod.retardation * sections.bending[k],
            axialDamping=rod.retardation * sections.axial[k],
            nodeNumbers=list(pair),
            useReducedOrderIntegration=RULES[rod.quadrature][0],
            **more,
        )
        found.append(cable)
        system.weigh(cable)
    return found


@dataclass(frozen=True)
class CablePart(Chain, BodyPart):
    """A chain of ObjectANCFCable2D; coordinates of a node: r and r'.

    rest: the nodal vectors of the unstrained elements, (elements, 4, 2).
    """

    rest: Array

    @classmethod
    def add(cls, system: System, rod: Rod, pose: InitialPose) -> CablePart:
        """Enter an unstrained rod at its initial pose."""
        sections = Sections.of(rod)
        nodes, columns, vectors = [], [], []
        for s in np.linspace(0.0, rod.length, rod.elements + 1):
            axis, lead = complex(rod.axis(s)), pose.angle + float(rod.turn(s))
            place, slope = (axis.real, axis.imag), np.array([np.cos(lead), np.sin(lead)])
            begin, rates = [*pose.position(place), *slope], [*pose.speed(place), *(pose.rate * normal(slope))]
            node, places = system.node("NodePoint2DSlope1", begin, rates)
            vectors.append([pose.position(place), slope])
            nodes.append(node)
            columns.append(places)
        bent = {"strainIsRelativeToReference": float(bool(rod.curvature))}
        elements = add_cables(system, "ObjectANCFCable2D", rod, sections, nodes, bent)
        rest = np.array([first + last for first, last in pairwise(vectors)])
        return cls(rod, sections, elements, np.array([first + last for first, last in pairwise(columns)]), rest)

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.marker("MarkerBodyPosition", self.elements[index], ((1 + xi) * self.size / 2, 0.0))

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.turned(self.elements[index], ((1 + xi) * self.size / 2, 0.0), angle)

    def motion(self, q: Array, v: Array, place: Place) -> PointMotion:
        """See Part."""
        index, xi = self.find(place)
        shape, slope, _ = self._shapes(np.array([xi]))
        position, velocity = (self.values(shape, x)[:, index, 0] for x in (q, v))
        tangent, turn = (self.values(slope, x)[:, index, 0] for x in (q, v))
        rate = cross(tangent, turn) / np.sum(tangent**2, axis=1)
        return PointMotion(position, velocity, np.arctan2(tangent[:, 1], tangent[:, 0]), rate)

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        (axial, bending), rules = self._strains(q, v), self._rules
        elastic = self.total(rules[0][1], axial[0] ** 2, self.sections.axial / 2)
        elastic += self.total(rules[1][1], bending[0] ** 2, self.sections.bending / 2)
        points, weights = gauss(4)
        shape = self._shapes(points)[0]
        kinetic = self.total(weights, np.sum(self.values(shape, v) ** 2, axis=-1), self.sections.mass / 2)
        return Energy(kinetic, elastic, self.total(weights, self.values(shape, q), self.sections.mass))

    def damping(self, q: Array, v: Array) -> Array:
        """See Part: retardation * (EA (strain rate)^2 + EI (curvature rate)^2)."""
        if not self.rod.retardation:
            return np.zeros(len(q))
        (axial, bending), rules = self._strains(q, v), self._rules
        power = self.total(rules[0][1], axial[1] ** 2, self.sections.axial)
        return self.rod.retardation * (power + self.total(rules[1][1], bending[1] ** 2, self.sections.bending))

    @property
    def _rules(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Points and weights, axial then bending."""
        return RULES[self.rod.quadrature][1:]

    @cached_property
    def _rest(self) -> tuple[Array, Array]:
        """Stretch and curvature [1/m] of the unstrained elements at their points, (elements, points)."""
        if not self.rod.curvature:
            return np.array(1.0), np.array(0.0)
        (axial_points, _), (bending_points, _) = self._rules
        tangent = np.einsum("pf,efc->epc", self._shapes(axial_points)[1], self.rest)
        slope, bend = (np.einsum("pf,efc->epc", shape, self.rest) for shape in self._shapes(bending_points)[1:])
        return np.linalg.norm(tangent, axis=-1), cross(slope, bend) / np.sum(slope**2, axis=-1)

    def _strains(self, q: Array, v: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Axial strain and curvature [1/m], each with its rate, at their points, (rows, elements, points)."""
        (axial_points, _), (bending_points, _) = self._rules
        tangent, turn = (self.values(self._shapes(axial_points)[1], x) for x in (q, v))
        stretch = np.linalg.norm(tangent, axis=-1)
        _, slope, bend = self._shapes(bending_points)
        s, s_t, b, b_t = (self.values(shape, x) for shape in (slope, bend) for x in (q, v))
        square = np.sum(s**2, axis=-1)
        curvature = cross(s, b) / square
        change = (cross(s_t, b) + cross(s, b_t) - 2 * curvature * np.sum(s * s_t, axis=-1)) / square
        return (stretch - self._rest[0], np.sum(tangent * turn, axis=-1) / stretch), (curvature - self._rest[1], change)

    def _shapes(self, xi: Array) -> tuple[Array, Array, Array]:
        """Hermite polynomials and their first two derivatives by s [1/m], (points, 4) each."""
        size, s = self.size, (1 + xi) / 2
        one = np.ones_like(s)
        shape = [1 - 3 * s**2 + 2 * s**3, size * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, size * (s**3 - s**2)]
        slope = [6 * (s**2 - s) / size, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / size, 3 * s**2 - 2 * s]
        bend = [(12 * s - 6) / size**2, (6 * s - 4) / size, (6 - 12 * s) / size**2, (6 * s - 2 * one) / size]
        return np.stack(shape, axis=1), np.stack(slope, axis=1), np.stack(bend, axis=1)
