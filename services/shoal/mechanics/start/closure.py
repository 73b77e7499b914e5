"""Loop closure equations: residuals of the joints by the poses of rigid bodies, their Jacobian and their drift.

Every body, flexible ones too, is a rigid one here: x, y [m] of its origin and its angle [rad], three numbers a body in
the order of the scene. The conditions of the joints state the terms (`joints.JointCondition.constrain`) by vectors of
the bodies; here these follow from the poses. All arrays lead with the lanes.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.joints import Geared, Turned, of_scene
from shoal.mechanics.modal.modes import bent
from shoal.mechanics.numerics.tile import Array, Flags, Index, Number
from shoal.mechanics.plane import as_complex, phasor
from shoal.mechanics.term_values import TermValues, laned, one_lane
from shoal.mechanics.terms import Terms
from shoal.scene import GROUND, Attachment, Function, PointMass, Rod, Scene

POSE = 3
"""Numbers of a pose."""


class _Mark(NamedTuple):
    """A vector of a body: its components in the body's frame and their rates, (2, lanes) or (2, 1).

    body: its number; -1: the ground. placed: whether it is the way to a place [m], or else a direction
    """

    body: int
    placed: bool
    components: Array
    rates: Array


class _Angles(NamedTuple):
    """A sum of factors times angles of bodies at attachments, which a condition keeps; None: at zero."""

    name: str
    parts: tuple[tuple[float, Attachment], ...]
    kept: Turned | Geared | None

    def sum(self, scene: Scene, part: Any) -> Number:
        """The same sum of something of each attachment."""
        return sum((factor * part(scene, side) for factor, side in self.parts), np.zeros(1))

    @property
    def driven(self) -> Function | None:
        """The function of time that the sum follows, if it does."""
        is_driven = isinstance(self.kept, Turned) and isinstance(self.kept.angle, Function)
        return self.kept.angle if is_driven else None  # type: ignore[union-attr]


class RigidBodies:
    """Separate rigid bodies of the plane, whose places and directions the conditions of the joints refer to.

    The unknowns of the terms are the components of the bodies' vectors; angles are counted, with all their turns.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.terms = scene, Terms()
        self.number = {name: number for number, name in enumerate(scene.bodies)}
        self.points = {name for name, body in scene.bodies.items() if isinstance(body, PointMass)}
        self.marks: list[_Mark] = []
        self.angles: list[_Angles] = []
        self.angle_rows: list[int] = []
        self.lengths: dict[int, Function | None] = {}
        """By number of the term: the length of its vector [m]; None: that of the start."""
        self._known: dict[tuple[int, bool], tuple[Attachment, Affine]] = {}
        for name, condition in of_scene(scene):
            condition.constrain(name, self)
        for name in self.points:  # which have no angle
            self._hold(_Angles(name, ((1.0, Attachment(body=name, point=(0.0, 0.0))),), None))

    def point(self, scene: Scene, at: Attachment) -> Affine:
        """Return the place of an attachment [m]."""
        if at.body == GROUND and not isinstance(at.point, str):
            return fixed(plane.vector(*at.point))
        return self._vector(at, True)

    def direction(self, scene: Scene, at: Attachment) -> Affine:
        """Return the unit vector of the body's direction at an attachment."""
        return fixed(np.eye(2)[0][:, None]) if at.body == GROUND else self._vector(at, False)

    def gap(self, scene: Scene, condition: Any) -> Affine:
        """Return the vector from the first place of a condition to the second [m]."""
        return self.point(scene, condition.second) - self.point(scene, condition.first)

    def across(self, first: Attachment, direction: Any) -> list[tuple[Affine, Array]]:
        """Return the direction of a line that a body holds, with the form of the vector product."""
        return [(self.direction(self.scene, first).turned(plane.rotation(direction)), plane.CROSS)]

    def keep_distance(self, name: str, gap: Affine, length: Function | None) -> None:
        """Require the length of a vector [m]; None: that of the start."""
        self.lengths[len(self.terms.held)] = length
        self.terms.dot(name, gap, gap, 1)

    def keep_angle(self, name: str, condition: Turned) -> None:
        """Require the angle from the first direction to the second, but for whole turns."""
        if not {condition.first.body, condition.second.body} & self.points:
            self._hold(_Angles(name, ((1.0, condition.second), (-1.0, condition.first)), condition))

    def keep_mesh(self, name: str, condition: Geared) -> None:
        """Require the weighted sum of angles that the start has."""
        self._hold(_Angles(name, tuple(zip(condition.factors, condition.sides, strict=True)), condition))

    def _hold(self, angles: _Angles) -> None:
        self.angle_rows.append(len(self.terms.held) + len(self.angles))
        self.angles.append(angles)

    def _vector(self, at: Attachment, placed: bool) -> Affine:
        key = id(at), placed
        if key not in self._known:
            self.marks.append(self._placed(at) if placed else self._directed(at))
            axes = enumerate(np.eye(2)[..., None], 2 * len(self.marks) - 2)
            self._known[key] = at, Affine(dict(axes), np.zeros((2, 1)))
        return self._known[key][1]

    def _placed(self, at: Attachment) -> _Mark:
        if at.body == GROUND:
            assert isinstance(at.point, str)
            path = self.scene.ground_points[at.point]
            where, rate = (plane.vector(part(path.x), part(path.y)) for part in (value_of, rate_of))
            return _Mark(-1, True, where, rate)
        where, rate = place_of(self.scene, at), bending_rate(self.scene, at)
        return _Mark(self.number[at.body], True, _components(where), _components(rate))

    def _directed(self, at: Attachment) -> _Mark:
        axis = phasor(lead(self.scene, at))
        return _Mark(self.number[at.body], False, _components(axis), _components(1j * axis * _turning(self.scene, at)))


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


