"""Kinematics of free bodies at samples of a motion, in the plane or in space: places, lines, axes and small turns.

A body turns by a small vector: of a rigid body half the sum of d x delta d over its directors, of a section that of its
slope and, about it, of its director; a cable has no turn about its axis. In the plane a turn has one component.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, points
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.sections import image
from shoal.mechanics.frames import BeamFrame, Frame, PointFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Attachment, Revolute


class FreeMotion:
    """Free bodies at samples of a motion.

    Attributes:
        bodies: the machine without its joints
        at, rate: coordinates of the free bodies and their rates, (samples, unknowns)
    """

    def __init__(self, bodies: FreeBodies, at: Array, rate: Array) -> None:
        self.bodies, self.at, self.rate = bodies, at, rate
        self.scene, self.placement = bodies.scene, bodies.placement
        self.dimensions = bodies.scene.dimensions

    @property
    def turn_axes(self) -> int:
        """Number of components of a small turn: 1 in the plane, 3 in space."""
        return 1 if self.dimensions == plane.DIMENSIONS else 3

    def value(self, vector: Affine) -> Array:
        """Return a vector, (samples, d)."""
        unknowns, coefficients, constant = vector.by_lane
        return np.asarray(self.at[:, unknowns] @ coefficients[0] + constant[0])

    def slope(self, vector: Affine) -> Array:
        """Return the derivative of a vector by the coordinates, (d, unknowns)."""
        return np.asarray(points([vector], self.bodies.unknowns).matrix[0])

    def place(self, side: Attachment) -> Array:
        """Return the position of an attachment [m], (samples, d)."""
        return self.value(self.placement.point(self.scene, side))

    def gap(self, condition: Any) -> Array:
        """Return the vector from the first place of a condition to the second [m], (samples, d)."""
        return self.value(self.placement.gap(self.scene, condition))

    def sliding(self, condition: Any) -> Array:
        """Return the derivative of that vector as seen from the first body, (samples, d, unknowns)."""
        way = self.placement.gap(self.scene, condition)
        seen = self.slope(way)[None]
        if condition.first.body == GROUND:
            return seen
        turn, gap = self.turn(condition.first), self.value(way)
        if self.turn_axes == 1:
            return np.asarray(seen - turn * np.stack([-gap[:, 1], gap[:, 0]], axis=1)[:, :, None])
        return np.asarray(seen - np.cross(turn, gap[:, :, None], axis=1))

    def turning(self, condition: Any) -> Array:
        """Return the small turn of the second body less that of the first, (samples, components, unknowns)."""
        return self.turn(condition.second) - self.turn(condition.first)

    def turn(self, side: Attachment) -> Array:
        """Return the small turn of a body at a place by its coordinates, (samples, components, unknowns)."""
        frame = self.frame(side.body)
        if frame is None or isinstance(frame, PointFrame):
            return np.zeros((1, self.turn_axes, self.bodies.unknowns))
        slope = self.placement.direction(self.scene, side)
        if self.turn_axes == 1:
            return self._by(slope) / _square(self.value(slope))
        if not isinstance(frame, BeamFrame):
            return np.asarray(0.5 * sum(self._by(one) for one in frame.directors))
        value = self.value(slope)
        total = self._by(slope) / _square(value)
        node = frame.node(self.scene.location(side))
        if frame.element.director is not None and node is not None:
            along, director = _unit(value), frame.nodes[node][2]
            about = np.cross(along, self.value(director)) @ self.slope(director)
            total = total + along[:, :, None] * about[:, None, :]
        return np.asarray(total)

    def _by(self, vector: Affine) -> Array:
        """Return v x delta v, (samples, components, unknowns)."""
        value, slope = self.value(vector), self.slope(vector)
        if self.turn_axes == 1:
            return np.asarray(value[:, :1] * slope[1] - value[:, 1:] * slope[0])[:, None]
        return np.cross(value[:, :, None], slope[None], axis=1)

    @property
    def axes(self) -> Array:
        """The axes of the ground, (d, samples, d)."""
        return self._everywhere(np.eye(self.dimensions)[:, None])

    @property
    def turns(self) -> dict[str, Array]:
        """Unit torques about all axes, by name, (samples, components) each."""
        names = ("torque",) if self.turn_axes == 1 else ("mx", "my", "mz")
        return dict(zip(names, self._everywhere(np.eye(self.turn_axes)[:, None]), strict=True))

    def _everywhere(self, vectors: Array) -> Array:
        return np.broadcast_to(vectors, (*vectors.shape[:-2], len(self.at), vectors.shape[-1]))

    def line(self, first: Attachment, along: Any) -> Array:
        """Return the unit vector of a line that the first body holds, (samples, d).

        along: in the plane its angle in the body's frame [rad]; in space the axis as it points at the start, or that
        angle.
        """
        return self._everywhere(_unit(self.value(self.placement.line(first, along))))

    def normals(self, line: Array) -> list[Array]:
        """Return the unit vectors at right angles to one, (samples, d) each: one in the plane, two in space."""
        if self.turn_axes == 1:
            return [np.stack([-line[:, 1], line[:, 0]], axis=1)]
        return [one.T for one in turns.across(_unit(line).T)]

    def held_axis(self, side: Attachment, axis: Any) -> Array:
        """Return the unit vector of a rigid body or the ground that points along an axis at the start, (samples, 3)."""
        return self._everywhere(self.value(self._placement.axis(side, axis)))

    def common_axis(self, first: Attachment, second: Attachment, axis: Any) -> Array:
        """Return an axis that two bodies have in common, as the rigid one has it, or else a section, (samples, 3)."""
        sides = sorted((first, second), key=lambda side: (self._is_rod(side.body), self.is_cable(side.body)))
        return self.axis(sides[0], axis)

    def about(self, side: Attachment, axis: Any) -> Array:
        """Return the unit torque about an axis of a rigid body or the ground, (samples, components)."""
        return self.turns["torque"] if self.turn_axes == 1 else self.held_axis(side, axis)

    def pin(self, joint: Revolute) -> Array:
        """Return the unit torque about the axis of a hinge, (samples, components)."""
        if self.turn_axes == 1:
            return self.turns["torque"]
        return self.common_axis(joint.first, joint.second, joint.axis)

    def axis(self, side: Attachment, axis: Any) -> Array:
        """Return the unit vector of a body or section that points along an axis at the start, (samples, 3).

        None: its x axis. A cable has its slope only; any other axis is that of the start.
        """
        if not self._is_rod(side.body):
            return self.held_axis(side, axis)
        if not self.is_cable(side.body):
            return self._of_section(side, axis)
        if axis is not None:
            return self._everywhere(turns.unit(np.array(axis, dtype=float))[None])
        return self.slope_of(side)

    def slope_of(self, side: Attachment) -> Array:
        """Return the unit vector along a body at a place, (samples, d)."""
        return self._everywhere(_unit(self.value(self.placement.direction(self.scene, side))))

    def _of_section(self, side: Attachment, axis: Any) -> Array:
        frame = self.placement.frames[side.body]
        assert isinstance(frame, BeamFrame)
        here = image(self.scene, self._placement.attitudes, side, axis)[:, 0]
        node = frame.node(self.scene.location(side))
        assert node is not None
        along, director = (_unit(self.value(vector)) for vector in frame.nodes[node][1:3])
        other = np.cross(along, director)
        y, z = (director, other) if frame.element.director == 1 else (-other, director)
        return np.asarray(here[0] * along + here[1] * y + here[2] * z)

    def frame(self, body: str) -> Frame | None:
        """Return the frame of a body; the ground has none."""
        return None if body == GROUND else self.placement.frames[body]

    def _is_rod(self, body: str) -> bool:
        return isinstance(self.frame(body), BeamFrame)

    def is_cable(self, body: str) -> bool:
        """Return whether a body is a rod in space without directors, which cannot be turned about its axis."""
        frame = self.frame(body)
        return self.turn_axes == 3 and isinstance(frame, BeamFrame) and frame.element.director is None

    @property
    def _placement(self) -> SpatialPlacement:
        assert isinstance(self.placement, SpatialPlacement)
        return self.placement


def _unit(vectors: Array) -> Array:
    """Return vectors (samples, d) divided by their lengths."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _square(vectors: Array) -> Array:
    """Return their squared lengths, (samples, 1, 1)."""
    return np.asarray(np.sum(vectors**2, axis=1)[:, None, None])
