"""What the engine asks of a body inside Exudyn, and the rigid body that answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from shoal.engines.exudyn_pose import Pose, normal
from shoal.scene import RigidBody, Rod
from shoal.trajectory import Array

Place = tuple[float, float]


class Motion(NamedTuple):
    """One material point: position [m] (rows, 2), direction [rad] in (-pi, pi] or continuous, rate [rad/s], (rows,)."""

    position: Array
    direction: Array
    rate: Array


class Energy(NamedTuple):
    """Kinetic and elastic energy [J] (rows,), and mass times centre of mass [kg m] (rows, 2)."""

    kinetic: Array
    elastic: Array
    moment: Array


class Part(Protocol):
    """One body of the scene. q, v: all coordinates and velocities of the system, (rows, unknowns)."""

    def hold(self, system: System, place: Place) -> Any:
        """A new marker at a place [m] in the body's frame, for joints."""
        ...

    def turn(self, system: System, place: Place) -> Any:
        """A new marker that turns with the body there, for joint friction. Raises InputError."""
        ...

    def motion(self, q: Array, v: Array, place: Place) -> Motion:
        """Motion of a place."""
        ...

    def energy(self, q: Array, v: Array) -> Energy:
        """Energy of the whole body."""
        ...


@dataclass
class System:
    """An Exudyn system under construction, and the number of coordinates entered so far."""

    mbs: Any
    items: Any
    gravity: Place
    unknowns: int = field(default=0)

    def node(self, item: Any) -> tuple[Any, list[int]]:
        """Enter a node; its number and the columns of its coordinates."""
        columns = list(range(self.unknowns, self.unknowns + len(item.referenceCoordinates)))
        self.unknowns += len(columns)
        return self.mbs.AddNode(item), columns

    def marker(self, kind: str, body: Any, local: Place) -> Any:
        """Enter a marker of Exudyn's class `kind` at a local position [m] of one of its bodies."""
        return self.mbs.AddMarker(getattr(self.items, kind)(bodyNumber=body, localPosition=[*local, 0.0]))

    def weigh(self, body: Any) -> None:
        """Let gravity act on the distributed mass of an element."""
        marker = self.mbs.AddMarker(self.items.MarkerBodyMass(bodyNumber=body))
        self.mbs.AddLoad(self.items.LoadMassProportional(markerNumber=marker, loadVector=[*self.gravity, 0.0]))


@dataclass(frozen=True)
class RigidPart:
    """ObjectRigidBody2D, its node at the origin of the body's frame: zero inertia about the centre of mass is legal."""

    body: Any
    columns: list[int]
    given: Rod | RigidBody

    @classmethod
    def add(cls, system: System, given: Rod | RigidBody, pose: Pose) -> RigidPart:
        """Enter a rigid body at its initial pose."""
        items, mbs = system.items, system.mbs
        start = [*pose.velocity, pose.rate]
        node, columns = system.node(
            items.NodeRigidBody2D(referenceCoordinates=[*pose.origin, pose.angle], initialVelocities=start)
        )
        x, y = given.centre_of_mass
        inertia = given.inertia + given.mass * (x * x + y * y)
        body = mbs.AddObject(
            items.ObjectRigidBody2D(mass=given.mass, inertia=inertia, centerOfMass=[x, y], nodeNumber=node)
        )
        marker = system.marker("MarkerBodyPosition", body, (x, y))
        weight = [given.mass * system.gravity[0], given.mass * system.gravity[1], 0.0]
        mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=weight))
        return cls(body, columns, given)

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        return system.marker("MarkerBodyPosition", self.body, place)

    def turn(self, system: System, place: Place) -> Any:
        """See Part."""
        return system.marker("MarkerBodyRigid", self.body, place)

    def motion(self, q: Array, v: Array, place: Place) -> Motion:
        """See Part."""
        x, y, angle = self.columns
        return Motion(q[:, [x, y]] + self._arm(q, place), q[:, angle], v[:, angle])

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        x, y, angle = self.columns
        arm = self._arm(q, self.given.centre_of_mass)
        speed = v[:, [x, y]] + v[:, [angle]] * normal(arm)
        kinetic = self.given.mass * np.sum(speed**2, axis=1) / 2 + self.given.inertia * v[:, angle] ** 2 / 2
        return Energy(kinetic, np.zeros(len(q)), self.given.mass * (q[:, [x, y]] + arm))

    def _arm(self, q: Array, place: Place) -> Array:
        axis = np.stack([np.cos(q[:, self.columns[2]]), np.sin(q[:, self.columns[2]])], axis=1)
        return place[0] * axis + place[1] * normal(axis)
