"""Stops, ropes, struts and contacts in Exudyn: surfaces on stiff springs, for a second opinion.

Exudyn has no rigid contacts: a contact is a force by its depth, here with the damping of Gonthier et al. (2004) and of
Carvalho and Martins (2019), which gives back a part of the rate whatever the masses. Springs are as stiff as the step
resolves. Depth and duration of an impact are proportional to stiffness^-1/2, hence to the step, and so is the
distance from the rigid contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from shoal.engines.exudyn.ends import SystemAttachments
from shoal.engines.exudyn.ground import coordinates
from shoal.engines.exudyn.joints import angle_of
from shoal.errors import InputError
from shoal.mechanics.assembly.masses import second_moments
from shoal.mechanics.fitting import start_value
from shoal.mechanics.reach import span
from shoal.scene import Attachment, Distance, Revolute, RigidBody, Rod, Scene, Slider
from shoal.scene.clearances import contacts_of
from shoal.scene.contact_law import loss_of
from shoal.scene.contacts import Contact
from shoal.scene.dimensions import padded
from shoal.scene.joints import Stops
from shoal.trajectory import Array

STEPS = 20.0
"""Steps of the integrator during an impact: half a period of mass and spring."""
LEAST = 0.01
"""Least restitution: Exudyn's damping grows without limit towards 0."""
CREEP = 1.0
"""Slip rate below which friction is proportional to it, over the step [m/s^2]: Exudyn's own 1e-3 m/s at 1 ms."""
WIDE = 1e3
"""Size of the triangle that stands for a line or a plane, over that of the machine."""
TINY = 1e-6
"""Radius that stands for a point on a circle, over that of the circle: Exudyn has no spheres without radius."""


@dataclass(frozen=True)
class Penalty:
    """A contact on a spring. stiffness: [N/m; of the stops of a hinge N m/rad; of a stated law N/m^exponent]

    gap: of a flat surface [m], (rows,), of q and v; deeper than `radius` [m] Exudyn lets a body through
    """

    stiffness: float
    radius: float = np.inf
    gap: Callable[[Array, Array], Array] | None = None

    def fallen(self, q: Array, v: Array) -> bool:
        """Return whether a body fell through the surface."""
        return self.gap is not None and bool(np.min(self.gap(q, v)) < -self.radius)


def add_contacts(ends: SystemAttachments) -> dict[str, Penalty]:
    """Enter stops, ropes, struts and contacts; their springs by the field. Raises InputError."""
    builder = _Builder(ends)
    return dict(builder.all())


