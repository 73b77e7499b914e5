"""Joints, and the attachments by which joints, loads and markers name a place on a body."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from shoal.scene.function import Function
from shoal.scene.record import Angle, NonNegative, Positive, Record, Vector, kinds

GROUND = "ground"


class Attachment(Record):
    """A place on a body: a named point, or coordinates in the body's frame [m].

    On the ground, coordinates are fixed, and a name is that of one of the scene's moving points.
    """

    body: str
    point: str | Vector = "start"


class MovingPoint(Record):
    """A point of the ground that moves: coordinates [m] as functions of time."""

    x: Function = Function(number=0.0)
    y: Function = Function(number=0.0)


class Tie(Record):
    """Joins two places. turned: the sides of whose bodies' directions it speaks."""

    kind: str
    turned: ClassVar[tuple[str, ...]]
    first: Attachment
    second: Attachment


class Revolute(Tie):
    """Two places stay together; the bodies turn freely but for friction.

    friction: viscous [N m s/rad]; coulomb: dry friction torque [N m], smoothed as tanh(rate / coulomb_speed).
    """

    kind: Literal["revolute"] = "revolute"
    turned: ClassVar[tuple[str, ...]] = ()
    friction: NonNegative = 0.0
    coulomb: NonNegative = 0.0
    coulomb_speed: Positive = 1e-2


class Weld(Tie):
    """Two places stay together and the bodies keep their relative angle [rad] (default: that of the start)."""

    kind: Literal["weld"] = "weld"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    angle: Angle | None = None


class Slider(Tie):
    """The second place moves on a line through the first one, fixed to the first body.

    direction: angle [rad] of the line in the first body's frame. rotation: whether the second body may turn against
    the first. friction: viscous [N s/m]; coulomb [N], smoothed as tanh(speed / coulomb_speed).
    """

    kind: Literal["slider"] = "slider"
    turned: ClassVar[tuple[str, ...]] = ("first",)
    direction: Angle = 0.0
    rotation: Literal["free", "locked"] = "free"
    friction: NonNegative = 0.0
    coulomb: NonNegative = 0.0
    coulomb_speed: Positive = 1e-2


class Distance(Tie):
    """Two places keep a distance [m] (default: that of the start), or one that is a function of time."""

    kind: Literal["distance"] = "distance"
    turned: ClassVar[tuple[str, ...]] = ()
    length: Function | None = None


class Parallel(Tie):
    """The directions of two bodies stay parallel."""

    kind: Literal["parallel"] = "parallel"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")


class Perpendicular(Tie):
    """The directions of two bodies stay perpendicular."""

    kind: Literal["perpendicular"] = "perpendicular"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")


class DrivenAngle(Tie):
    """The angle [rad] from the first body's direction to the second's is a function of time."""

    kind: Literal["driven-angle"] = "driven-angle"
    turned: ClassVar[tuple[str, ...]] = ("first", "second")
    angle: Function


class CoupledCoordinate(Record):
    """A coordinate of a place, with its factor in a coupling."""

    at: Attachment
    axis: Literal["x", "y"]
    factor: float = 1.0


class Coupling(Record):
    """The sum of factor * coordinate equals a function of time [m]."""

    kind: Literal["coupling"] = "coupling"
    turned: ClassVar[tuple[str, ...]] = ()
    terms: Annotated[tuple[CoupledCoordinate, ...], Field(min_length=1)]
    value: Function = Function(number=0.0)


def _revolute_if_unsaid(data: Any) -> Any:
    return {"kind": "revolute", **data} if isinstance(data, dict) else data


Joint = Annotated[
    Annotated[
        Revolute | Weld | Slider | Distance | Parallel | Perpendicular | DrivenAngle | Coupling,
        Field(discriminator="kind"),
    ],
    BeforeValidator(_revolute_if_unsaid),
]
"""A joint without a kind is a revolute one."""
JOINT_KINDS = kinds(Joint)


def sides(record: Record) -> dict[str, Attachment]:
    """The attachments of a joint or a load, by the path of their field."""
    found = {}
    for field, value in record:
        if isinstance(value, Attachment):
            found[field] = value
        for number, part in enumerate(value if isinstance(value, tuple) else ()):
            if isinstance(part, Record):
                found |= {f"{field}.{number}.{inner}": at for inner, at in sides(part).items()}
    return found


def places(joint: Joint) -> tuple[Attachment, ...]:
    """The attachments of a joint."""
    return tuple(sides(joint).values())


def turned(joint: Joint) -> dict[str, Attachment]:
    """The attachments of whose bodies' directions a joint speaks, by the path of their field."""
    if isinstance(joint, Weld) and joint.angle is None:
        return {}
    return {side: getattr(joint, side) for side in joint.turned}
