"""Joint conditions: each kind of joint as a few kinematic conditions, which state residuals and constraint forces.

A joint shares what it can (`assembly.groups`), holds the rest by constraints (`assembly.placement`), closes at the
start (`start.closure`) and pushes where its conditions forbid a motion (`analysis.joint_reactions`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.conditions import JointCondition, UnitVectors
from shoal.mechanics.numerics.tile import Number
from shoal.mechanics.ropes import Reeved, parts_of_rope
from shoal.mechanics.sums import BodyAngle, Sum, parts_of
from shoal.scene import Function, Scene
from shoal.scene.joints import (
    GROUND,
    Attachment,
    Coupling,
    Cylindrical,
    Distance,
    DrivenAngle,
    Gear,
    Parallel,
    Perpendicular,
    Planar,
    Revolute,
    Rope,
    Slider,
    Spherical,
    Universal,
    Weld,
    is_loose,
)
from shoal.scene.record import Vector3


@dataclass(frozen=True)
class Meet(JointCondition):
    """Two places coincide. held: by constraints, as the force is asked for."""

    first: Attachment
    second: Attachment
    held: bool = False

    @property
    def within(self) -> bool:
        """Return whether both are of one body: a rod that closes upon itself."""
        return self.first.body == self.second.body

    def constrain(self, name: str, bodies: Any) -> None:
        """Require every component of the gap to vanish."""
        bodies.terms.vanish(name, bodies.gap(bodies.scene, self))

    def pushes(self, motion: Any) -> UnitVectors:
        """Return the forces along the axes of the ground."""
        return {f"f{name}": axis for name, axis in zip("xyz", motion.axes, strict=False)}


@dataclass(frozen=True)
class Along(JointCondition):
    """The second place stays on a line through the first; direction: of the line in the first body's frame [rad].

    In space the direction may be an axis as it points at the start. held: by a constraint, as the force
    is asked for.
    """

    first: Attachment
    second: Attachment
    direction: Number | Vector3
    held: bool = False

    @property
    def is_fixed(self) -> bool:
        """Return whether the line rests on the ground."""
        return self.first.body == GROUND and not isinstance(self.first.point, str) and not self.held

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the gap to vanish across the line."""
        gap = bodies.gap(bodies.scene, self)
        for vector, form in bodies.across(self.first, self.direction):
            bodies.terms.form(name, vector, gap, form, 1)

    def pushes(self, motion: Any) -> UnitVectors:
        """Return the forces across the line."""
        normals = motion.normals(motion.line(self.first, self.direction))
        names = ["normal"] if len(normals) == 1 else ["normal1", "normal2"]
        return dict(zip(names, normals, strict=True))


@dataclass(frozen=True)
class Apart(JointCondition):
    """Two places keep a distance [m]; None: that of the start."""

    first: Attachment
    second: Attachment
    length: Function | None

    @property
    def is_of_start(self) -> bool:
        """Return whether it keeps the distance that the start has."""
        return self.length is None

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the length of the gap."""
        bodies.keep_distance(name, bodies.gap(bodies.scene, self), self.length)

    def pushes(self, motion: Any) -> UnitVectors:
        """Return the force from place to place; of places that coincide, along the first axis."""
        way = motion.gap(self)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        return {"axial": np.where(length > 0, way / np.where(length > 0, length, 1.0), motion.axes[0])}


@dataclass(frozen=True)
class Turned(JointCondition):
    """The angle [rad] from the first direction to the second is kept, or follows a function of time.

    either: two angles, of which the one nearer to the start is kept. Without an angle it is that of the start.
    """

    first: Attachment
    second: Attachment
    angle: Function | Number | None = None
    either: tuple[float, float] | None = None

    @property
    def driven(self) -> bool:
        """Return whether it follows a function of time."""
        return isinstance(self.angle, Function)

    @property
    def is_of_start(self) -> bool:
        """Return whether any angle that the start has is kept."""
        return self.angle is None and self.either is None

    def kept(self, ahead: Number) -> Number:
        """The angle that is kept, if it does not follow a function; ahead: that at the start [rad]."""
        if self.either is not None:
            return np.where(np.cos(ahead - self.either[0]) >= -1e-12, *self.either)
        return ahead if self.angle is None else self.angle

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the angle between both directions."""
        bodies.keep_angle(name, self)

    def twists(self, motion: Any) -> UnitVectors:
        """Return the torques about all axes."""
        return dict(motion.turns)


