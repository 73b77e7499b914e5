"""Separate rigid bodies whose vectors the conditions of joints refer to, by components in the frames of the bodies.

Of these vectors the terms of the conditions are made (`joints.JointCondition.constrain`), in the plane and in space.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.joints import Turned, of_scene
from shoal.mechanics.modal.modes import bent
from shoal.mechanics.numerics.tile import Array, Number
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.sums import angle_sides
from shoal.mechanics.terms import Terms
from shoal.scene import GROUND, Attachment, Function, PointMass, Rod, Scene
from shoal.scene.formula import Measure
from shoal.scene.function import Composed

PLACE, DIRECTION, ANGLE = range(3)
"""What a vector of a body is: the way to a place [m], a unit vector, or its angle [rad] and zero."""


class Mark(NamedTuple):
    """A vector of a body: what it is, its components in the body's frame and their rates, (d, lanes) or (d, 1).

    body: its number; -1: the ground
    """

    body: int
    kind: int
    components: Array
    rates: Array


class RigidBodies:
    """Separate rigid bodies of the plane. Angles are counted, with all their turns.

    The components of the vectors are the unknowns of the terms. apart: whether every place of a flexible rod is of a
    body of its own, as the rod does not hold them rigidly
    """

    def __init__(self, scene: Scene, apart: bool = False) -> None:
        self.scene, self.terms, self._apart = scene, Terms(), apart
        self.owners = list(scene.bodies)
        """By number of the rigid body, whose it is."""
        self._pieces: dict[tuple[str, Any], int] = {(name, None): k for k, name in enumerate(scene.bodies)}
        self.points = {name for name, body in scene.bodies.items() if isinstance(body, PointMass)}
        self.marks: list[Mark] = []
        self.wrapping = list[int]()
        """Numbers of the terms where whole turns make no difference."""
        self.of_start: dict[int, Turned | None] = {}
        """By number of the term, what keeps a value of the start: an angle may be one of two; None: just that."""
        self._known: dict[tuple[int, int], tuple[Attachment, Affine]] = {}
        for name, condition in of_scene(scene):
            condition.constrain(name, self)
        self.of_start |= {k: None for k, one in enumerate(self.terms.held) if one.of_start}
        for name in self.points if scene.dimensions == plane.DIMENSIONS else ():  # which have no angle
            self._add_angles(name, ((1.0, Attachment(body=name, point=(0.0, 0.0))),))

    def point(self, scene: Scene, at: Attachment) -> Affine:
        """Return the place of an attachment [m]."""
        is_fixed = at.body == GROUND and not isinstance(at.point, str)
        return fixed(plane.vector(*scene.location(at))) if is_fixed else self._vector(at, PLACE)

    def direction(self, scene: Scene, at: Attachment) -> Affine:
        """Return the unit vector of the body's direction at an attachment."""
        axis = np.eye(scene.dimensions)[0][:, None]
        return fixed(axis) if at.body == GROUND else self._vector(at, DIRECTION)

    def gap(self, scene: Scene, condition: Any) -> Affine:
        """Return the vector from the first place of a condition to the second [m]."""
        return self.point(scene, condition.second) - self.point(scene, condition.first)

    def line(self, first: Attachment, direction: Any) -> Affine:
        """Return the unit vector of a line that a body holds."""
        return self.direction(self.scene, first).turned(plane.rotation(direction))

    def across(self, first: Attachment, direction: Any) -> list[tuple[Affine, Array]]:
        """Return the direction of a line that a body holds, with the form of the vector product."""
        return [(self.line(first, direction), plane.CROSS)]

    def angle(self, name: str, side: Attachment, axis: Any) -> Affine:
        """Return the vector of the angle [rad] of a body at an attachment, with all turns, and zero."""
        return self._vector(side, ANGLE)

    def keep_distance(self, name: str, gap: Affine, length: Function | None) -> None:
        """Require the length of a vector [m]; None: that of the start."""
        drive = None if length is None else length.through("neg")
        none = fixed(0.0 * gap.constant)
        roots = [(1.0, gap, 0.0)]
        self.terms.sum(name, [(none, none)], roots=roots, lengths=1, drive=drive, of_start=length is None)

    def span(self, name: str, gap: Affine, c: Number) -> None:
        """Return nothing: spans between separate bodies are no unknowns."""

    def count(self, name: str, vector: Affine, lever: Number | None = None) -> Affine:
        """Return the vector whose first component is an angle with all its turns."""
        return vector

    def joint_angle(self, name: str, measure: Measure) -> list[tuple[float, Affine]] | None:
        """Return vectors whose angles add up to that of a joint or a body, with their signs."""
        signs = zip((-1.0, 1.0), angle_sides(self.scene, measure), strict=True)
        return [(sign, self.angle(name, side, None)) for sign, side in signs if side.body != GROUND]

    def keep_angle(self, name: str, condition: Turned) -> None:
        """Require the angle from the first direction to the second, but for whole turns; a point mass has none."""
        if {condition.first.body, condition.second.body} & self.points:
            return
        self.wrapping.append(len(self.terms.held))
        drive = condition.angle.through("neg") if isinstance(condition.angle, Function) else None
        if drive is None:
            self.of_start[len(self.terms.held)] = condition
        self._add_angles(name, ((1.0, condition.second), (-1.0, condition.first)), drive)

    def _add_angles(self, name: str, parts: Iterable[tuple[float, Attachment]], drive: Composed | None = None) -> None:
        axis = fixed(np.eye(2)[0][:, None])
        total = fixed(0.0 * axis.constant)
        for factor, side in parts:
            if side.body != GROUND:
                total = total + self._vector(side, ANGLE) * factor
        self.terms.dot(name, axis, total, 0, drive=drive)

    def _vector(self, at: Attachment, kind: int) -> Affine:
        key = id(at), kind
        if key not in self._known:
            self._known[key] = at, self.marked(self.mark(at, kind))
        return self._known[key][1]

    def marked(self, mark: Mark) -> Affine:
        """Add a vector of a body."""
        self.marks.append(mark)
        d = self.scene.dimensions
        return Affine(dict(enumerate(np.eye(d)[..., None], d * len(self.marks) - d)), np.zeros((d, 1)))

    def body(self, at: Attachment) -> int:
        """The number of the rigid body that an attachment is on."""
        rod = self._apart and self.scene.bodies[at.body].element != "rigid"
        key = at.body, self.scene.location(at) if rod else None
        if key not in self._pieces:
            self._pieces[key] = len(self.owners)
            self.owners.append(at.body)
        return self._pieces[key]

    def mark(self, at: Attachment, kind: int) -> Mark:
        """Return the vector of a body at an attachment: its place, direction or angle."""
        if at.body == GROUND:
            assert isinstance(at.point, str)
            path = self.scene.ground_points[at.point]
            ways = (path.x, path.y, path.z)[: self.scene.dimensions]
            return Mark(-1, kind, *(plane.vector(*map(part, ways)) for part in (value_of, rate_of)))
        value, rate = place_of(self.scene, at), bending_rate(self.scene, at)
        if kind != PLACE:
            value, rate = lead(self.scene, at), np.real(_bending(self.scene, at)[3])
        if kind == DIRECTION:
            value = phasor(value)
            rate = 1j * value * rate
        return Mark(self.body(at), kind, *(plane.vector(np.real(x), np.imag(x)) for x in (value, rate)))


