"""The flexible rod as Exudyn's geometrically exact beam: a second opinion with shear and rotary inertia.

Found from the residual of ObjectBeamGeometricallyExact2D with three nodes: quadratic r and theta; strains
r' . t1 - 1, r' . t2 and theta', where t1 is normal to the section and t2 lies in it; 2 Gauss points for all
three, the reduced rule that keeps the quadratic element free of shear locking; 3 Gauss points for the mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.exudyn_bodies import Energy, Motion, Place, System
from shoal.engines.exudyn_chain import Chain, cross, gauss
from shoal.engines.exudyn_pose import Pose
from shoal.errors import InputError
from shoal.scene import Rod
from shoal.trajectory import Array


@dataclass(frozen=True)
class BeamPart(Chain):
    """A chain of three-node ObjectBeamGeometricallyExact2D; coordinates of a node: r and the section's angle."""

    nodes: list[Any]

    @classmethod
    def add(cls, system: System, rod: Rod, pose: Pose) -> BeamPart:
        """Enter a straight rod at its initial pose."""
        items = system.items
        nodes, columns = [], []
        for s in np.linspace(0.0, rod.length, 2 * rod.elements + 1):
            node, places = system.node(
                items.NodeRigidBody2D(
                    referenceCoordinates=[*pose.position((s, 0.0)), pose.angle],
                    initialVelocities=[*pose.speed((s, 0.0)), pose.rate],
                )
            )
            nodes.append(node)
            columns.append(places)
        elements = []
        for first in range(0, 2 * rod.elements, 2):
            beam = items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=nodes[first : first + 3],
                length=rod.length / rod.elements,
                massPerLength=rod.mass_per_length,
                crossSectionInertia=section_inertia(rod),
                bendingStiffness=rod.bending_stiffness,
                axialStiffness=rod.axial_stiffness,
                shearStiffness=shear_stiffness(rod),
                includeReferenceRotations=True,
            )
            elements.append(system.mbs.AddObject(beam))
            system.weigh(elements[-1])
        per_element = [columns[i] + columns[i + 1] + columns[i + 2] for i in range(0, 2 * rod.elements, 2)]
        return cls(rod, elements, np.array(per_element), nodes)

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        index, xi = self.find(place)
        return system.marker("MarkerBodyPosition", self.elements[index], (xi * self.size / 2, 0.0))

    def turn(self, system: System, place: Place) -> Any:
        """See Part; Exudyn gives a rate to the nodes of this beam, not to the points between."""
        index = round(2 * place[0] / self.size)
        if abs(index * self.size / 2 - place[0]) > 1e-9 * self.rod.length:
            raise InputError(
                f"joints: friction at [{place[0]:g}, 0] needs a beam node there, found every {self.size / 2:g} m"
            )
        return system.mbs.AddMarker(system.items.MarkerNodeRigid(nodeNumber=self.nodes[index]))

    def motion(self, q: Array, v: Array, place: Place) -> Motion:
        """See Part."""
        index, xi = self.find(place)
        shape, _ = self._shapes(np.array([xi]))
        here, speed = self.values(shape, q)[:, index, 0], self.values(shape, v)[:, index, 0]
        return Motion(here[:, :2], here[:, 2], speed[:, 2])

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        points, weights = gauss(2)
        shape, slope = self._shapes(points)
        angle, change = self.values(shape, q)[..., 2], self.values(slope, q)
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        axial = np.sum(change[..., :2] * along, axis=-1) - 1
        shear = cross(along, change[..., :2])
        stiffness = (self.rod.axial_stiffness, shear_stiffness(self.rod), self.rod.bending_stiffness)
        strains = (axial, shear, change[..., 2])
        density = sum((k / 2 * e**2 for k, e in zip(stiffness, strains, strict=True)), np.zeros_like(axial))
        points, weights_mass = gauss(3)
        shape, _ = self._shapes(points)
        inertia = np.array([self.rod.mass_per_length] * 2 + [section_inertia(self.rod)])
        kinetic = self.total(weights_mass, self.values(shape, v) ** 2 @ inertia) / 2
        moment = self.moment(self.values(shape, q)[..., :2], weights_mass)
        return Energy(kinetic, self.total(weights, density), moment)

    def _shapes(self, xi: Array) -> tuple[Array, Array]:
        """Quadratic Lagrange polynomials and their derivative by s [1/m], (points, 3) each."""
        shape = [xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2]
        slope = [xi - 0.5, -2 * xi, xi + 0.5]
        return np.stack(shape, axis=1), np.stack(slope, axis=1) * 2 / self.size


def shear_stiffness(rod: Rod) -> float:
    """k G A [N] with G = E / (2 (1 + nu)) and k of a rectangle: Cowper (1966), J. Appl. Mech. 33, 335, table 1."""
    nu = rod.poisson_ratio
    return 10 * (1 + nu) / (12 + 11 * nu) * rod.axial_stiffness / (2 * (1 + nu))


def section_inertia(rod: Rod) -> float:
    """Rotary inertia of the section per length, rho I [kg m]."""
    return rod.density * rod.width * rod.height**3 / 12
