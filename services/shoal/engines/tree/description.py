"""The description of a spatial tree of rigid bodies: everything a user states, checked as a whole."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, model_validator

from shoal.errors import InputError
from shoal.scene.joints import GROUND
from shoal.scene.record import Angle, NonNegative, Positive, Record, one_line
from shoal.scene.scene import Name

Vector3 = tuple[float, float, float]
RotationVector = tuple[Angle, Angle, Angle]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Kind = Literal["revolute", "prismatic", "spherical", "fixed"]

FREEDOMS: dict[str, int] = {"revolute": 1, "prismatic": 1, "spherical": 3, "fixed": 0}
"""Rates of each kind of joint."""
ROUND_OFF = 1e-9
"""How far, relative to the largest moment, an inertia may miss symmetry and the triangle inequality."""


def _diagonal(value: Any) -> Any:
    """Three principal moments stand for a diagonal matrix."""
    if isinstance(value, list | tuple) and len(value) == 3 and not any(isinstance(v, list | tuple) for v in value):
        return tuple(tuple(v if row == column else 0.0 for column in range(3)) for row, v in enumerate(value))
    return value


def _physical(value: Matrix3) -> Matrix3:
    matrix = np.array(value)
    size = float(np.max(np.abs(matrix)))
    if not np.all(np.abs(matrix - matrix.T) <= ROUND_OFF * size):
        raise ValueError("an inertia is a symmetric matrix, or three principal moments (kg m^2)")
    small, middle, large = np.linalg.eigvalsh(matrix)
    if not small > 0:
        raise ValueError(f"an inertia is positive definite, its smallest principal moment is {small:.3g} kg m^2")
    if large > (small + middle) * (1 + ROUND_OFF):
        raise ValueError(
            f"no body has the principal moments {small:.3g}, {middle:.3g}, {large:.3g} kg m^2: "
            "the largest is at most the sum of the others"
        )
    return value


def _sequence(value: Any) -> Any:
    """One number stands for a sequence of one."""
    return (value,) if isinstance(value, int | float) else value


Inertia = Annotated[Matrix3, BeforeValidator(_diagonal), AfterValidator(_physical)]
Numbers = Annotated[tuple[float, ...], BeforeValidator(_sequence)]
"""One number for a revolute or prismatic joint, three for a spherical one."""


class SpatialBody(Record):
    """A rigid body: mass [kg], centre of mass [m], inertia about it [kg m^2], both in the body's frame.

    `inertia` is a symmetric 3 x 3 matrix, or its three diagonal entries.
    """

    mass: Positive
    inertia: Inertia
    centre_of_mass: Vector3 = (0.0, 0.0, 0.0)


class JointFrame(Record):
    """Position [m] and orientation of a joint's frame in a body's frame.

    `rotation` is the axis times the angle [rad] that turns the body's axes into those of the joint.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    rotation: RotationVector = (0.0, 0.0, 0.0)


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
    damping: NonNegative = 0.0
    load: Numbers | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind in ("revolute", "prismatic"):
            if self.axis is None:
                raise ValueError(f"axis is missing; a {self.kind} joint needs one")
            if not math.hypot(*self.axis) > 0:
                raise ValueError("axis is zero; give a direction such as [0, 0, 1]")
        elif self.axis is not None:
            raise ValueError(f"axis: a {self.kind} joint has none")
        if self.kind == "fixed" and self.damping > 0:
            raise ValueError("damping: a fixed joint does not move")
        _check_count("load", self.load, self.kind)
        return self


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
    """An open tree of rigid bodies in SI units; every body hangs on one joint, in any order.

    Raises pydantic's ValidationError; `SpatialChain.parse` raises `InputError` in one line.
    """

    name: str
    gravity: Vector3 = (0.0, 0.0, -9.81)
    bodies: Annotated[dict[Name, SpatialBody], Field(min_length=1)]
    joints: dict[Name, SpatialJoint]
    points: dict[Name, Place] = {}
    loads: dict[Name, Load] = {}
    initial: dict[str, JointState] = {}

    @classmethod
    def parse(cls, data: Any, source: str = "chain") -> SpatialChain:
        """Check `data` (as read from YAML or JSON). Raises InputError, one line that names the field."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise one_line(error, source, cls) from None
        except RecursionError:
            raise InputError(f"{source}: nested too deeply") from None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if GROUND in self.bodies:
            raise ValueError("bodies.ground: the name 'ground' is taken by the fixed frame")
        held: dict[str, str] = {}
        for name, joint in self.joints.items():
            self._check_body(f"joints.{name}.body", joint.body)
            if joint.parent != GROUND:
                self._check_body(f"joints.{name}.parent", joint.parent)
            if joint.body in held:
                raise ValueError(
                    f"joints.{name}.body: {joint.body} hangs on {held[joint.body]} already; trees are open"
                )
            held[joint.body] = name
        loose = set(self.bodies) - {self.joints[name].body for name in self.order}
        for body in self.bodies:
            if body in loose:
                raise ValueError(f"bodies.{body}: no chain of joints connects it to the ground")
        for name, place in self.points.items():
            self._check_body(f"points.{name}.body", place.body)
        for name, load in self.loads.items():
            self._check_body(f"loads.{name}.body", load.body)
        for name, state in self.initial.items():
            if name not in self.joints:
                raise ValueError(f"initial.{name}: no such joint; there are {', '.join(self.joints)}")
            for field in ("coordinate", "rate"):
                _check_count(f"initial.{name}.{field}", getattr(state, field), self.joints[name].kind)
        return self

    def _check_body(self, where: str, body: str) -> None:
        if body not in self.bodies:
            known = ", ".join(list(self.bodies)[:8]) + (", ..." if len(self.bodies) > 8 else "")
            raise ValueError(f"{where}: no body {body!r}; there are {known}")

    @property
    def order(self) -> tuple[str, ...]:
        """Names of the joints, each after that of its parent; what is not connected to the ground is left out."""
        hanging: dict[str, list[str]] = {}
        for name, joint in self.joints.items():
            hanging.setdefault(joint.parent, []).append(name)
        found, waiting = [], hanging.get(GROUND, [])[::-1]
        while waiting:
            name = waiting.pop()
            found.append(name)
            waiting += hanging.get(self.joints[name].body, [])[::-1]
        return tuple(found)


def _check_count(where: str, values: tuple[float, ...] | None, kind: str) -> None:
    if values is not None and len(values) != FREEDOMS[kind]:
        raise ValueError(f"{where}: a {kind} joint takes {FREEDOMS[kind]}, found {len(values)} numbers")