@dataclass(frozen=True)
class Aligned(JointCondition):
    """An axis of both bodies; None: the first body's x axis, parallel to the second's, whichever way that points."""

    first: Attachment
    second: Attachment
    axis: Vector3 | None

    def constrain(self, name: str, bodies: Any) -> None:
        """Require both directions across the first body's axis to be across the second's."""
        axis = 0.0 if self.axis is None else self.axis
        for vector, form in bodies.across(self.first, axis):
            bodies.terms.form(name, vector, bodies.line(self.second, axis), form, 0)

    def twists(self, motion: Any) -> UnitVectors:
        """Return the torques across the axis; two cables, which have slopes only, hold no other axis than those."""
        if self.axis is not None and motion.is_cable(self.first.body) and motion.is_cable(self.second.body):
            return {}
        across = motion.normals(motion.common_axis(self.first, self.second, self.axis))
        return dict(zip(("m1", "m2"), across, strict=True))


@dataclass(frozen=True)
class Square(JointCondition):
    """An axis of the first body stays at a right angle to one of the second; None: their x axes."""

    first: Attachment
    second: Attachment
    axis: Vector3 | None
    second_axis: Vector3 | None

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the scalar product of both axes to vanish."""
        one, other = bodies.axis(self.first, self.axis), bodies.axis(self.second, self.second_axis)
        bodies.terms.dot(name, one, other, 0)

    def twists(self, motion: Any) -> UnitVectors:
        """Return the torque across both axes."""
        across = np.cross(motion.axis(self.first, self.axis), motion.axis(self.second, self.second_axis))
        return {"m1": across / np.linalg.norm(across, axis=1, keepdims=True)}


@dataclass(frozen=True)
class InPlane(JointCondition):
    """The second place stays in a plane through the first, normal to an axis of the first body."""

    first: Attachment
    second: Attachment
    axis: Vector3

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the gap to vanish along the axis."""
        gap = bodies.gap(bodies.scene, self)
        bodies.terms.dot(name, bodies.axis(self.first, self.axis), gap, 1)

    def pushes(self, motion: Any) -> UnitVectors:
        """Return the force across the plane."""
        return {"normal": motion.held_axis(self.first, self.axis)}


