"""The flexible rod as Exudyn's geometrically exact beam: a second opinion with shear and rotary inertia.

Found from the residual of ObjectBeamGeometricallyExact2D with three nodes: quadratic r and theta; strains
r' . t1 - 1, r' . t2 and theta', where t1 is normal to the section and t2 lies in it; 2 Gauss points for all
three, the reduced rule that keeps the quadratic element free of shear locking; 3 Gauss points for the mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.exudyn.bodies import BodyPart, Energy, Place, PointMotion, System
from shoal.engines.exudyn.chain import Chain, cross, gauss
from shoal.engines.poses import InitialPose
from shoal.engines.sections import Sections
from shoal.errors import InputError
from shoal.scene import Rod
from shoal.trajectory import Array


@dataclass(frozen=True)
class BeamPart(Chain, BodyPart):
    """A chain of three-node ObjectBeamGeometricallyExact2D; coordinates of a node: r and the section's angle."""

    nodes: list[Any]

    @classmethod
    def add(cls, system: System, rod: Rod, pose: InitialPose) -> BeamPart:
        """Enter a straight rod at its initial pose."""
        sections = Sections.stout(rod, "simo-reissner")
        nodes, columns, elements = [], [], []
        for s in np.linspace(0.0, rod.length, 2 * rod.elements + 1):
            begin, rates = [*pose.position((s, 0.0)), pose.angle], [*pose.speed((s, 0.0)), pose.rate]
            node, places = system.node("NodeRigidBody2D", begin, rates)
            nodes.append(node)
            columns.append(places)
        for k in range(rod.elements):
            beam = system.add(
                "ObjectBeamGeometricallyExact2D",
                nodeNumbers=nodes[2 * k : 2 * k + 3],
                length=rod.length / rod.elements,
                massPerLength=sections.mass[k],
                crossSectionInertia=sections.inertia[k],
                bendingStiffness=sections.bending[k],
                axialStiffness=sections.axial[k],
                shearStiffness=sections.shear[k],
                includeReferenceRotations=True,
            )
            elements.append(beam)
            system.weigh(beam)
        per_element = [columns[i] + columns[i + 1] + columns[i + 2] for i in range(0, 2 * rod.elements, 2)]
        return cls(rod, sections, elements, np.array(per_element), nodes)

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.marker("MarkerBodyPosition", self.elements[index], (xi * self.size / 2, 0.0))

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Part; Exudyn gives a direction to the nodes of this beam only, and the marker the beam's own."""
        index = round(2 * place[0] / self.size)
        if abs(index * self.size / 2 - place[0]) > 1e-9 * self.rod.length:
            raise InputError(
                f"joints: a direction at [{place[0]:g}, 0] needs a beam node there, found every {self.size / 2:g} m"
            )
        if angle:
            raise InputError("joints: engine exudyn-ge keeps no angle of a flexible rod but 0; use exudyn")
        return system.add("MarkerNodeRigid", nodeNumber=self.nodes[index])

    def motion(self, q: Array, v: Array, place: Place) -> PointMotion:
        """See Part."""
        index, xi = self.find(place)
        shape, _ = self._shapes(np.array([xi]))
        here, speed = self.values(shape, q)[:, index, 0], self.values(shape, v)[:, index, 0]
        return PointMotion(here[:, :2], speed[:, :2], here[:, 2], speed[:, 2])

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        points, weights = gauss(2)
        shape, slope = self._shapes(points)
        angle, change = self.values(shape, q)[..., 2], self.values(slope, q)
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        axial = np.sum(change[..., :2] * along, axis=-1) - 1
        shear = cross(along, change[..., :2])
        stiffness = (self.sections.axial, self.sections.shear, self.sections.bending)
        strains = (axial, shear, change[..., 2])
        elastic = sum(
            (self.total(weights, e**2, k / 2) for k, e in zip(stiffness, strains, strict=True)), np.zeros(len(q))
        )
        points, weights = gauss(3)
        shape, _ = self._shapes(points)
        speed = self.values(shape, v) ** 2
        kinetic = self.total(weights, speed[..., 0] + speed[..., 1], self.sections.mass / 2)
        kinetic += self.total(weights, speed[..., 2], self.sections.inertia / 2)
        return Energy(kinetic, elastic, self.total(weights, self.values(shape, q)[..., :2], self.sections.mass))

    def _shapes(self, xi: Array) -> tuple[Array, Array]:
        """Quadratic Lagrange polynomials and their derivative by s [1/m], (points, 3) each."""
        shape = [xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2]
        slope = [xi - 0.5, -2 * xi, xi + 0.5]
        return np.stack(shape, axis=1), np.stack(slope, axis=1) * 2 / self.size
