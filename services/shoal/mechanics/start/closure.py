"""Loop closure equations: residuals of the joints by the poses of rigid bodies, their Jacobian and their drift.

Every body, flexible ones too, is a rigid one here: x, y [m] of its origin and its angle [rad], three numbers a body in
the order of the scene. The conditions of the joints state the terms (`joints.JointCondition.constrain`) by vectors of
the bodies; here these follow from the poses. All arrays lead with the lanes.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.joints import Turned, of_scene
from shoal.mechanics.modal.modes import bent
from shoal.mechanics.numerics.tile import Array, Flags, Index, Number
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.term_values import TermValues, laned, one_lane
from shoal.mechanics.terms import Terms
from shoal.scene import GROUND, Attachment, Function, PointMass, Rod, Scene
from shoal.scene.function import Composed

POSE = 3
"""Numbers of a pose."""


PLACE, DIRECTION, ANGLE = range(3)
"""What a vector of a body is: the way to a place [m], a unit vector, or its angle [rad] and zero."""


class _Mark(NamedTuple):
    """A vector of a body: what it is, its components in the body's frame and their rates, (2, lanes) or (2, 1).

    body: its number; -1: the ground
    """

    body: int
    kind: int
    components: Array
    rates: Array


class RigidBodies:
    """Separate rigid bodies of the plane, whose vectors the conditions of the joints refer to.

    The components of these vectors are the unknowns of the terms. Angles are counted, with all their turns.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.terms = scene, Terms()
        self.number = {name: number for number, name in enumerate(scene.bodies)}
        self.points = {name for name, body in scene.bodies.items() if isinstance(body, PointMass)}
        self.marks: list[_Mark] = []
        self.lengths, self.wrapping = list[int](), list[int]()
        """Numbers of the terms that are lengths of vectors, and of those where whole turns make no difference."""
        self.of_start: dict[int, Turned | None] = {}
        """By number of the term, what keeps a value of the start: an angle may be one of two; None: just that."""
        self._known: dict[tuple[int, int], tuple[Attachment, Affine]] = {}
        for name, condition in of_scene(scene):
            condition.constrain(name, self)
        self.of_start |= {k: None for k, one in enumerate(self.terms.held) if one.of_start}
        for name in self.points:  # which have no angle
            self._add_angles(name, ((1.0, Attachment(body=name, point=(0.0, 0.0))),))

    def point(self, scene: Scene, at: Attachment) -> Affine:
        """Return the place of an attachment [m]."""
        is_fixed = at.body == GROUND and not isinstance(at.point, str)
        return fixed(plane.vector(*at.point)) if is_fixed else self._vector(at, PLACE)

    def direction(self, scene: Scene, at: Attachment) -> Affine:
        """Return the unit vector of the body's direction at an attachment."""
        return fixed(np.eye(2)[0][:, None]) if at.body == GROUND else self._vector(at, DIRECTION)

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
        self.lengths.append(len(self.terms.held))
        if length is None:
            self.of_start[len(self.terms.held)] = None
        self.terms.dot(name, gap, gap, 1, drive=None if length is None else length.through("neg"))

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
            self.marks.append(self._mark(at, kind))
            axes = enumerate(np.eye(2)[..., None], 2 * len(self.marks) - 2)
            self._known[key] = at, Affine(dict(axes), np.zeros((2, 1)))
        return self._known[key][1]

    def _mark(self, at: Attachment, kind: int) -> _Mark:
        if at.body == GROUND:
            assert isinstance(at.point, str)
            path = self.scene.ground_points[at.point]
            return _Mark(-1, kind, *(plane.vector(part(path.x), part(path.y)) for part in (value_of, rate_of)))
        value, rate = place_of(self.scene, at), bending_rate(self.scene, at)
        if kind != PLACE:
            value, rate = lead(self.scene, at), np.real(_bending(self.scene, at)[3])
        if kind == DIRECTION:
            value = phasor(value)
            rate = 1j * value * rate
        return _Mark(self.number[at.body], kind, *(plane.vector(np.real(x), np.imag(x)) for x in (value, rate)))


@dataclass(frozen=True)
class Rows:
    """Gaps (lanes, rows) [m, rad], and their derivatives by time (lanes, rows).

    names: of every row its joint. angular: whether its gap is an angle. parts: derivatives by poses, each with rows and
    bodies, (parts,), (lanes or 1, parts, 3), which add up; in one of them no row is there twice. bodies: how many
    """

    gap: Array
    rate: Array
    names: tuple[str, ...]
    angular: Flags
    parts: list[tuple[Index, Index, Array]]
    bodies: int

    @cached_property
    def slope(self) -> Array:
        """Derivatives by all poses, (lanes, rows, 3 bodies)."""
        dense = np.zeros((*self.gap.shape, self.bodies, POSE))
        for rows, bodies, slope in self.parts:
            dense[:, rows, bodies] += slope
        return dense.reshape(*self.gap.shape, POSE * self.bodies)

    def along(self, v: Array) -> Array:
        """The derivatives times rates v (lanes, 3 bodies)."""
        total, each = np.zeros_like(self.gap), v.reshape(len(v), self.bodies, POSE)
        for rows, bodies, slope in self.parts:
            total[:, rows] += np.sum(slope * each[:, bodies], axis=2)
        return total


