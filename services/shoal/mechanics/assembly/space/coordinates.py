"""The unknowns of a machine in space, and what its joints share."""

from __future__ import annotations

import numpy as np

from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import joint_points
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.assembly.space.axes import joint_axes
from shoal.mechanics.assembly.space.sections import chosen_elements
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene


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
