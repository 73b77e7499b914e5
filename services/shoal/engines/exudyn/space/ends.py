"""The places and axes of a scene in space inside Exudyn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.exudyn.bodies import Place
from shoal.engines.exudyn.ends import SystemAttachments
from shoal.engines.exudyn.space.beam import SpatialBeamPart
from shoal.engines.exudyn.space.bodies import Side, SpatialCablePart, SpatialGround, SpatialHolder, SpatialPointMotion
from shoal.engines.poses import owner
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.sections import image
from shoal.scene import Attachment, Slider
from shoal.scene.contacts import ContactSurface
from shoal.trajectory import Array


@dataclass(frozen=True)
class SpatialEnds(SystemAttachments):
    """Attachments of a scene in space. placement: of the native machine, whose start and whose axes these are."""

    placement: SpatialPlacement

    def part(self, at: Attachment) -> tuple[Any, Place]:
        """The part that an attachment is on, and its place there [m]."""
        part: SpatialHolder | Any = self.parts[owner(at)]
        return part, tuple(float(x) for x in self.scene.location(at))

    def is_cable(self, at: Attachment) -> bool:
        """Return whether an attachment is on a flexible rod."""
        return isinstance(self.part(at)[0], SpatialCablePart)

    def is_ground(self, at: Attachment) -> bool:
        """Return whether it rests."""
        return isinstance(self.part(at)[0], SpatialGround)

    def side(self, at: Attachment) -> Side:
        """Return the node whose coordinates define the directions there. Raises InputError."""
        part, place = self.part(at)
        side: Side = part.side(place)
        return side

    def framed(self, at: Attachment, axes: Array) -> Any:
        """A new marker at an attachment with axes (3, 3) as its body's frame has them. Raises InputError."""
        part, place = self.part(at)
        return part.framed(self.system, place, axes)

    def image(self, at: Attachment, axis: Any) -> Array:
        """The unit vector (3,) of an axis as it points at the start, in the frame of a body or of a rod's section."""
        return np.asarray(image(self.scene, self.placement.attitudes, at, axis)[:, 0])

    def slide(self, joint: Slider) -> Array:
        """The direction (3,) of a slider's line in the frame of its first body: an axis at the start, or an angle."""
        return self.line(joint.first, joint.direction if joint.axis is None else joint.axis)

    def line(self, at: Attachment, along: Any) -> Array:
        """The direction (3,) of a line in its body's frame: an axis at the start, or an angle there."""
        if isinstance(along, tuple):
            return self.image(at, along)
        return np.array([np.cos(along), np.sin(along), 0.0])

    def normal(self, surface: ContactSurface) -> Array:
        """The normal (3,) of a plane in its body's frame."""
        return self.image(surface, surface.plane)

    def faced(self, at: Attachment, normal: Array) -> tuple[Any, Array]:
        """See SystemAttachments."""
        return self.framed(at, frame_about(normal)), np.eye(3)

    def pointing(self, at: Attachment, direction: Array, q: Array, v: Array) -> Array:
        """A direction of a body's frame along a motion, (rows, 3)."""
        return np.asarray(self.moved(at, q, v).axes @ direction)

    def moved(self, at: Attachment, q: Array, v: Array) -> SpatialPointMotion:
        """Return the motion of an attachment."""
        part, place = self.part(at)
        motion: SpatialPointMotion = part.motion(q, v, place)
        return motion

    def start_distance(self, first: Attachment, second: Attachment) -> float:
        """Distance of two attachments at the start [m]."""
        one, other = (self.placement.point(self.scene, side) for side in (first, second))
        return float(np.linalg.norm(self.placement.start_of(other)[0] - self.placement.start_of(one)[0]))

    def start_axes(self, at: Attachment) -> Array:
        """The axes of an attachment's rigid body or section at the start as columns, (3, 3)."""
        if self.is_ground(at):
            return np.eye(3)
        part, place = self.part(at)
        if isinstance(part, SpatialBeamPart):
            return part.start_axes(place)
        directors = self.placement.attitudes.kept.of_body(at.body)
        return np.stack([self.placement.start_of(one)[0][:, 0] for one in directors], axis=1)


def frame_about(image: Array) -> Array:
    """Axes (3, 3) as columns whose third one is an axis, and whose first one is nearest to x, or to y if that is x.

    The angle about the axis is counted between the first ones, as in the native machine.
    """
    along = np.eye(3)[0 if abs(image[0]) < 0.9 else 1]
    flat = turns.unit(along - image * (image @ along))
    return np.stack([flat, np.cross(image, flat), image], axis=1)