class _Arrays:
    """The terms of rigid bodies, ready to be evaluated at poses."""

    def __init__(self, bodies: RigidBodies) -> None:
        held, angles = bodies.terms.held, bodies.angles
        self.bodies = len(bodies.number)
        self.terms = TermValues(held, 2, list(bodies.lengths))
        self.angle_rows = np.array(bodies.angle_rows, dtype=np.int64)
        self.term_rows = np.setdiff1d(np.arange(len(held) + len(angles)), self.angle_rows)
        names = dict(zip(self.term_rows.tolist(), (one.name for one in held), strict=True))
        names |= zip(bodies.angle_rows, (one.name for one in angles), strict=True)
        self.names = tuple(names[row] for row in range(len(names)))
        self.angular = np.isin(np.arange(len(names)), self.angle_rows)
        self.body = np.array([one.body for one in bodies.marks], dtype=np.int64)
        self.moves = np.array([one.placed and one.body >= 0 for one in bodies.marks], dtype=bool)
        self.vectors = laned([one.components.T for one in bodies.marks], (2,))
        self.rates = laned([one.rates.T for one in bodies.marks], (2,))
        self.distances = np.array(list(bodies.lengths), dtype=np.int64)
        self.lengths = [None if one is None else value_of(one) for one in bodies.lengths.values()]
        self.kept = [(one.kept or 0.0) if one.driven is None else value_of(one.driven) for one in angles]
        self.wraps = np.array([isinstance(one.kept, Turned) for one in angles], dtype=bool)
        self.leads = laned([one.sum(bodies.scene, lead) for one in angles], ())
        driven = [one.sum(bodies.scene, _turning) - _slope_of(one.driven) for one in angles]
        self.angle_drift = laned(driven, ())
        self.term_drift = self.terms.drift.copy()
        self.term_drift[self.distances] -= [_slope_of(one) for one in bodies.lengths.values()]
        self.factors = np.zeros((len(angles), self.bodies))
        for row, one in zip(self.factors, angles, strict=True):
            for factor, side in one.parts:
                if side.body != GROUND:
                    row[bodies.number[side.body]] += factor
        self.mark, self.axis = np.divmod(self.terms.unknowns, 2)
        self.slopes_of_angles = [
            (self.angle_rows[rows], np.full(len(rows), body), (self.factors[rows, body, None] * [0.0, 0.0, 1.0])[None])
            for body in range(self.bodies)
            if len(rows := np.flatnonzero(self.factors[:, body]))
        ]


