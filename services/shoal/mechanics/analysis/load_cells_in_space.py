"""Forces and torques on free rigid bodies along a motion in space, for `load_cells`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.felt import dot
from shoal.mechanics.analysis.load_cells import Balance, Part, unit
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.holding import direction, line_of
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.joints import Aligned, Along, Apart, Geared, Hinged, InPlane, Meet, Square, Sum, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Attachment, Revolute, Slider


class SpatialBalance(Balance):
    """As in the plane; a wrench of a body is a force and a torque about its origin over the lever, (6,)."""

    rows = 6

    def wrenches(self, force: Array) -> Array:
        """See `Balance`."""
        found = np.zeros((len(force), self.rows * len(self._frames)))
        for name, frame in self._frames.items():
            first = self.rows * self._numbers[name]
            found[:, first : first + 3] = force[:, list(frame.vectors[0].own or ())]
            for one in frame.directors if isinstance(frame, RigidFrame) else ():
                found[:, first + 3 : first + 6] += np.cross(self._value(one), force[:, list(one.own or ())])
            found[:, first + 3 : first + 6] /= self._lever
        return found

    def _on(self, *acting: tuple[str, Array, Array, Array | float]) -> Array:
        found = np.zeros((len(self.at), self.rows * len(self._frames)))
        for body, place, force, torque in acting:
            if body == GROUND:
                continue
            first = self.rows * self._numbers[body]
            found[:, first : first + 3] += force
            if isinstance(self._frames[body], RigidFrame):
                moment = np.cross(place - self._origins[body], force) + torque
                found[:, first + 3 : first + 6] += moment / self._lever
        return found

    def _none(self) -> Array:
        return np.zeros((len(self.at), 3))

    def _torque(self, name: str, sides: tuple[Attachment, ...], torques: list[Array]) -> Part:
        none = self._none()
        acting = [(side.body, none, none, torque) for side, torque in zip(sides, torques, strict=True)]
        return Part(name, self._on(*acting), none, torques[0])

    def _twist(self, name: str, one: Any, axis: Array) -> Part:
        """A torque of one about an axis, between the two sides of a condition or a joint."""
        return self._torque(name, (one.second, one.first), [axis, -axis])

    def components(self) -> Iterator[Part]:
        """See `Balance`."""
        for name, one in joints.of_scene(self._bodies.scene):
            yield from self._of(name, one)

    def _of(self, name: str, one: Any) -> Iterator[Part]:
        """Of a condition of a joint."""
        match one:
            case Meet():
                pushes, twists = self._axes(), []
            case Turned():
                pushes, twists = [], self._axes()
            case Aligned():
                pushes, twists = [], _across(self._held(one.first.body, one.axis))
            case Hinged():
                pushes, twists = [], [self._held(one.first.body, one.axis)]
            case Square():
                axes = self._held(one.first.body, one.axis), self._held(one.second.body, one.second_axis)
                pushes, twists = [], [unit(np.cross(*axes))]
            case Along():
                pushes, twists = _across(self._line(one.first, one.direction)), []
            case InPlane():
                pushes, twists = [self._held(one.first.body, one.axis)], []
            case Apart():
                pushes, twists = [unit(self._place(one.second) - self._place(one.first))], []
            case Geared():
                held = [self._held(side.body, axis) for side, axis in zip(one.sides, one.axes, strict=True)]
                torques = [factor * axis for factor, axis in zip(one.factors, held, strict=True)]
                yield self._torque(name, one.sides, torques)
                return
            case Sum():
                acting = [
                    (term.at.body, self._place(term.at), term.factor * self._axes()["xyz".index(term.axis)], 0.0)
                    for term in one.terms
                ]
                yield Part(name, self._on(*acting), acting[0][2], self._none())
                return
            case _:
                raise joints.unknown(one)
        for push in pushes:
            yield self._pair(name, one.first, one.second, self._place(one.second), push)
        for axis in twists:
            yield self._twist(name, one, axis)

    def _pair(self, name: str, first: Attachment, second: Attachment, where: Array, force: Array) -> Part:
        return super()._pair(name, first, second, where, force)._replace(torque=self._none())

    def _axes(self) -> list[Array]:
        """Those of the ground at every sample."""
        return [np.broadcast_to(axis, (len(self.at), 3)) for axis in np.eye(3)]

    def _directed(self, vector: Affine) -> Array:
        return np.broadcast_to(self._value(vector), (len(self.at), 3))

    def _held(self, body: str, axis: Any) -> Array:
        """The unit vector of a body or the ground that pointed along an axis at the start; None: its x axis."""
        return self._directed(direction(self._placement, body, axis))

    def _line(self, first: Attachment, turn: Any) -> Array:
        return self._directed(line_of(self._placement, first.body, turn))

    def _spin(self, side: Attachment) -> Array:
        """The angular velocity of a body [rad/s]."""
        frame = None if side.body == GROUND else self._frames[side.body]
        if not isinstance(frame, RigidFrame):
            return self._none()
        return 0.5 * sum((np.cross(self._value(one), self._speed(one)) for one in frame.directors), self._none())

    def friction(self, held: Mapping[str, Array]) -> Iterator[Part]:
        """See `Balance`."""
        for name, joint in self._bodies.scene.joints.items():
            if not isinstance(joint, Revolute | Slider) or not joint.resists:
                continue
            if isinstance(joint, Revolute):
                axis = self._held(joint.first.body, joint.axis)
                speed = dot(axis, self._spin(joint.second) - self._spin(joint.first))
                one = self._twist(name, joint, axis)
            else:
                placement, scene = self._placement, self._bodies.scene
                line = self._line(joint.first, joint.direction if joint.axis is None else joint.axis)
                here, there = placement.point(scene, joint.first), placement.point(scene, joint.second)
                way, moving = self._value(there) - self._value(here), self._speed(there) - self._speed(here)
                speed = dot(line, moving - np.cross(self._spin(joint.first), way))
                one = self._pair(name, joint.first, joint.second, self._place(joint.second), line)
            yield one.times(-joint.resistance(speed, held.get(name, 0.0)))

    @property
    def _placement(self) -> SpatialPlacement:
        placement = self._bodies.placement
        assert isinstance(placement, SpatialPlacement)
        return placement


def _across(axis: Array) -> list[Array]:
    """Two unit vectors at right angles to one, at every sample."""
    first = unit(np.cross(axis, np.eye(3)[np.argmin(np.abs(axis), axis=1)]))
    return [first, np.cross(axis, first)]
