"""How bodies are turned at the start as the scene states it, and which of them joints keep turned alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import fixed
from shoal.mechanics.assembly.groups import Orientations, is_stiff, product, transposed
from shoal.mechanics.joints import Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Scene


class Attitudes:
    """Rotations (3, 3, lanes) and spins [rad/s] (3, lanes) of all bodies at time zero.

    A body that says nothing is turned as a joint that locks it tells, else not at all. kept: bodies that joints lock.
    Raises InputError if joints keep other angles between the same two bodies.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.kept = Orientations(directors={GROUND: tuple(fixed(axis) for axis in np.eye(3)[..., None])}, dimensions=3)
        for name, condition in joints.of_scene(scene):
            if isinstance(condition, Turned):
                sides = condition.first.body, condition.second.body
                if all(is_stiff(scene, side) for side in sides):
                    self.kept.join(name, *sides, self._between(condition))
        self._members: dict[str, list[str]] = {}
        for body in scene.bodies:
            self._members.setdefault(self.kept.root(body)[0], []).append(body)

    def rotation(self, body: str) -> Array:
        """The rotation whose columns are the axes of a body."""
        if body == GROUND:
            return np.eye(3)[..., None]
        root, relative = self.kept.root(body)
        if root == GROUND:
            return relative
        for member in (body, *self._members.get(root, ())):
            if (stated := self._stated(member)) is not None:
                return product(stated, product(transposed(self.kept.root(member)[1]), relative))
        return relative

    def spin(self, body: str) -> Array:
        """The angular velocity of a body along the axes of the ground."""
        root = self.kept.root(body)[0]
        if root != GROUND:
            for member in (body, *self._members.get(root, ())):
                start = self._scene.start(member)
                if start.spin is not None:
                    return vector(*start.spin)
                if np.any(start.rate):
                    return vector(0.0, 0.0, start.rate)
        return np.zeros((3, 1))

    def image(self, body: str, axis: Any) -> Array:
        """The unit vector in a body's frame of an axis that points so at the start; None: its x axis."""
        if axis is None:
            return vector(1.0, 0.0, 0.0)
        return turns.back(self.rotation(body), turns.unit(vector(*axis)))

    def _stated(self, body: str) -> Array | None:
        start = self._scene.initial.get(body)
        if start is None or (start.rotation is None and start.angle is None):
            return None
        return turns.of_vector(vector(*start.rotation)) if start.rotation is not None else turns.about_z(start.angle)

    def _between(self, condition: Turned) -> Array:
        """The rotation that a joint keeps: about z by its angle, else that of the start, else none."""
        if condition.angle is not None:
            return turns.about_z(condition.angle)
        first, second = (
            np.eye(3)[..., None] if side.body == GROUND else self._stated(side.body)
            for side in (condition.first, condition.second)
        )
        if second is None or first is None:
            return np.eye(3)[..., None]
        return product(transposed(first), second)