class Closure:
    """The joints of a scene. begin: poses (lanes, 3 bodies) at which joints without a value of their own hold.

    own: whether joints that keep what the start gives them (a weld without an angle, a distance without a length)
    hold at `begin`, or take any value there is.
    """

    def __init__(self, scene: Scene, begin: Array, own: bool = True) -> None:
        self.begin, self.own = begin, own
        self._arrays = _Arrays(RigidBodies(scene))
        self._at_start: tuple[Array, Array] | None = None

    def at(self, begin: Array, own: bool = True) -> Closure:
        """Return the same joints with other poses at which those hold that take their value from the start."""
        other = copy(self)
        other.begin, other.own, other._at_start = begin, own, None
        return other

    def of_lane(self, lane: int) -> Closure:
        """Return the joints of one lane, with what they keep."""
        other, arrays = copy(self), copy(self._arrays)
        arrays.terms = arrays.terms.of_lane(lane)
        for name in ("vectors", "rates", "leads", "angle_drift"):
            setattr(arrays, name, one_lane(getattr(arrays, name), lane))
        other._arrays = arrays
        other.begin = self.begin[lane : lane + 1]
        other._at_start = tuple(one_lane(kept, lane) for kept in self._values_at_start)  # type: ignore[assignment]
        return other

    def rows(self, u: Array) -> Rows:
        """All joints at the poses u."""
        p, each = self._arrays, u.reshape(len(u), -1, POSE)
        arms, vectors = self._vectors(each)
        found, slopes = p.terms.at(vectors.reshape(len(u), -1))
        gap, rate = np.zeros((2, len(u), len(p.names)))
        rate[:, p.term_rows], rate[:, p.angle_rows] = p.term_drift, p.angle_drift
        lengths, angles = self._values_at_start
        found[:, p.distances] = np.where(self._are_free(p.lengths), 0.0, found[:, p.distances] - lengths)
        turned = self._angles(each) - angles
        gap[:, p.term_rows] = found
        gap[:, p.angle_rows] = np.where(
            self._are_free(p.kept), 0.0, np.where(p.wraps, np.angle(phasor(turned)), turned)
        )
        crossing = _quarter(arms)[:, p.mark, p.axis]
        by_pose = np.zeros((*slopes.shape, POSE))
        by_pose[:, np.arange(len(p.axis)), p.axis] = slopes * p.moves[p.mark]
        by_pose[..., 2] = slopes * crossing
        parts, rows = list(p.slopes_of_angles), p.term_rows[p.terms.rows]
        if np.any(p.rates):
            drift = slopes * self._turned(p.rates, each)[:, p.mark, p.axis]
        for part in p.terms.groups:
            if np.any(p.rates):
                rate[:, rows[part]] += drift[:, part]
            on_body = p.body[p.mark[part]] >= 0
            parts.append((rows[part][on_body], p.body[p.mark[part]][on_body], by_pose[:, part][:, on_body]))
        return Rows(gap, rate, p.names, p.angular, parts, p.bodies)

    def _vectors(self, each: Array) -> tuple[Array, Array]:
        """The bodies' vectors from their origins and from that of the ground, (lanes, vectors, 2) both."""
        p = self._arrays
        arms = self._turned(p.vectors, each)
        vectors = arms.copy()
        vectors[:, p.moves] += each[:, p.body[p.moves], :2]
        return arms, vectors

    def _turned(self, vectors: Array, each: Array) -> Array:
        """Vectors that are stated in the frames of bodies, in that of the ground."""
        turn = np.pad(each[:, :, 2], ((0, 0), (0, 1)))[:, self._arrays.body, None]  # the last is the ground
        return np.cos(turn) * vectors + np.sin(turn) * _quarter(vectors)

    def _angles(self, each: Array) -> Array:
        """The sums of angles [rad], (lanes, sums)."""
        return np.asarray(each[:, :, 2] @ self._arrays.factors.T + self._arrays.leads)

    def _are_free(self, kept: list[Any]) -> Flags:
        """Return which lengths or angles may take any value."""
        of_start = [
            one is None or isinstance(one, Geared) or (isinstance(one, Turned) and one.is_of_start) for one in kept
        ]
        return np.array(of_start, dtype=bool) & (not self.own)

    @property
    def _values_at_start(self) -> tuple[Array, Array]:
        """Lengths [m] and sums of angles [rad] that are kept, (lanes, rows) each."""
        if self._at_start is None:
            p, each = self._arrays, self.begin.reshape(len(self.begin), -1, POSE)
            lengths, angles = np.zeros((len(each), len(p.distances))), self._angles(each)
            if None in p.lengths:
                _, vectors = self._vectors(each)
                lengths = p.terms.at(vectors.reshape(len(each), -1))[0][:, p.distances]
            for k, length in enumerate(p.lengths):
                lengths[:, k] = lengths[:, k] if length is None else length
            for k, one in enumerate(p.kept):
                if not isinstance(one, Geared):
                    angles[:, k] = one.kept(angles[:, k]) if isinstance(one, Turned) else one
            self._at_start = lengths, angles
        return self._at_start


def _slope_of(f: Function | None) -> float:
    return 0.0 if f is None else rate_of(f)


def _quarter(vectors: Array) -> Array:
    """Vectors (..., 2) turned by a right angle, counter-clockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _components(number: Number) -> Array:
    """A complex number as a vector, (2, lanes) or (2, 1)."""
    return plane.vector(np.real(number), np.imag(number))


def _turning(scene: Scene, at: Attachment) -> Number:
    """The rate [rad/s] at which a body's direction at an attachment turns in its frame."""
    return np.real(_bending(scene, at)[3])


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