class Closure:
    """The joints of a scene. begin: poses (lanes, 3 bodies) at which joints without a value of their own hold.

    own: whether joints that keep what the start gives them (a weld without an angle, a distance without a length)
    hold at `begin`, or take any value there is.
    """

    def __init__(self, scene: Scene, begin: Array, own: bool = True) -> None:
        self.begin, self.own = begin, own
        bodies = RigidBodies(scene)
        held, marks = bodies.terms.held, bodies.marks
        self._terms = TermValues(held, 2, bodies.lengths, counted=True)
        self._names, self._bodies = tuple(one.name for one in held), len(bodies.number)
        self._angular = np.array([one.lengths == 0 for one in held], dtype=bool)
        self._wrapping = bodies.wrapping
        self._of_start, self._kept = list(bodies.of_start), list(bodies.of_start.values())
        is_free = [one is None or one.is_of_start for one in self._kept]
        self._free = np.array(self._of_start, dtype=np.int64)[is_free]
        self._body = np.array([one.body for one in marks], dtype=np.int64)
        kinds = np.array([one.kind for one in marks], dtype=np.int64)
        self._places, self._angles = (kinds == PLACE) & (self._body >= 0), kinds == ANGLE
        self._vectors = laned([one.components.T for one in marks], (2,))
        self._rates = laned([one.rates.T for one in marks], (2,))
        self._mark, self._axis = np.divmod(self._terms.unknowns, 2)
        self._at_start: Array | None = None

    def at(self, begin: Array, own: bool = True) -> Closure:
        """Return the same joints with other poses at which those hold that take their value from the start."""
        other = copy(self)
        other.begin, other.own, other._at_start = begin, own, None
        return other

    def of_lane(self, lane: int) -> Closure:
        """Return the joints of one lane, with what they keep."""
        other = copy(self)
        other._terms = self._terms.of_lane(lane)
        other._vectors, other._rates = one_lane(self._vectors, lane), one_lane(self._rates, lane)
        other.begin, other._at_start = self.begin[lane : lane + 1], one_lane(self._values_at_start, lane)
        return other

    def rows(self, u: Array) -> Rows:
        """All joints at the poses u."""
        vectors, crossing, rates = self._evaluate(u)
        gap, slopes = self._terms.at(vectors)
        gap[:, self._of_start] -= self._values_at_start
        gap[:, self._wrapping] = np.angle(phasor(gap[:, self._wrapping]))
        if not self.own:
            gap[:, self._free] = 0.0
        rate = np.repeat(self._terms.drift[None], len(u), axis=0)
        by_pose = np.zeros((*slopes.shape, POSE))
        by_pose[:, np.arange(len(self._axis)), self._axis] = slopes * self._places[self._mark]
        by_pose[..., 2] = slopes * crossing[:, self._mark, self._axis]
        drift = None if rates is None else slopes * rates[:, self._mark, self._axis]
        parts = []
        for part in self._terms.groups:
            rows, bodies = self._terms.rows[part], self._body[self._mark[part]]
            if drift is not None:
                rate[:, rows] += drift[:, part]
            of_body = bodies >= 0
            parts.append((rows[of_body], bodies[of_body], by_pose[:, part][:, of_body]))
        return Rows(gap, rate, self._names, self._angular, parts, self._bodies)

    def _evaluate(self, u: Array) -> tuple[Array, Array, Array | None]:
        """The components of all vectors at poses, (lanes, 2 vectors), and their derivatives, (lanes, vectors, 2).

        These are by the angle of the body, and by time; None: all vectors rest in their bodies.
        """
        poses = np.pad(u.reshape(len(u), -1, POSE), ((0, 0), (0, 1), (0, 0)))[:, self._body]  # the last is the ground
        cosine, sine = np.cos(poses[..., 2:]), np.sin(poses[..., 2:])
        vectors = cosine * self._vectors + sine * _quarter(self._vectors)
        crossing = _quarter(vectors)
        vectors[:, self._angles], crossing[:, self._angles] = self._vectors[:, self._angles], [1.0, 0.0]
        vectors[:, self._angles, 0] += poses[:, self._angles, 2]
        vectors[:, self._places] += poses[:, self._places, :2]
        rates = None
        if np.any(self._rates):
            rates = cosine * self._rates + sine * _quarter(self._rates)
            rates[:, self._angles] = self._rates[:, self._angles]
        return vectors.reshape(len(u), -1), crossing, rates

    @property
    def _values_at_start(self) -> Array:
        """Lengths [m] and sums of angles [rad] that are kept of those at the start, (lanes, terms)."""
        if self._at_start is None:
            found = self._terms.at(self._evaluate(self.begin)[0])[0][:, self._of_start]
            for k, one in enumerate(self._kept):
                found[:, k] = found[:, k] if one is None else one.kept(found[:, k])
            self._at_start = found
        return self._at_start


def _quarter(vectors: Array) -> Array:
    """Vectors (..., 2) turned by a right angle, counter-clockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


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
