"""Stated rotations of bodies at the start, and bodies that joints keep at equal rotations."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import fixed
from shoal.mechanics.assembly.groups import Orientations, is_stiff, product, transposed
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.fitting import start_slope
from shoal.mechanics.joints import Hinged, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Attachment, Rod, Scene


class Attitudes:
    """Rotations (3, 3, lanes) and spins [rad/s] (3, lanes) of all bodies at time zero.

    A body without a stated rotation has that of its neighbour plus the angle of their joint, else none, as in the
    plane. kept: bodies that joints lock. Raises InputError if joints keep other angles between the same two bodies.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._known: dict[str, Array] = {}
        self._begin = self._rotations()
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
        """The rotation whose columns are the axes of a body; of bodies that joints lock the first that states one."""
        if body not in self._known:
            self._known[body] = self._rotation(body)
        return self._known[body]

    def _rotation(self, body: str) -> Array:
        root, relative = self.kept.root(body)
        if root == GROUND:
            return relative
        members = (body, *self._members.get(root, ()))
        stating = [member for member in members if self.stated(member) is not None]
        firm = [member for member in stating if not {"angle", "rotation"} & {*self._scene.initial[member].guess}]
        reference = next(iter([*firm, *stating, root]))
        return product(self._begin[reference], product(transposed(self.kept.root(reference)[1]), relative))

    def spin(self, body: str) -> Array:
        """Return the angular velocity of a body along the axes of the ground: stated, as it is driven, or none.

        As in the plane, a body that a drive turns relative to a neighbour turns with it.
        """
        root = self.kept.root(body)[0]
        if root != GROUND:
            for member in (body, *self._members.get(root, ())):
                if (stated := self.stated_spin(member)) is not None:
                    return stated
        return self._driven[root]

    @cached_property
    def _driven(self) -> dict[str, Array]:
        """Return spins of groups of locked bodies: stated, that of a neighbour plus the rate of a drive, or none."""
        found = {GROUND: np.zeros((3, 1))}
        roots = list(dict.fromkeys(self.kept.root(body)[0] for body in self._scene.bodies))
        for root in roots:
            spins = map(self.stated_spin, self._members.get(root, ()))
            if root != GROUND and (stated := next((one for one in spins if one is not None), None)) is not None:
                found[root] = stated
        drives = [tie for _, tie in joints.of_scene(self._scene) if isinstance(tie, Hinged)]
        waiting = [root for root in roots if root not in found]
        while waiting:
            root, spin = next(self._turned(drives, found), (waiting[0], found[GROUND]))
            found[root] = spin
            waiting.remove(root)
        return found

    def _turned(self, drives: list[Hinged], found: dict[str, Array]) -> Iterator[tuple[str, Array]]:
        """Yield what a drive turns relative to one of those found, with its spin."""
        for drive in drives:
            first, second = (self.kept.root(side.body)[0] for side in (drive.first, drive.second))
            if (first in found) != (second in found):
                here, there, sign = (first, second, 1.0) if first in found else (second, first, -1.0)
                yield there, found[here] + sign * start_slope(drive.angle) * turns.unit(vector(*drive.axis))

    def image(self, body: str, axis: Any) -> Array:
        """The unit vector in a body's frame of an axis that points so at the start; None: its x axis."""
        if axis is None:
            return vector(1.0, 0.0, 0.0)
        return turns.back(self.rotation(body), turns.unit(vector(*axis)))

    def stated(self, body: str) -> Array | None:
        """The rotation that the scene states of a body, if it does."""
        start = self._scene.initial.get(body)
        if start is None or (start.rotation is None and start.angle is None):
            return None
        return turns.of_vector(vector(*start.rotation)) if start.rotation is not None else turns.about_z(start.angle)

    def stated_spin(self, body: str) -> Array | None:
        """The angular velocity that the scene states of a body, if it does."""
        start = self._scene.initial.get(body)
        if start is None or (start.spin is None and start.rate is None):
            return None
        return vector(*start.spin) if start.spin is not None else vector(0.0, 0.0, start.rate)

    def _rotations(self) -> dict[str, Array]:
        """Return the rotation of every body: stated, or that of a neighbour plus the angle of their joint, or none."""
        none = np.eye(3)[..., None]
        found = {body: stated for body in self._scene.bodies if (stated := self.stated(body)) is not None}
        found[GROUND] = none
        waiting = [body for body in self._scene.bodies if body not in found]
        while waiting:
            body, turn = next(self._tied(found), (waiting[0], none))
            found[body] = turn
            waiting.remove(body)
        return found

    def _tied(self, found: dict[str, Array]) -> Iterator[tuple[str, Array]]:
        """Bodies that a joint with an angle turns from one of those found."""
        for _, tie in joints.of_scene(self._scene):
            if not isinstance(tie, Turned) or tie.angle is None:
                continue
            turn = turns.about_z(tie.angle)
            for here, there, way in ((tie.first, tie.second, turn), (tie.second, tie.first, transposed(turn))):
                if here.body in found and there.body not in found:
                    ahead = product(found[here.body], product(section(self._scene, here), way))
                    yield there.body, product(ahead, transposed(section(self._scene, there)))

    def _between(self, condition: Turned) -> Array:
        """The rotation that a joint keeps: about z by its angle, else that of the start."""
        if condition.angle is not None:
            return turns.about_z(condition.angle)
        first, second = (self._begin[side.body] for side in (condition.first, condition.second))
        return product(transposed(first), second)


def section(scene: Scene, side: Attachment) -> Array:
    """The axes in a body's frame of the section at a place of a flexible rod at rest; of other bodies their own."""
    body = None if side.body == GROUND else scene.bodies[side.body]
    if not isinstance(body, Rod) or body.element == "rigid":
        return np.eye(3)[..., None]
    return unstrained(body, scene.location(side)[0])[1]
