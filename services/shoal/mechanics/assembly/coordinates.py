"""The unknowns of a machine, and how everything that has a place or a direction hangs on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.groups import JointPoint, place_of
from shoal.mechanics.assembly.pose import Pose
from shoal.mechanics.assembly.terms import Terms
from shoal.mechanics.frames import Frame
from shoal.mechanics.joints import Along, Apart, Meet
from shoal.mechanics.numerics.tile import Array, Flags, Number
from shoal.scene import GROUND, Attachment, Scene


@dataclass
class Placement:
    """All unknowns with their initial values, the frame of every body, and the constraints.

    scene: with the start that agrees with its joints. failed: lanes that have none, (lanes,) or (1,).
    """

    scene: Scene
    failed: Flags
    positions: list[Number] = field(default_factory=list)
    velocities: list[Number] = field(default_factory=list)
    frames: dict[str, Frame] = field(default_factory=dict)
    poses: dict[str, Pose] = field(default_factory=dict)
    drivers: dict[str, Affine] = field(default_factory=dict)
    """Moving points of the ground: vectors whose motion is prescribed."""
    terms: Terms = field(default_factory=Terms)

    def new_vector(self, position: Array, velocity: Array) -> Affine:
        """As many more unknowns as a vector has components, with its initial value and rate, (d, lanes) each."""
        first = len(self.positions)
        self.positions += list(position)
        self.velocities += list(velocity)
        axes = np.eye(len(position))[..., None]
        return Affine({first + k: axis for k, axis in enumerate(axes)}, np.zeros((len(axes), 1)))

    def new_along(self, base: Array, direction: Array, position: Array, velocity: Array) -> Affine:
        """One more unknown, the way along a fixed direction from `base`."""
        self.positions.append(sum(direction * (position - base)))
        self.velocities.append(sum(direction * velocity))
        return Affine({len(self.positions) - 1: direction}, base)

    def start_of(self, where: Affine) -> tuple[Array, Array]:
        """Initial position and velocity of a vector."""
        position, velocity = where.constant, 0.0 * where.constant
        for unknown, coefficient in where.terms.items():
            position = position + coefficient * self.positions[unknown]
            velocity = velocity + coefficient * self.velocities[unknown]
        return position, velocity

    def point(self, scene: Scene, at: Attachment) -> Affine:
        """The place of an attachment."""
        owner, place = place_of(scene, at)
        if owner == GROUND:
            return fixed(plane.vector(*place))
        return self.drivers[owner] if at.body == GROUND else self.frames[owner].point(place)

    def direction(self, scene: Scene, at: Attachment) -> Affine:
        """The direction of the body at an attachment; that of the ground is +X."""
        if at.body == GROUND:
            return fixed(np.eye(scene.dimensions)[0][:, None])
        return self.frames[at.body].direction(scene.location(at))

    def gap(self, scene: Scene, condition: Along | Apart | Meet) -> Affine:
        """The way from the first place of a condition to the second."""
        return self.point(scene, condition.second) - self.point(scene, condition.first)

    def make(self, point: JointPoint, position: Array, velocity: Array) -> Affine:
        """The coordinates of a joint point that has none yet."""
        if point.line is None:
            point.where = self.new_vector(position, velocity)
        else:
            _, base, direction = point.line
            point.where, point.on_line = self.new_along(base, direction, position, velocity), True
        return point.where

    def share(self, point: JointPoint, here: Affine) -> None:
        """A joint point is here; if it is somewhere already, constraints close the loop."""
        if point.where is None:
            point.where = here
        else:
            self.terms.vanish(point.name, point.where - here)
