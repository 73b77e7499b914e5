"""A machine by order of magnitude: what its frictions, rates and records are measured against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.mechanics.reach import span
from shoal.scene import Scene
from shoal.scene.joints import places

_EARTH = 9.81


@dataclass(frozen=True)
class Size:
    """Mass [kg], length of its largest body and how far it reaches [m], and its gravity, that of the earth if none."""

    mass: float
    length: float
    reach: float
    gravity: float

    @property
    def rate(self) -> float:
        """Of a swing [rad/s]."""
        return float(np.sqrt(self.gravity / self.length))


def size_of(scene: Scene) -> Size:
    """The size of a machine."""
    lengths = [max(float(np.linalg.norm(place)) for place in body.points.values()) for body in scene.bodies.values()]
    ground = [
        float(np.linalg.norm(side.point))
        for joint in scene.joints.values()
        for side in places(joint)
        if side.body == "ground" and not isinstance(side.point, str)
    ]
    mass = sum(float(body.mass) for body in scene.bodies.values())
    gravity = float(np.linalg.norm(scene.gravity)) or _EARTH
    # A point on a slider has no extent; how far its start or its spring is tells how far it goes.
    reach = sum(lengths) + max(ground, default=0.0) or span(scene)
    return Size(mass, max([*lengths, 1e-3]), reach, gravity)
