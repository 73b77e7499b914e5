"""The places of a scene inside Exudyn: which part has them, markers on them, and how they move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.exudyn.bodies import Holder, Place, PointMotion, System
from shoal.engines.exudyn.chain import Chain
from shoal.engines.poses import InitialPose, owner, start_of
from shoal.errors import InputError
from shoal.mechanics.start.rigid_bodies import lead
from shoal.scene import Attachment, PointMass, Scene, Slider
from shoal.scene.contacts import ContactSurface
from shoal.trajectory import Array


@dataclass(frozen=True)
class SystemAttachments:
    """Attachments of a scene on the parts of a system; poses: where the parts start."""

    scene: Scene
    system: System
    parts: dict[str, Holder]
    poses: dict[str, InitialPose]

    def part(self, at: Attachment) -> tuple[Holder, Place]:
        """The part that an attachment is on, and its place there [m]."""
        return self.parts[owner(at)], self.scene.location(at)

    def hold(self, at: Attachment) -> Any:
        """A new marker with the position of an attachment."""
        part, place = self.part(at)
        return part.hold(self.system, place)

    def turn(self, at: Attachment, angle: float = 0.0) -> Any:
        """A new marker with the position and the direction of an attachment, `angle` [rad] ahead of it."""
        part, place = self.part(at)
        return part.turn(self.system, place, angle)

    def level(self, first: Attachment, second: Attachment, turn: float) -> list[Any]:
        """Two new markers with the same direction while the second body is `turn` [rad] ahead of the first."""
        if isinstance(self.part(second)[0], Chain):
            return [self.turn(first, turn), self.turn(second)]
        return [self.turn(first), self.turn(second, -turn)]

    def slide(self, joint: Slider) -> Array:
        """The direction (2,) of a slider's line in the frame of its first body."""
        return np.array([np.cos(joint.direction), np.sin(joint.direction)])

    def normal(self, surface: ContactSurface) -> Array:
        """The normal (2,) of a line in its body's frame, to its left."""
        assert surface.line is not None
        return np.array([-np.sin(surface.line), np.cos(surface.line)])

    def faced(self, at: Attachment, normal: Array) -> tuple[Any, Array]:
        """A new marker, and axes (3, 3) as columns in its frame, whose third one is a normal in the body's frame."""
        along = np.arctan2(normal[1], normal[0]) - np.pi / 2
        return self.turn(at, along), np.eye(3)[:, [0, 2, 1]]

    def pointing(self, at: Attachment, direction: Array, q: Array, v: Array) -> Array:
        """A direction of a body's frame along a motion, (rows, 2)."""
        angle = self.motion(at, q, v).direction + np.arctan2(direction[1], direction[0])
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def motion(self, at: Attachment, q: Array, v: Array) -> PointMotion:
        """Return the motion of an attachment."""
        part, place = self.part(at)
        return part.motion(q, v, place)

    def start_distance(self, first: Attachment, second: Attachment) -> float:
        """Distance of two attachments at the start [m]."""
        one, other = (start_of(self.scene, self.poses, side) for side in (first, second))
        return float(np.linalg.norm(other - one))

    def start_turn(self, first: Attachment, second: Attachment) -> float:
        """Angle from the first direction to the second at the start, over full turns [rad]."""
        one, other = (self.poses[owner(side)].angle + lead(self.scene, side) for side in (first, second))
        return float(other - one)

    def is_point(self, at: Attachment) -> bool:
        """Return whether an attachment is on a point mass, which has no direction."""
        return isinstance(self.scene.bodies.get(at.body), PointMass)

    def require_direction(self, field: str, *sides: Attachment) -> None:
        """Raises InputError for a point mass."""
        for side in sides:
            if self.is_point(side):
                raise InputError(f"{field}: {side.body} is a point mass, which has no angle")
