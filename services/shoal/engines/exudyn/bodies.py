"""Interface of bodies in Exudyn, and the rigid body of the plane.

Planar machines take Exudyn's planar items, not those of `space`: they are two to ten times faster with half the
error, and planar loops in space have redundant constraints, which Exudyn cannot solve by the trapezoidal rule
(docs/method.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from shoal.engines.course import Clock, PiecewiseFunction
from shoal.engines.poses import InitialPose, normal
from shoal.errors import InputError
from shoal.scene import Function, PointMass, RigidBody, Rod
from shoal.scene.dimensions import padded
from shoal.trajectory import Array

Place = tuple[float, ...]


class PointMotion(NamedTuple):
    """One material point: position [m] and velocity [m/s] (rows, 2), direction [rad] and rate [rad/s], (rows,).

    The direction lies in (-pi, pi] or is continuous.
    """

    position: Array
    velocity: Array
    direction: Array
    rate: Array


class Energy(NamedTuple):
    """Kinetic and elastic energy [J] (rows,), and mass times centre of mass [kg m] (rows, 2)."""

    kinetic: Array
    elastic: Array
    moment: Array


class Holder(Protocol):
    """Base of what joints and loads attach to: a body or the ground.

    q, v: all coordinates and velocities of the system, (rows, unknowns)
    """

    def hold(self, system: System, place: Place) -> Any:
        """A new marker at a place [m] in its frame, for joints."""
        ...

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """A new marker that turns with it there, `angle` [rad] ahead. Raises InputError."""
        ...

    def motion(self, q: Array, v: Array, place: Place) -> PointMotion:
        """Motion of a place."""
        ...


class BodyPart(Holder, Protocol):
    """One body of the scene."""

    def energy(self, q: Array, v: Array) -> Energy:
        """Energy of the whole body."""
        ...

    def damping(self, q: Array, v: Array) -> Array:
        """Power lost in the material [W], (rows,); none unless a part says otherwise."""
        return np.zeros(len(q))


@dataclass
class System:
    """An Exudyn system under construction, and the number of coordinates entered so far."""

    mbs: Any
    items: Any
    gravity: Place
    clock: Clock
    unknowns: int = field(default=0)

    def add(self, kind: str, **options: Any) -> Any:
        """Enter an item of Exudyn's class `kind`; its number."""
        family = next(family for family in ("Node", "Object", "Marker", "Load") if kind.startswith(family))
        return getattr(self.mbs, f"Add{family}")(getattr(self.items, kind)(**options))

    def enter(self, what: str) -> None:
        """Record the field of the scene that states the next items."""

    def function(self, make: Callable[..., Any], *given: Any) -> Any:
        """A function that Exudyn calls: what `make`, of `user`, makes of numbers and functions."""
        return make(*given)

    def vectors(self, given: Array) -> Any:
        """Points (n, 3) as a list of Exudyn's."""
        return self.items.exudyn.Vector3DList(given.tolist())

    def node(self, kind: str, begin: list[Any], rates: list[Any]) -> tuple[Any, list[int]]:
        """Enter a node with its coordinates at the start and their rates; its number and their columns."""
        columns = list(range(self.unknowns, self.unknowns + len(begin)))
        self.unknowns += len(columns)
        return self.add(kind, referenceCoordinates=begin, initialVelocities=rates), columns

    def course(self, f: Function, field: str, *, held: bool = False) -> PiecewiseFunction:
        """A function of time, as the clock has it. Raises InputError that names the field."""
        try:
            return self.clock.course(f, held=held)
        except InputError as error:
            raise InputError(f"{field}: {str(error).removeprefix('function: ')}") from None

    def marker(self, kind: str, body: Any, local: Place) -> Any:
        """Enter a marker of Exudyn's class `kind` at a local position [m] of one of its bodies."""
        return self.add(kind, bodyNumber=body, localPosition=[*padded(local, 3)])

    def turned(self, body: Any, local: Place, angle: float) -> Any:
        """Enter a marker with a direction: that of a body at a local position [m], turned by `angle` [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        frame = [[c, -s, 0.0, local[0]], [s, c, 0.0, local[1]], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
        return self.add("MarkerBodyRigid", bodyNumber=body, localHT=frame)

    def weigh(self, body: Any) -> None:
        """Let gravity act on the distributed mass of an element."""
        self.accelerate(body, self.gravity)

    def accelerate(self, body: Any, acceleration: Place, **options: Any) -> None:
        """Let an acceleration [m/s^2] act on the distributed mass of an element."""
        marker = self.add("MarkerBodyMass", bodyNumber=body)
        self.add("LoadMassProportional", markerNumber=marker, loadVector=[*padded(acceleration, 3)], **options)


@dataclass(frozen=True)
class RigidPart(BodyPart):
    """ObjectRigidBody2D, its node at the origin of the body's frame: zero inertia about the centre of mass is legal.

    A point mass is a rigid body held at its centre of mass, where nothing turns it; its inertia is of no consequence.
    """

    body: Any
    node: Any
    columns: list[int]
    mass: float
    inertia: float
    centre: Place
    reference: float
    """Angle [rad] at the start, from which Exudyn counts."""

    @classmethod
    def add(cls, system: System, given: Rod | RigidBody | PointMass, pose: InitialPose) -> RigidPart:
        """Enter a rigid body at its initial pose."""
        if isinstance(given, PointMass):
            centre, about_centre = (0.0, 0.0), given.mass
        else:
            centre, about_centre = given.centre_of_mass, given.inertia
        node, columns = system.node("NodeRigidBody2D", [*pose.origin, pose.angle], [*pose.velocity, pose.rate])
        inertia = about_centre + given.mass * (centre[0] ** 2 + centre[1] ** 2)
        body = system.add(
            "ObjectRigidBody2D", mass=given.mass, inertia=inertia, centerOfMass=[*centre], nodeNumber=node
        )
        marker = system.marker("MarkerBodyPosition", body, centre)
        weight = [given.mass * system.gravity[0], given.mass * system.gravity[1], 0.0]
        system.add("LoadForceVector", markerNumber=marker, loadVector=weight)
        return cls(body, node, columns, given.mass, about_centre, centre, pose.angle)

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        return system.marker("MarkerBodyPosition", self.body, place)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Part."""
        return system.turned(self.body, place, angle)

    def motion(self, q: Array, v: Array, place: Place) -> PointMotion:
        """See Part."""
        x, y, angle = self.columns
        arm = self._arm(q, place)
        return PointMotion(q[:, [x, y]] + arm, v[:, [x, y]] + v[:, [angle]] * normal(arm), q[:, angle], v[:, angle])

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        centre = self.motion(q, v, self.centre)
        kinetic = self.mass * np.sum(centre.velocity**2, axis=1) / 2 + self.inertia * centre.rate**2 / 2
        return Energy(kinetic, np.zeros(len(q)), self.mass * centre.position)

    def _arm(self, q: Array, place: Place) -> Array:
        axis = np.stack([np.cos(q[:, self.columns[2]]), np.sin(q[:, self.columns[2]])], axis=1)
        return place[0] * axis + place[1] * normal(axis)
