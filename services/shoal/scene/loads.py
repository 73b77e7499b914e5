"""Loads: springs and dampers between bodies, forces and torques on them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shoal.scene.function import Function
from shoal.scene.joints import Attachment, Z
from shoal.scene.record import Axis, NonNegative, Record, Vector, kinds


class Elastic(Record):
    """Base of springs: a polynomial law and a damper between two places."""

    kind: str
    first: Attachment
    second: Attachment
    stiffness: float = 0.0
    cubic: float = 0.0
    damping: NonNegative = 0.0


class Spring(Elastic):
    """A spring and damper between two places, along the line that joins them.

    stiffness [N/m], cubic [N/m^3], damping [N s/m]; length: where it pulls with no force [m] (default: the
    distance at the start); elastic: further elastic force [N], a function of the elongation [m] called `t`.
    """

    kind: Literal["spring"] = "spring"
    length: NonNegative | None = None
    elastic: Function | None = None


class TorsionSpring(Elastic):
    """A spring and damper between the directions of two bodies.

    stiffness [N m/rad], cubic [N m/rad^3], damping [N m s/rad]; angle: relative angle of rest [rad] (default: that of
    the start), counted over full turns; elastic: further elastic torque [N m], a function of the angle from rest [rad]
    called `t`. axis: in space, that the angle is about, as it points at the start; a joint keeps it common to both.
    first_to, second_to: in the plane, the direction of that side is the way to this place, in the place of the body's;
    so a point mass has one.
    """

    kind: Literal["torsion-spring"] = "torsion-spring"
    first_to: Attachment | None = None
    second_to: Attachment | None = None
    axis: Axis = Z
    angle: float | None = None
    elastic: Function | None = None


class Force(Record):
    """A force [N] at a place: fixed in direction, or turning with the body; times a function of time."""

    kind: Literal["force"] = "force"
    at: Attachment
    force: Vector
    follows: bool = False
    scale: Function = Function(number=1.0)


class Torque(Record):
    """A torque [N m] on a body, counter-clockwise, as a function of time; `reaction`: the body that takes it.

    axis: in space, that of the torque as it points at the start; it turns with the body that takes the torque, and is
    fixed where the ground does.
    """

    kind: Literal["torque"] = "torque"
    at: Attachment
    torque: Function
    axis: Axis = Z
    reaction: Attachment | None = None


class DistributedForce(Record):
    """A force per length [N/m] along a whole rod, fixed in direction; times a function of time."""

    kind: Literal["distributed-force"] = "distributed-force"
    body: str
    force: Vector
    scale: Function = Function(number=1.0)


Load = Annotated[Spring | TorsionSpring | Force | Torque | DistributedForce, Field(discriminator="kind")]
LOAD_KINDS = kinds(Load)