class _Builder:
    def __init__(self, ends: SystemAttachments) -> None:
        self.ends, self.scene = ends, ends.scene
        self.step, self.size = float(ends.scene.solver.step), float(span(ends.scene))
        fall = max(float(np.linalg.norm(self.scene.gravity)), 1.0)
        starts = (np.linalg.norm(start.velocity or 0.0) for start in self.scene.initial.values())
        fastest = np.sqrt(2.0 * fall * self.size) + max(starts, default=0.0)
        self.slow = fall * self.step
        """Rate of an impact that is none [m/s]: what a step of free fall makes."""
        self.point = STEPS * self.step / np.pi * float(fastest)
        """Radius of a sphere that stands for a point on a flat surface [m]: the depth of a fast impact."""

    def all(self) -> Iterator[tuple[str, Penalty]]:
        for name, joint in self.scene.joints.items():
            where = f"joints.{name}"
            self.ends.system.enter(where)
            if isinstance(joint, Revolute) and joint.stops is not None:
                yield from self._hinge(f"{where}.stops", joint, joint.stops)
            elif isinstance(joint, Slider) and joint.stops is not None:
                yield from self._rail(f"{where}.stops", joint, joint.stops)
            elif isinstance(joint, Distance) and joint.keeps != "exactly":
                yield where, self._rope(joint)
        for where, contact in contacts_of(self.scene).items():
            self.ends.system.enter(where)
            yield where, self._contact(where, contact)

    def _hinge(self, where: str, joint: Revolute, stops: Stops) -> Iterator[tuple[str, Penalty]]:
        """Limits of the difference of two coordinates, which Exudyn counts from the start."""
        if self.scene.dimensions == 3:
            raise InputError(f"{where}: engine exudyn has no contact about an axis in space; use gauss or mujoco")
        stiffness = self._stiff * _reduced(_inertia(self.scene, side) for side in (joint.first, joint.second))
        start = self.ends.start_turn(joint.first, joint.second)
        sides = [angle_of(self.ends, where, side) for side in (joint.first, joint.second)]
        for end, sign in ((stops.min, 1.0), (stops.max, -1.0)):
            if end is None:
                continue
            self.ends.system.add(
                "ObjectContactCoordinate",
                markerNumbers=coordinates(self.ends.system, *sides[:: int(sign)]),
                offset=sign * (end - start),
                **self._spring(stiffness, stops.restitution, data=2),
            )
        yield where, Penalty(stiffness)

    def _rail(self, where: str, joint: Slider, stops: Stops) -> Iterator[tuple[str, Penalty]]:
        """Spheres that stand for the second place, before planes across the line."""
        line = self.ends.slide(joint)
        for name, end, sign in (("min", stops.min, 1.0), ("max", stops.max, -1.0)):
            if end is not None:
                spring = {"restitution": stops.restitution}
                yield f"{where}.{name}", self._flat(joint.second, joint.first, sign * line, sign * end, 0.0, **spring)

    def _rope(self, joint: Distance) -> Penalty:
        """A sphere in a hollow one, or two beside each other, whose centres are as far apart as their radii say."""
        length = (
            self.ends.start_distance(joint.first, joint.second) if joint.length is None else start_value(joint.length)
        )
        rope = joint.keeps == "at-most"
        radii = [TINY * length, (1.0 + TINY) * length] if rope else [length / 2.0, length / 2.0]
        return self._round(joint.first, joint.second, radii, rope, restitution=joint.restitution)

    def _contact(self, where: str, contact: Contact) -> Penalty:
        """Raises InputError for what Exudyn's contacts have not."""
        first, second = contact.first, contact.second
        for field, found in (
            ("rolling", contact.rolling),
            ("tangential_restitution", contact.tangential_restitution),
            ("mu_static", contact.mu_static is not None and contact.mu_static != contact.mu),
            ("first.axis", first.axis is not None),
            ("law.damping", contact.law is not None and contact.law.damping),
            ("law.viscosity", contact.law is not None and contact.law.viscosity),
        ):
            if found:
                raise InputError(f"{where}.{field}: contacts of engine exudyn have no counterpart of it; use gauss")
        law = {"restitution": contact.restitution, "mu": contact.mu, "law": contact.law}
        if second.shape in ("line", "plane"):
            return self._flat(first, second, self.ends.normal(second), 0.0, first.radius, **law)
        hole = second.hole is not None
        radius = second.hole if second.hole is not None else second.radius
        little = TINY * max(radius, first.radius)
        # Where a side is a point both radii change by as little, and the gap does not.
        radii = [max(first.radius, little), max(radius, little)]
        if not first.radius:
            radii[1] += little if hole else -little
        elif not radius:
            radii[0] -= little
        return self._round(first, second, radii, hole, **law)

    def _flat(
        self, first: Attachment, second: Attachment, normal: Array, place: float, radius: float, **law: Any
    ) -> Penalty:
        """A sphere and a triangle across `normal`, `place` [m] along it; that of a point is lower by its radius."""
        sphere = radius or self.point
        marker, axes = self.ends.faced(second, normal)
        wide = WIDE * self.size
        corners = np.array([[-wide, -wide, 0.0], [wide, -wide, 0.0], [0.0, 2.0 * wide, 0.0]])
        corners[:, 2] = place + radius - sphere
        spring = self._law(first, second, **law)
        self.ends.system.add(
            "ObjectContactSphereTriangle",
            markerNumbers=[self.ends.turn(first), marker],
            sphereRadius=sphere,
            trianglePoints=self.ends.system.vectors(corners @ axes.T),
            includeEdges=0,
            **spring,
        )

        def gap(q: Array, v: Array) -> Array:
            apart = self.ends.motion(first, q, v).position - self.ends.motion(second, q, v).position
            return np.asarray(np.sum(self.ends.pointing(second, normal, q, v) * apart, axis=1) - place - radius)

        return Penalty(spring["contactStiffness"], sphere, gap)

    def _round(self, first: Attachment, second: Attachment, radii: list[float], hollow: bool, **law: Any) -> Penalty:
        spring = self._law(first, second, **law)
        self.ends.system.add(
            "ObjectContactSphereSphere",
            markerNumbers=[self.ends.turn(first), self.ends.turn(second)],
            spheresRadii=radii,
            isHollowSphere1=hollow,
            **spring,
        )
        return Penalty(spring["contactStiffness"])

    def _law(
        self, first: Attachment, second: Attachment, restitution: float = 0.0, mu: float = 0.0, law: Any = None
    ) -> dict[str, Any]:
        """Return the options of a contact of spheres: a stated law, or a spring for a restitution."""
        friction = {"dynamicFriction": mu, "frictionProportionalZone": CREEP * self.step}
        if law is None:
            mass = _reduced(_mass(self.scene, side) for side in (first, second))
            return friction | self._spring(mass * self._stiff, restitution, data=4)
        found = self._spring(law.stiffness, 1.0 if law.restitution is None else law.restitution, data=4)
        return friction | found | {"contactStiffnessExponent": law.exponent}

    @property
    def _stiff(self) -> float:
        """Stiffness over mass whose half period is `STEPS` steps [1/s^2]."""
        return float((np.pi / (STEPS * self.step)) ** 2)

    def _spring(self, stiffness: float, restitution: float, data: int) -> dict[str, Any]:
        """Return stiffness and damping; data: of numbers that Exudyn keeps of a contact, first of them the gap."""
        node = self.ends.system.add(
            "NodeGenericData", initialCoordinates=[1.0] + [0.0] * (data - 1), numberOfDataCoordinates=data
        )
        return {
            "nodeNumber": node,
            "contactStiffness": float(stiffness),
            "impactModel": 2,
            "restitutionCoefficient": coefficient(max(restitution, LEAST)),
            "minimumImpactVelocity": self.slow,
        }


