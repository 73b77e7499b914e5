"""Attachments, by which joints, loads and markers name a place on a body, and what joins two of them."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator

from shoal.scene.function import Function
from shoal.scene.record import Record, Vector, Vector3

GROUND = "ground"
Z: Vector3 = (0.0, 0.0, 1.0)


class Attachment(Record):
    """A place on a body: a named point, or coordinates in the body's frame [m].

    On the ground, coordinates are fixed, and a name is that of one of the scene's moving points.
    """

    body: str
    """Name of the body, or `ground`."""
    point: str | Vector = "start"
    """Named point, or coordinates in the body's frame [m]; on a flexible rod the arc length and 0."""


def origin_of_ground(place: Any) -> Any:
    """Return a place with the origin for its point, if it names the ground and no point of it."""
    return {"point": (0.0, 0.0), **place} if isinstance(place, dict) and place.get("body") == GROUND else place


Direction = Annotated[Attachment, BeforeValidator(origin_of_ground)]
"""An attachment of whose body only the direction matters: on the ground the point may be left out."""


class MovingPoint(Record):
    """A point of the ground that moves."""

    x: Function = Function(number=0.0)
    """Coordinate x [m] as a function of time."""
    y: Function = Function(number=0.0)
    """Coordinate y [m] as a function of time."""
    z: Function = Function(number=0.0)
    """Coordinate z [m] as a function of time, in space."""


class Tie(Record):
    """Joins two places. turned: the sides of whose bodies' directions it speaks."""

    kind: str
    turned: ClassVar[tuple[str, ...]]
    first: Attachment
    """Place on the first body."""
    second: Attachment
    """Place on the second body."""


class DirectionTie(Tie):
    """Joins the directions of two bodies, independent of the places."""

    first: Direction
    """The first body."""
    second: Direction
    """The second body."""