@dataclass(frozen=True)
class Hinged(JointCondition):
    """The angle [rad] from the first body's direction to the second's about an axis of both follows a function."""

    first: Attachment
    second: Attachment
    angle: Function
    axis: Vector3

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the angle about the axis."""
        bodies.keep_hinge(name, self)

    def twists(self, motion: Any) -> UnitVectors:
        """Return the torque about the axis."""
        return {"m1": motion.common_axis(self.first, self.second, self.axis)}


def _slider(joint: Slider) -> list[JointCondition]:
    line = Along(joint.first, joint.second, joint.direction, bool(np.any(joint.mu)))
    return [line, Turned(joint.first, joint.second)] if joint.rotation == "locked" else [line]


def _gear(joint: Gear) -> list[JointCondition]:
    if np.ndim(joint.ratio):
        raise InputError("ratio of a gear: is of whole teeth, so that it cannot vary; state each in a scene of its own")
    m, n = joint.fraction.numerator, joint.fraction.denominator
    first, second = joint.axes
    sides, axes = (joint.second, joint.first, joint.carrier), (second, first, first)
    most = max(map(abs, (n, -m, m - n)))
    turning = zip((n, -m, m - n), sides, axes, strict=True)
    return [Sum(tuple((teeth / most, BodyAngle(side, axis)) for teeth, side, axis in turning), None, "torque")]


CONDITIONS: dict[type, Callable[[Any], list[JointCondition]]] = {
    Revolute: lambda joint: [Meet(joint.first, joint.second, bool(np.any(joint.mu)))],
    Weld: lambda joint: [Meet(joint.first, joint.second), Turned(joint.first, joint.second, joint.angle)],
    Slider: _slider,
    Distance: lambda joint: [Apart(joint.first, joint.second, joint.length)] if joint.keeps == "exactly" else [],
    Parallel: lambda joint: [Turned(joint.first, joint.second, either=(0.0, np.pi))],
    Perpendicular: lambda joint: [Turned(joint.first, joint.second, either=(np.pi / 2, -np.pi / 2))],
    Rope: lambda joint: [Reeved(tuple(parts_of_rope(joint)), joint.keeps == "exactly")],
    DrivenAngle: lambda joint: [Turned(joint.first, joint.second, joint.angle)],
    Gear: _gear,
    Coupling: lambda joint: [Sum(parts_of(joint.terms), joint.sum)],
}


def _spatial_slider(joint: Slider) -> list[JointCondition]:
    along = joint.direction if joint.axis is None else joint.axis
    line = Along(joint.first, joint.second, along, bool(np.any(joint.mu)))
    return [line, Turned(joint.first, joint.second)] if joint.rotation == "locked" else [line]


def _planar(joint: Planar) -> list[JointCondition]:
    plane = InPlane(joint.first, joint.second, joint.axis)
    if joint.rotation == "free":
        return [plane]
    if joint.rotation == "locked":
        return [plane, Turned(joint.first, joint.second)]
    return [plane, Aligned(joint.first, joint.second, joint.axis)]


SPATIAL: dict[type, Callable[[Any], list[JointCondition]]] = {
    Revolute: lambda j: [*CONDITIONS[Revolute](j), Aligned(j.first, j.second, j.axis)],
    Spherical: lambda j: [Meet(j.first, j.second)],
    Universal: lambda j: [Meet(j.first, j.second), Square(j.first, j.second, j.axis, j.second_axis)],
    Cylindrical: lambda j: [Along(j.first, j.second, j.axis), Aligned(j.first, j.second, j.axis)],
    Planar: _planar,
    Weld: CONDITIONS[Weld],
    Slider: _spatial_slider,
    Distance: CONDITIONS[Distance],
    Parallel: lambda j: [Aligned(j.first, j.second, None)],
    Perpendicular: lambda j: [Square(j.first, j.second, None, None)],
    Rope: CONDITIONS[Rope],
    DrivenAngle: lambda j: [Hinged(j.first, j.second, j.angle, j.axis)],
    Gear: _gear,
    Coupling: CONDITIONS[Coupling],
}
"""The conditions of every kind of joint in space, where axes point as they do at the start."""


def conditions(joint: Any, dimensions: int = 2) -> list[Any]:
    """Return the conditions of a joint.

    Raises InputError for a kind that is known in the plane alone, or in space alone, and NotImplementedError for one
    that is in neither table.
    """
    table, other = (CONDITIONS, SPATIAL) if dimensions == 2 else (SPATIAL, CONDITIONS)
    if type(joint) not in table:
        if type(joint) in other:
            raise InputError(f"joints: {joint.kind!r} is no joint of scenes with {dimensions} dimensions")
        raise NotImplementedError(f"the mechanics knows no conditions of a joint of kind {joint.kind!r}")
    if is_loose(joint):
        return []  # contacts hold it, see `assembly.contacts`
    return table[type(joint)](joint)


def of_scene(scene: Scene) -> Iterator[tuple[str, Any]]:
    """The conditions of all joints, in the order of the scene, with the name of the joint."""
    for name, joint in scene.joints.items():
        yield from ((name, condition) for condition in conditions(joint, scene.dimensions))


def weld_of(conditions: list[JointCondition]) -> Turned | None:
    """Return the condition that keeps the angle, if another keeps the place as well."""
    held = [one for one in conditions if isinstance(one, Turned) and not one.driven]
    return held[0] if held and any(isinstance(one, Meet) for one in conditions) else None
