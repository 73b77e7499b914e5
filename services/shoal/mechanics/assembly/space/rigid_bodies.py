"""Separate rigid bodies in space, whose vectors the conditions of joints refer to."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.groups import transposed
from shoal.mechanics.assembly.space.attitudes import Attitudes, section
from shoal.mechanics.assembly.space.body_vectors import AttitudeVectors
from shoal.mechanics.assembly.space.sections import material
from shoal.mechanics.joints import Hinged, Turned
from shoal.mechanics.start.rigid_bodies import DIRECTION, PLACE, Mark, RigidBodies, value_of
from shoal.scene import GROUND, Attachment, Scene
from shoal.scene.formula import Measure


class SpatialBodies(AttitudeVectors, RigidBodies):
    """Separate rigid bodies in space; axes are those of the attitudes that the scene states."""

    def __init__(self, scene: Scene, apart: bool = False, attitudes: Attitudes | None = None) -> None:
        self.attitudes = attitudes or Attitudes(scene)
        super().__init__(scene, apart)

    def of_image(self, side: Attachment, image: Any) -> Affine:
        """Return the vector of a body with these components in its frame."""
        if side.body == GROUND:
            return fixed(image)
        return self.marked(Mark(self.body(side), DIRECTION, image, 0.0 * image))

    def joint_angle(self, name: str, measure: Measure) -> None:
        """Return nothing: turns of separate bodies in space are not counted."""

    def keep_hinge(self, name: str, condition: Hinged) -> None:
        """Require an angle about an axis: near the start the sine of what it differs by."""
        flat, towards, ahead = self.hinge(condition.first, condition.second, condition.axis)
        begin = value_of(condition.angle)
        across = ahead * np.cos(begin) - flat * np.sin(begin)
        self.terms.dot(name, across, towards, 0, begin, condition.angle.through("neg"))

    def keep_angle(self, name: str, condition: Turned) -> None:
        """Require the stated rotation, else that of the start: three products of axes at right angles."""
        first, second = condition.first, condition.second
        if {first.body, second.body} & self.points:
            return
        if condition.angle is None:
            kept = np.einsum("jil,jkl->ikl", *(self.attitudes.rotation(side.body) for side in (second, first)))
        else:
            here, there = (section(self.scene, side) for side in (first, second))
            turn = turns.about_z(-np.asarray(condition.angle))
            kept = turns.product(there, turns.product(turn, transposed(here)))
        for k in range(3):
            own, other = np.eye(3)[k][:, None], kept[:, (k + 1) % 3]
            self.terms.dot(name, self.of_image(first, own), self.of_image(second, other), 0)

    def mark(self, at: Attachment, kind: int) -> Mark:
        """Return the vector of a body at an attachment: its place, or the x axis of the section there."""
        if at.body == GROUND:
            return super().mark(at, kind)
        if kind == PLACE:
            found = plane.vector(*material(self.scene, at.body, self.scene.location(at)))
        else:
            found = section(self.scene, at)[:, 0]
        return Mark(self.body(at), kind, found, 0.0 * found)
