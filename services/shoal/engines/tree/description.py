"""A spatial tree of rigid bodies as data. Scenes are checked; what is made of them (`scene`) is not checked again."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from shoal.scene.joints import GROUND
from shoal.scene.record import Record

Vector3 = tuple[float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Kind = Literal["revolute", "prismatic", "spherical", "fixed"]

FREEDOMS: dict[str, int] = {"revolute": 1, "prismatic": 1, "spherical": 3, "fixed": 0}
"""Rates of each kind of joint."""


def _diagonal(value: Any) -> Any:
    """Three principal moments stand for a diagonal matrix."""
    if isinstance(value, list | tuple) and len(value) == 3 and not any(isinstance(v, list | tuple) for v in value):
        return tuple(tuple(v if row == column else 0.0 for column in range(3)) for row, v in enumerate(value))
    return value


def _sequence(value: Any) -> Any:
    """One number stands for a sequence of one."""
    return (value,) if isinstance(value, int | float) else value


Inertia = Annotated[Matrix3, BeforeValidator(_diagonal)]
Numbers = Annotated[tuple[float, ...], BeforeValidator(_sequence)]
"""One number for a revolute or prismatic joint, three for a spherical one."""


class SpatialBody(Record):
    """A rigid body: mass [kg], centre of mass [m], inertia about it [kg m^2], both in the body's frame.

    `inertia` is a symmetric 3 x 3 matrix, or its three diagonal entries.
    """

    mass: float
    inertia: Inertia
    centre_of_mass: Vector3 = (0.0, 0.0, 0.0)


class JointFrame(Record):
    """Position [m] and orientation of a joint's frame in a body's frame.

    `rotation` is the axis times the angle [rad] that turns the body's axes into those of the joint.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    rotation: Vector3 = (0.0, 0.0, 0.0)


class SpatialJoint(Record):
    """Hangs `body` on `parent`; the joint's frames on both coincide while its coordinate is zero.

    kind: `revolute` turns about `axis` (coordinate [rad]), `prismatic` slides along it [m], `spherical` turns
        freely (rates: angular velocity of the body relative to its parent in the joint's frame on the body
        [rad/s]), `fixed` does not move
    axis: direction in the joint's frame, of any length
    damping: torque over rate [N m s/rad], or force over rate [N s/m]
    load: applied torque [N m] or force [N], along the axis, or in the joint's frame on the body
    """

    body: str
    parent: str = GROUND
    kind: Kind = "revolute"
    axis: Vector3 | None = None
    on_parent: JointFrame = JointFrame()
    on_body: JointFrame = JointFrame()
    damping: float = 0.0
    load: Numbers | None = None


class JointState(Record):
    """State of a joint at time zero.

    coordinate: angle [rad] or distance [m]; of a spherical joint the axis times the angle [rad]
    rate: [rad/s] or [m/s]; of a spherical joint the relative angular velocity in its frame on the body
    """

    coordinate: Numbers | None = None
    rate: Numbers | None = None


class Place(Record):
    """A point fixed to a body [m], in its frame."""

    body: str
    position: Vector3 = (0.0, 0.0, 0.0)


class Load(Record):
    """A force [N] and a torque [N m] on a point [m] of a body, both constant in the fixed frame."""

    body: str
    position: Vector3 = (0.0, 0.0, 0.0)
    force: Vector3 = (0.0, 0.0, 0.0)
    torque: Vector3 = (0.0, 0.0, 0.0)


class SpatialChain(Record):
    """An open tree of rigid bodies in SI units; every body hangs on one joint, in any order."""

    name: str
    gravity: Vector3 = (0.0, 0.0, -9.81)
    bodies: dict[str, SpatialBody]
    joints: dict[str, SpatialJoint]
    points: dict[str, Place] = {}
    loads: dict[str, Load] = {}
    initial: dict[str, JointState] = {}

    @property
    def order(self) -> tuple[str, ...]:
        """Names of the joints, each after that of its parent."""
        hanging: dict[str, list[str]] = {}
        for name, joint in self.joints.items():
            hanging.setdefault(joint.parent, []).append(name)
        found, waiting = [], hanging.get(GROUND, [])[::-1]
        while waiting:
            name = waiting.pop()
            found.append(name)
            waiting += hanging.get(self.joints[name].body, [])[::-1]
        return tuple(found)
