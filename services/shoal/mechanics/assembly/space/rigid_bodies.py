"""Separate rigid bodies in space, whose vectors the conditions of joints refer to."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.assembly.space.body_vectors import AttitudeVectors
from shoal.mechanics.joints import Hinged, Turned
from shoal.mechanics.start.rigid_bodies import DIRECTION, PLACE, Mark, RigidBodies, value_of
from shoal.scene import GROUND, Attachment, Scene


class SpatialBodies(AttitudeVectors, RigidBodies):
    """Separate rigid bodies in space; axes are those of the attitudes that the scene states."""

    def __init__(self, scene: Scene, apart: bool = False) -> None:
        self.attitudes = Attitudes(scene)
        super().__init__(scene, apart)

    def of_image(self, side: Attachment, image: Any) -> Affine:
        """Return the vector of a body with these components in its frame."""
        if side.body == GROUND:
            return fixed(image)
        return self.marked(Mark(self.body(side), DIRECTION, image, 0.0 * image))

    def keep_hinge(self, name: str, condition: Hinged) -> None:
        """Require an angle about an axis: near the start the sine of what it differs by."""
        flat, towards, ahead = self.hinge(condition.first, condition.second, condition.axis)
        begin = value_of(condition.angle)
        across = ahead * np.cos(begin) - flat * np.sin(begin)
        self.terms.dot(name, across, towards, 0, begin, condition.angle.through("neg"))

    def keep_angle(self, name: str, condition: Turned) -> None:
        """Require the rotation between both bodies of the start: three products of axes at right angles."""
        first, second = condition.first, condition.second
        if {first.body, second.body} & self.points:
            return
        kept = np.einsum("jil,jkl->ikl", *(self.attitudes.rotation(side.body) for side in (second, first)))
        for k in range(3):
            own, other = np.eye(3)[k][:, None], kept[:, (k + 1) % 3]
            self.terms.dot(name, self.of_image(first, own), self.of_image(second, other), 0)

    def mark(self, at: Attachment, kind: int) -> Mark:
        """Return the vector of a body at an attachment: its place, or its x axis."""
        if at.body == GROUND:
            return super().mark(at, kind)
        if kind == PLACE:
            place = plane.vector(*self.scene.location(at))
            return Mark(self.body(at), PLACE, place, 0.0 * place)
        axis = np.eye(3)[0][:, None]
        return Mark(self.body(at), DIRECTION, axis, 0.0 * axis)
