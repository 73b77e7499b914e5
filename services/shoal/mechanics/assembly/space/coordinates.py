"""Coordinates of a machine in space, which its joints share in part, and vectors of its bodies as functions of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import is_stiff, joint_points
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.assembly.space.axes import joint_axes
from shoal.mechanics.assembly.space.sections import chosen_elements
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.joints import Aligned, Along, Meet, Square, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Attachment, Scene


class SpatialPlacement(Placement):
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
        self.chosen: set[tuple[str, int]] = set()
        """Bodies, and which joint points tell how they are turned."""

    def axis(self, body: str, axis: Any) -> Affine:
        """Return the unit vector of a rigid body or the ground along an axis at the start; None: its x axis."""
        return self.of_image(body, self.attitudes.image(body, axis))

    def of_image(self, body: str, image: Any) -> Affine:
        """Return the vector of a rigid body or the ground with these components in its frame. Raises InputError."""
        if body == GROUND:
            return fixed(image)
        if not isinstance(self.frames[body], RigidFrame):
            raise InputError(f"{body} is flexible; in space only a rigid body holds an axis, a line or an angle")
        return combined(self.attitudes.kept.of_body(body), tuple(image))

    def line(self, first: Attachment, direction: Any) -> Affine:
        """Return the unit vector of a line that a body holds: an axis at the start, or an angle in its frame."""
        return self.of_image(first.body, self._image_of_line(first.body, direction))

    def _image_of_line(self, body: str, along: Any) -> Array:
        return self.attitudes.image(body, along) if isinstance(along, tuple) else turns.about_z(along)[:, 0]

    def across(self, first: Attachment, direction: Any) -> list[tuple[Affine, Array]]:
        """Vectors at right angles to a line that a body holds, with the form of the scalar product."""
        image = self._image_of_line(first.body, direction)
        return [(self.of_image(first.body, normal), np.eye(3)) for normal in turns.across(image)]

    def shares(self, condition: Any, is_weld: bool) -> bool:
        """Return whether the coordinates satisfy a condition by themselves, or further terms hold it."""
        if isinstance(condition, Square):  # of sections: see `rod_joints`
            return not all(is_stiff(self.scene, side.body) for side in (condition.first, condition.second))
        if isinstance(condition, Meet):
            return not condition.held
        return isinstance(condition, Turned | Aligned) or (isinstance(condition, Along) and condition.is_fixed)

    def hinge(self, first: Attachment, second: Attachment, axis: Any) -> tuple[Affine, Affine, Affine]:
        """Return directions at right angles to an axis: of the first, of the second, and the first's turned by 90 deg.

        Both are images of the bodies' x axes, or of another where that is along the axis.
        """
        found = []
        for side in (first, second):
            image = self.attitudes.image(side.body, axis)
            along = np.eye(3)[0 if np.all(np.abs(image[0]) < 0.9) else 1][:, None]
            flat = turns.unit(along - image * np.sum(image * along, axis=0))
            found.append((side.body, image, flat))
        (body, image, flat), (other, _, there) = found
        is_rod = isinstance(self.frames.get(other), BeamFrame)
        towards = self.direction(self.scene, second) if is_rod else self.of_image(other, there)
        return self.of_image(body, flat), towards, self.of_image(body, turns.cross(image, flat))

    def angle(self, name: str, side: Attachment, axis: Any) -> Affine:
        """Return a unit vector across an axis at rest, in coordinates whose third axis that is. Raises InputError."""
        if not isinstance(self.frames[side.body], RigidFrame):
            raise InputError(f"joints.{name}: turns {side.body}, which is not rigid; weld a rigid body to it instead")
        if not self.axis(side.body, axis).rests:
            told = ", ".join(f"{np.ravel(part)[-1]:g}" for part in axis)
            kind = self.scene.joints[name].kind
            raise InputError(
                f"joints.{name}: {side.body} does not turn about an axis at rest, ({told}) at the start; a {kind} in "
                "space turns on hinges whose axes the ground holds"
            )
        across = self.of_image(side.body, turns.across(self.attitudes.image(side.body, axis))[0])
        one, other = turns.across(turns.unit(vector(*axis)))
        return across.turned(np.stack(np.broadcast_arrays(one, other, turns.cross(one, other))))
