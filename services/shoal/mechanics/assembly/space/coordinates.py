"""Coordinates of a machine in space, which its joints share in part, and vectors of its bodies as functions of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import is_stiff, joint_points
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.assembly.space.axes import joint_axes
from shoal.mechanics.assembly.space.body_vectors import AttitudeVectors
from shoal.mechanics.assembly.space.sections import chosen_elements
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.joints import Aligned, Along, Hinged, Meet, Square, Turned, of_scene
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Attachment, Scene
from shoal.scene.formula import Measure


class SpatialPlacement(AttitudeVectors, Placement):
    """A placement in space, which knows the attitudes that the scene states, and whom they hold."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene, np.zeros(1, dtype=bool))
        self.attitudes = Attitudes(scene)
        self.points = joint_points(scene)
        self.elements = chosen_elements(scene, self.attitudes)
        self.axes = joint_axes(scene, self.attitudes, self.elements)
        self.held = {name for axis in self.axes for name in axis.joints}
        """Joints whose directions are shared, so that no constraint holds them."""
        self.strained: dict[tuple[str, int | None], Array] = {}
        """How sections of rods that start strained are turned from the unstrained start, by body and node."""
        self.turns: dict[str, tuple[Affine, Affine]] = {}
        """Of bushings that resist turns, w and v of the quaternion, see `bushings`."""
        self.chosen: set[tuple[str, int]] = set()
        """Bodies, and which joint points determine their rotation."""

    def of_image(self, side: Attachment, image: Any) -> Affine:
        """Return the vector of a rigid body or the ground with these components in its frame. Raises InputError."""
        if side.body == GROUND:
            return fixed(image)
        if not isinstance(self.frames[side.body], RigidFrame):
            raise InputError(f"{side.body} is flexible; in space only a rigid body holds an axis, a line or an angle")
        return combined(self.attitudes.kept.of_body(side.body), tuple(image))

    def of_axis(self, side: Attachment, image: Any) -> Affine:
        """Return the same, of a rod its slope."""
        if isinstance(self.frames.get(side.body), BeamFrame):
            return self.direction(self.scene, side)
        return self.of_image(side, image)

    def keep_hinge(self, name: str, condition: Hinged) -> None:
        """Require the cosine and the sine of an angle about an axis."""
        flat, towards, ahead = self.hinge(condition.first, condition.second, condition.axis)
        self.terms.dot(name, flat, towards, 0, drive=condition.angle.through("cos", "neg"))
        self.terms.dot(name, ahead, towards, 0, drive=condition.angle.through("sin", "neg"))

    def is_turned_by_ground(self, body: str) -> bool:
        """Return whether a drive turns a body against the ground: its cosine and sine then keep the length."""
        root, _ = self.attitudes.kept.root(body)
        return any(
            {root, GROUND} == {self.attitudes.kept.root(side.body)[0] for side in (one.first, one.second)}
            for _, one in of_scene(self.scene)
            if isinstance(one, Hinged)
        )

    def shares(self, condition: Any, is_weld: bool) -> bool:
        """Return whether the coordinates satisfy a condition by themselves, or further terms hold it."""
        if isinstance(condition, Square):  # of sections: see `rod_joints`
            return not all(is_stiff(self.scene, side.body) for side in (condition.first, condition.second))
        if isinstance(condition, Meet):
            return not condition.held
        return isinstance(condition, Turned | Aligned) or (isinstance(condition, Along) and condition.is_fixed)

    def joint_angle(self, name: str, measure: Measure) -> list[tuple[float, Affine]]:
        """Return the unit vector whose angle is that of a joint."""
        return [(1.0, self.phases[measure.names[0]])]

    def angle(self, name: str, side: Attachment, axis: Any) -> Affine:
        """Return a unit vector across an axis at rest, in coordinates whose third axis that is. Raises InputError."""
        if not isinstance(self.frames[side.body], RigidFrame):
            raise InputError(f"joints.{name}: turns {side.body}, which is not rigid; weld a rigid body to it instead")
        if not self.axis(side, axis).rests:
            listed = ", ".join(f"{np.ravel(part)[-1]:g}" for part in axis)
            kind = self.scene.joints[name].kind
            raise InputError(
                f"joints.{name}: {side.body} does not turn about an axis at rest, ({listed}) at the start; a {kind} in "
                "space turns on hinges whose axes the ground holds"
            )
        return super().angle(name, side, axis)
