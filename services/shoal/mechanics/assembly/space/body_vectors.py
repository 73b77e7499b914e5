"""Directions of bodies in space that joints refer to, by their components in the frames of the bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import Attachment


class AttitudeVectors:
    """Axes, lines and angles of bodies whose attitudes at the start are known, for conditions of joints."""

    attitudes: Attitudes

    def of_image(self, side: Attachment, image: Any) -> Affine:
        """Return the vector of a body with these components in its frame."""
        raise NotImplementedError

    def of_axis(self, side: Attachment, image: Any) -> Affine:
        """Return the same, of a rod its slope."""
        return self.of_image(side, image)

    def axis(self, side: Attachment, axis: Any) -> Affine:
        """Return the unit vector of a body along an axis as it points at the start; None: its x axis."""
        return self.of_image(side, self.attitudes.image(side.body, axis))

    def line(self, first: Attachment, direction: Any) -> Affine:
        """Return the unit vector of a line that a body holds: an axis at the start, or an angle in its frame."""
        return self.of_image(first, self._image_of_line(first.body, direction))

    def _image_of_line(self, body: str, along: Any) -> Array:
        return self.attitudes.image(body, along) if isinstance(along, tuple) else turns.about_z(along)[:, 0]

    def across(self, first: Attachment, direction: Any) -> list[tuple[Affine, Array]]:
        """Return vectors at right angles to a line that a body holds, with the form of the scalar product."""
        image = self._image_of_line(first.body, direction)
        return [(self.of_image(first, normal), np.eye(3)) for normal in turns.across(image)]

    def hinge(self, first: Attachment, second: Attachment, axis: Any) -> tuple[Affine, Affine, Affine]:
        """Return directions at right angles to an axis: of the first, of the second, and the first's turned by 90 deg.

        Both are images of the bodies' x axes, or of another where that is along the axis.
        """
        found = []
        for side in (first, second):
            image = self.attitudes.image(side.body, axis)
            along = np.eye(3)[0 if np.all(np.abs(image[0]) < 0.9) else 1][:, None]
            found.append((image, turns.unit(along - image * np.sum(image * along, axis=0))))
        (image, flat), (_, there) = found
        return self.of_image(first, flat), self.of_axis(second, there), self.of_image(first, turns.cross(image, flat))

    def angle(self, name: str, side: Attachment, axis: Any) -> Affine:
        """Return a unit vector across an axis, in coordinates whose third axis that is."""
        across = self.of_image(side, turns.across(self.attitudes.image(side.body, axis))[0])
        one, other = turns.across(turns.unit(vector(*axis)))
        return across.turned(np.stack(np.broadcast_arrays(one, other, turns.cross(one, other))))