def coefficient(restitution: float) -> float:
    """Return the coefficient of Exudyn's impact model 2 that gives back just so much of the rate.

    Its damping over the stiffness and the rate of impact is a fit; `loss_of` has the exact one.
    """
    if restitution >= 1.0:
        return 1.0
    wanted = loss_of(restitution)
    return float(brentq(lambda e: model_2(e) - wanted, 1e-6, 1.0))


def model_2(e: float) -> float:
    """Return the damping of Exudyn's impact model 2 over stiffness and rate of impact [1], by its documentation."""
    return 1.5 * (1.0 - e) * (11.0 - e) / (1.0 + 9.0 * e) if e > 1.0 / 3.0 else (1.0 - e * e) / e


def _reduced(shares: Iterator[float]) -> float:
    """Return the mass that two bodies strike each other with."""
    return 1.0 / sum(1.0 / share for share in shares)


def _mass(scene: Scene, at: Attachment) -> float:
    """Return the mass of a free body at a place, across the line to its centre of mass: the least there [kg]."""
    body = scene.bodies.get(at.body)
    if body is None:
        return np.inf
    if isinstance(body, Rod) and body.element != "rigid":
        return float(body.mass / body.elements)
    if isinstance(body, Rod | RigidBody):
        arm = np.subtract(padded(scene.location(at), 3), padded(body.centre_of_mass, 3))
        inertia = np.trace(second_moments(body)) * (1.0 if scene.dimensions == 2 else 2.0 / 3.0)
        return float(1.0 / (1.0 / body.mass + (arm @ arm / inertia if inertia > 0.0 else 0.0)))
    return float(body.mass)


def _inertia(scene: Scene, at: Attachment) -> float:
    """Return the moment of inertia of a rigid body of the plane about a place [kg m^2]."""
    body = scene.bodies.get(at.body)
    if not isinstance(body, Rod | RigidBody):
        return np.inf
    arm = np.subtract(scene.location(at), body.centre_of_mass)
    return float(body.inertia + body.mass * arm @ arm)
