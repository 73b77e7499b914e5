"""Joints, and the attachments by which joints and markers name a place on a body."""

from __future__ import annotations

from typing import Literal

from shoal.scene.record import NonNegative, Record, Vector

GROUND = "ground"


class Attachment(Record):
    """A place on a body: a named point, or coordinates in the body's frame [m]. `ground` has only coordinates."""

    body: str
    point: str | Vector = "start"


class Revolute(Record):
    """Two places stay together; the bodies turn freely but for viscous friction [N m s/rad]."""

    kind: Literal["revolute"] = "revolute"
    first: Attachment
    second: Attachment
    friction: NonNegative = 0.0


Joint = Revolute
