"""The unknowns of a machine, and how everything that has a place or a direction hangs on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.groups import JointPoint, is_stiff, kept_rotation, place_of
from shoal.mechanics.assembly.lifted import Lifted, LiftedMeasures
from shoal.mechanics.frames import BeamFrame, Frame
from shoal.mechanics.joints import Along, Apart, InPlane, Meet, Turned
from shoal.mechanics.numerics.tile import Array, Flags, Number
from shoal.mechanics.reach import span
from shoal.mechanics.sums import angle_sides
from shoal.mechanics.terms import Terms
from shoal.scene import GROUND, Attachment, Function, Scene
from shoal.scene.formula import Measure

NO_LENGTH = 1e-9
"""A distance that is none, as a part of the machine's size."""


@dataclass(frozen=True)
class Pose:
    """Initial position [m] (d, lanes) and directors of a body's frame, with their rates of change [m/s, 1/s].

    directors, turning: one vector for each axis of the body and its rate, (d, d, lanes).
    """

    position: Array
    directors: Array
    velocity: Array
    turning: Array

    def point(self, place: tuple[Number, ...]) -> Array:
        """Initial position of a material point."""
        return self.position + arm(self.directors, place)

    def point_velocity(self, place: tuple[Number, ...]) -> Array:
        """Initial velocity of a material point."""
        return self.velocity + arm(self.turning, place)


def arm(directors: Array, place: tuple[Number, ...]) -> Array:
    """The way from a body's origin to a place in its frame [m], (d, lanes)."""
    total: Array = sum(director * part for director, part in zip(directors, place, strict=True))
    return total


@dataclass
class Placement(LiftedMeasures):
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
    states: dict[str, int] = field(default_factory=dict)
    """Unknowns whose rates are states of the user, by the size of these."""
    phases: dict[str, Affine] = field(default_factory=dict)
    """Free motions of joints, see `phases`."""
    lifted: list[Lifted] = field(default_factory=list)
    """Measures with unknowns of their own."""
    ropes: dict[tuple[str, int], list[Any]] = field(default_factory=dict)
    """Lengths and directions of the spans of ropes, by joint and part."""

    def new_vector(self, position: Array, velocity: Array) -> Affine:
        """Add a vector of unknowns with its initial value and rate, (d, lanes) each."""
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

    def add_state(self, name: str, start: Number) -> None:
        """Add an unknown whose rate is a state of the user, with the start of that."""
        self.states[name] = len(self.positions)
        self.positions.append(0.0)
        self.velocities.append(start)

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

    def gap(self, scene: Scene, condition: Along | Apart | Meet | InPlane) -> Affine:
        """The way from the first place of a condition to the second."""
        return self.point(scene, condition.second) - self.point(scene, condition.first)

    def line(self, first: Attachment, direction: Any) -> Affine:
        """Return the unit vector of a line that a body holds. direction: see `across`."""
        return self.direction(self.scene, first).turned(plane.rotation(direction))

    def angle(self, name: str, side: Attachment, axis: Any) -> Affine:
        """Return the unit vector of a body whose angle [rad] the joint `name` counts; axis: in space, about what."""
        return self.direction(self.scene, side)

    def joint_angle(self, name: str, measure: Measure) -> list[tuple[float, Affine]]:
        """Return unit vectors whose angles add up to that of a joint or a body, with their signs."""
        signs = zip((-1.0, 1.0), angle_sides(self.scene, measure), strict=True)
        return [(sign, self.direction(self.scene, side)) for sign, side in signs if side.body != GROUND]

    def across(self, first: Attachment, direction: Any) -> list[tuple[Affine, Array]]:
        """Return vectors u and forms F with u' F w = 0 for w along a line that a body holds: one pair, in space two.

        direction: of the line in the body's frame [rad]; in space also an axis as it points at the start.
        """
        return [(self.line(first, direction), plane.CROSS)]

    def shares(self, condition: Any, is_weld: bool) -> bool:
        """Return whether the coordinates satisfy a condition by themselves, or further terms hold it.

        is_weld: whether it is the angle of two places that coincide
        """
        if isinstance(condition, Meet):
            return not (condition.within or condition.held)
        if isinstance(condition, Turned):
            stiff = all(is_stiff(self.scene, side.body) for side in (condition.first, condition.second))
            return not condition.driven and (stiff or (is_weld and self._is_clamp(condition)))
        return isinstance(condition, Along) and condition.is_fixed

    def _is_clamp(self, weld: Turned) -> bool:
        """Return whether a weld of a rod is to the ground at a node, where the slope has one unknown only."""
        sides = {side.body: side for side in (weld.first, weld.second)}
        if GROUND not in sides:
            return False
        side = next(side for body, side in sides.items() if body != GROUND)
        frame = self.frames[side.body]
        return isinstance(frame, BeamFrame) and frame.node(self.scene.location(side)) is not None

    def keep_distance(self, name: str, gap: Affine, length: Function | None) -> None:
        """Require the length of a vector [m]; None: that of the start. Raises InputError if that is zero."""
        if length is not None:
            self.terms.dot(name, gap, gap, 2, drive=length.through("square", "neg"))
            return
        square = sum(self.start_of(gap)[0] ** 2)
        if np.any(square < (NO_LENGTH * span(self.scene)) ** 2):
            raise InputError(
                f"joints.{name}.length: not stated, so it is that of the start, 0 m, which has no direction; "
                "let the two places start apart, state the length, or join them by a revolute joint"
            )
        self.terms.dot(name, gap, gap, 2, -square)

    def keep_angle(self, name: str, condition: Turned) -> None:
        """Require an angle: by its cosine and sine if it is driven, else of slopes that may stretch, by its sine."""
        first, second = (self.direction(self.scene, side) for side in (condition.first, condition.second))
        if isinstance(condition.angle, Function):
            self.terms.dot(name, first, second, 0, drive=condition.angle.through("cos", "neg"))
            self.terms.cross(name, first, second, 0, condition.angle.through("sin", "neg"))
        else:
            self.terms.cross(name, first.turned(kept_rotation(self.scene, condition)), second, 0)

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
