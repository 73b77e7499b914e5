"""Springs and distances as lines between the places that they join, in the plane and in space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.pictures.outline import INSIDE
from shoal.scene import GROUND, Attachment, Scene
from shoal.scene.joints import Distance
from shoal.scene.loads import Spring
from shoal.trajectory import Array

At = Callable[[str], Array]
"""The path of an added marker [m], (frames, d)."""


class Links:
    """The springs and distances of a scene, with the markers at their ends."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.markers: dict[str, dict[str, Any]] = {}
        parts = {**scene.joints, **scene.loads}
        self._ends = {
            name: [self._end(part.first), self._end(part.second)]
            for name, part in parts.items()
            if isinstance(part, Distance | Spring)
        }

    def shown(self, at: At, times: Array) -> dict[str, Array]:
        """Return by name the two places [m] that each joins, (frames, 2, d). times: of the motion [s], (frames,)."""
        return {name: np.stack([end(at, times) for end in ends], axis=1) for name, ends in self._ends.items()}

    def _end(self, side: Attachment) -> Callable[[At, Array], Array]:
        if side.body != GROUND:
            name = f"{INSIDE}-link-{len(self.markers)}"
            self.markers[name] = {"body": side.body, "point": [float(x) for x in self._scene.location(side)]}
            return lambda at, _: at(name)
        if isinstance(side.point, str):
            moving = self._scene.ground_points[side.point]
            axes = (moving.x, moving.y, moving.z)[: self._scene.dimensions]
            return lambda _, times: np.stack([axis(times) for axis in axes], axis=1)
        place = np.array(self._scene.location(side))
        return lambda _, times: np.broadcast_to(place, (len(times), len(place)))
