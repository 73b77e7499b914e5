"""The flexible rod as Exudyn's ANCF cable, with its energy recomputed from the element's own definition.

Found from the residual of ObjectANCFCable2D, to 1e-14 of the force: the axial strain is |r'| - 1 and the
curvature (r' x r'') / |r'|^2, with derivatives by the arc length of the undeformed rod.
useReducedOrderIntegration 0 takes 5 Gauss points for the axial strain and 3 for the curvature;
1 takes 4 and 2 Gauss points; 2 takes 3 Lobatto points (ends and middle) and 2 Gauss points.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.engines.exudyn_bodies import Energy, Motion, Place, System
from shoal.engines.exudyn_chain import Chain, cross, gauss
from shoal.engines.exudyn_pose import Pose, normal
from shoal.scene import Rod
from shoal.trajectory import Array

LOBATTO_3 = (np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3)


@dataclass(frozen=True)
class CablePart(Chain):
    """A chain of ObjectANCFCable2D; coordinates of a node: r and r'."""

    @classmethod
    def add(cls, system: System, rod: Rod, pose: Pose) -> CablePart:
        """Enter a straight rod at its initial pose."""
        items, turn = system.items, pose.rate * normal(pose.axis)
        nodes, columns = [], []
        for s in np.linspace(0.0, rod.length, rod.elements + 1):
            node, places = system.node(
                items.NodePoint2DSlope1(
                    referenceCoordinates=[*pose.position((s, 0.0)), *pose.axis],
                    initialVelocities=[*pose.speed((s, 0.0)), *turn],
                )
            )
            nodes.append(node)
            columns.append(places)
        elements = []
        for pair in pairwise(nodes):
            cable = items.ObjectANCFCable2D(
                length=rod.length / rod.elements,
                massPerLength=rod.mass_per_length,
                bendingStiffness=rod.bending_stiffness,
                axialStiffness=rod.axial_stiffness,
                nodeNumbers=list(pair),
                useReducedOrderIntegration=0 if rod.quadrature == "full" else 2,
            )
            elements.append(system.mbs.AddObject(cable))
            system.weigh(elements[-1])
        return cls(rod, elements, np.array([first + last for first, last in pairwise(columns)]))

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.marker("MarkerBodyPosition", self.elements[index], ((1 + xi) * self.size / 2, 0.0))

    def turn(self, system: System, place: Place) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.marker("MarkerBodyRigid", self.elements[index], ((1 + xi) * self.size / 2, 0.0))

    def motion(self, q: Array, v: Array, place: Place) -> Motion:
        """See Part."""
        index, xi = self.find(place)
        shape, slope, _ = self._shapes(np.array([xi]))
        position = self.values(shape, q)[:, index, 0]
        tangent, turn = self.values(slope, q)[:, index, 0], self.values(slope, v)[:, index, 0]
        rate = cross(tangent, turn) / np.sum(tangent**2, axis=1)
        return Motion(position, np.arctan2(tangent[:, 1], tangent[:, 0]), rate)

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        full = self.rod.quadrature == "full"
        points, weights = gauss(5) if full else LOBATTO_3
        tangent = self.values(self._shapes(points)[1], q)
        strain = np.linalg.norm(tangent, axis=-1) - 1
        elastic = self.rod.axial_stiffness / 2 * self.total(weights, strain**2)
        points, weights = gauss(3) if full else gauss(2)
        _, slope, bend = self._shapes(points)
        tangent = self.values(slope, q)
        curvature = cross(tangent, self.values(bend, q)) / np.sum(tangent**2, axis=-1)
        elastic += self.rod.bending_stiffness / 2 * self.total(weights, curvature**2)
        points, weights = gauss(4)
        shape = self._shapes(points)[0]
        kinetic = self.rod.mass_per_length / 2 * self.total(weights, np.sum(self.values(shape, v) ** 2, axis=-1))
        return Energy(kinetic, elastic, self.moment(self.values(shape, q), weights))

    def _shapes(self, xi: Array) -> tuple[Array, Array, Array]:
        """Hermite polynomials and their first two derivatives by s [1/m], (points, 4) each."""
        size, s = self.size, (1 + xi) / 2
        one = np.ones_like(s)
        shape = [1 - 3 * s**2 + 2 * s**3, size * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, size * (s**3 - s**2)]
        slope = [6 * (s**2 - s) / size, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / size, 3 * s**2 - 2 * s]
        bend = [(12 * s - 6) / size**2, (6 * s - 4) / size, (6 - 12 * s) / size**2, (6 * s - 2 * one) / size]
        return np.stack(shape, axis=1), np.stack(slope, axis=1), np.stack(bend, axis=1)