def place_of(scene: Scene, at: Attachment) -> Number:
    """Place x + iy [m] of an attachment in the frame of the body, unstrained but for its stated modes."""
    place, body = as_complex(scene.location(at)), scene.bodies.get(at.body)
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        s = np.real(place)
        return body.axis(s) + 1j * np.imag(place) * phasor(body.turn(s))
    return _bending(scene, at)[0]


def bending_rate(scene: Scene, at: Attachment) -> Number:
    """Velocity [m/s] of an attachment in its body's frame, x + iy."""
    return _bending(scene, at)[1]


def _bending(scene: Scene, at: Attachment) -> tuple[Number, Number, Number, Number]:
    """Place x + iy [m] in the body's frame, its rate, the turn there [rad] and its rate, of a body's stated modes."""
    if at.body == GROUND or scene.bodies[at.body].element != "modal":
        return as_complex(scene.location(at)), 0.0, 0.0, 0.0
    return bent(scene, at.body, scene.location(at))


def lead(scene: Scene, at: Attachment) -> Number:
    """Angle [rad] by which the direction at an attachment is ahead of the body's x axis at the start."""
    body = scene.bodies.get(at.body)
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        return body.turn(scene.location(at)[0])
    return 0.0 if scene.dimensions == 3 else _bending(scene, at)[2]


def value_of(f: Function) -> float:
    """A function of time at the start."""
    return start_value(f)


def rate_of(f: Function) -> float:
    """Its derivative there."""
    return start_slope(f)
