"""What the joints demand of the poses of the bodies: gaps, their derivatives, and how drives change them.

Every body, flexible ones too, is a rigid one here: x, y [m] of its origin and its angle [rad], three numbers a body in
the order of the scene. All arrays lead with the lanes.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.joints import Along, Apart, Condition, Geared, Meet, Sum, Turned, conditions, unknown
from shoal.mechanics.modal.modes import bent
from shoal.mechanics.numerics.tile import Array, Index, Number
from shoal.mechanics.plane import as_complex, phasor
from shoal.scene import GROUND, Attachment, Function, PointMass, Rod, Scene
from shoal.scene.joints import places


@dataclass(frozen=True)
class Rows:
    """Gaps (lanes, rows) [m, rad], and their derivatives by time (lanes, rows).

    parts: of every row its columns and the derivatives by these poses, (lanes, columns). names: its joint.
    angular: whether its gap is an angle.
    """

    gap: Array
    rate: Array
    parts: tuple[tuple[list[int], Array], ...]
    names: tuple[str, ...]
    angular: Index
    columns: int

    @cached_property
    def slope(self) -> Array:
        """Derivatives by all poses, (lanes, rows, 3 bodies)."""
        dense = np.zeros((*self.gap.shape, self.columns))
        for row, (columns, slope) in enumerate(self.parts):
            dense[:, row, columns] = slope
        return dense

    def along(self, v: Array) -> Array:
        """The derivatives times rates v (lanes, 3 bodies)."""
        products = [np.einsum("li,li->l", slope, v[:, columns]) for columns, slope in self.parts]
        return np.stack(products, 1) if products else np.zeros_like(self.gap)


@dataclass(frozen=True)
class Vector:
    """A complex number per lane with its derivatives: value (lanes,), slope (lanes, 3 bodies), rate (lanes,)."""

    value: Array
    slope: Array
    rate: Array

    def __add__(self, other: Vector) -> Vector:
        return Vector(self.value + other.value, self.slope + other.slope, self.rate + other.rate)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.value - other.value, self.slope - other.slope, self.rate - other.rate)

    def dot(self, other: Vector) -> Vector:
        """conj(self) other: the real part is the scalar product, the imaginary one the vector product."""
        here, there = np.conj(self.value), other.value
        slope = np.conj(self.slope) * there[:, None] + here[:, None] * other.slope
        return Vector(here * there, slope, np.conj(self.rate) * there + here * other.rate)

    def times(self, factor: Number) -> Vector:
        """Multiplied by a number that may depend on the lane."""
        factor = np.broadcast_to(np.asarray(factor), self.value.shape)
        return Vector(self.value * factor, self.slope * factor[:, None], self.rate * factor)


class Closure:
    """The joints of a scene. begin: poses (lanes, 3 bodies) at which joints without a value of their own hold.

    own: whether joints that keep what the start gives them (a weld without an angle, a distance without a length)
    hold at `begin`, or take any value there is.
    """

    def __init__(self, scene: Scene, begin: Array, own: bool = True) -> None:
        self.scene, self.begin, self.own = scene, begin, own
        self.column = {name: 3 * number for number, name in enumerate(scene.bodies)}
        self._points = {name for name, body in scene.bodies.items() if isinstance(body, PointMass)}
        self._arms: dict[int, tuple[Attachment, Number]] = {}
        self._angular: npt.NDArray[np.int64] | None = None

    @cached_property
    def _parts(self) -> list[tuple[str, list[int], Closure, tuple[Condition, ...]]]:
        """Of every joint its columns, its bodies alone, and what it demands of them."""
        found = []
        for name, joint in self.scene.joints.items():
            bodies = dict.fromkeys(at.body for at in places(joint) if at.body != GROUND)
            columns = [self.column[body] + k for body in bodies for k in range(3)]
            part = copy(self)
            part.begin, part.column = self.begin[:, columns], {body: 3 * k for k, body in enumerate(bodies)}
            found.append((name, columns, part, tuple(conditions(joint))))
        return found

    def rows(self, u: Array) -> Rows:
        """All joints at the poses u."""
        found: list[tuple[str, list[int], Array, Array, Array]] = []
        for name, columns, part, demands in self._parts:
            own = u[:, columns]
            found += [(name, columns, *row) for one in demands for row in part._rows_of(one, own)]
        none = np.zeros(len(u))
        for name in self._points:  # a point mass has no angle
            k = self.column[name] + 2
            found.append((name, [k], u[:, k], np.ones((len(u), 1)), none))
        if not found:
            return Rows(np.zeros((len(u), 0)), np.zeros((len(u), 0)), (), (), np.zeros(0, dtype=np.int64), u.shape[1])
        names, columns_of, gap, slope, rate = zip(*found, strict=True)
        parts = tuple(zip(columns_of, slope, strict=True))
        if self._angular is None:  # which rows these are does not depend on the poses
            angular = [not any(np.any(s[:, k]) for k, c in enumerate(cs) if c % 3 != 2) for cs, s in parts]
            self._angular = np.array(angular, dtype=np.int64)
        return Rows(np.stack(gap, 1), np.stack(rate, 1), parts, names, self._angular, u.shape[1])

    def place(self, u: Array, at: Attachment) -> Vector:
        """Where an attachment is [m]."""
        if at.body == GROUND:
            none = np.zeros((len(u), u.shape[1]), dtype=complex)
            if isinstance(at.point, str):
                path = self.scene.ground_points[at.point]
                value, rate = (part(path.x) + 1j * part(path.y) for part in (value_of, rate_of))
            else:
                value, rate = as_complex(at.point), 0.0
            return Vector(_lanes(value, u), none, _lanes(rate, u))
        k = self.column[at.body]
        axis = phasor(u[:, k + 2])
        arm = axis * self._arm(at)
        bending = _lanes(axis * self.bending_rate(at), u)
        slope = np.zeros((len(u), u.shape[1]), dtype=complex)
        slope[:, k], slope[:, k + 1], slope[:, k + 2] = 1.0, 1j, 1j * arm
        return Vector(u[:, k] + 1j * u[:, k + 1] + arm, slope, bending)

    def bending_rate(self, at: Attachment) -> Number:
        """Velocity [m/s] of an attachment in its body's frame, x + iy."""
        modal = at.body != GROUND and self.scene.bodies[at.body].element == "modal"
        return _bending(self.scene, at)[1] if modal else 0.0

    def _arm(self, at: Attachment) -> Number:
        if id(at) not in self._arms:
            self._arms[id(at)] = at, place_of(self.scene, at)
        return self._arms[id(at)][1]

    def here(self, u: Array, at: Attachment) -> Vector:
        """The same with derivatives by the attachment's own body alone, (lanes, 3)."""
        part, columns = copy(self), self._own(at)
        part.column = {at.body: 0}
        return part.place(u[:, columns], at)

    def speed(self, vector: Vector, v: Array, at: Attachment) -> Array:
        """Velocity [m/s] of what `here` gave."""
        return np.asarray(np.sum(vector.slope * v[:, self._own(at)], axis=1) + vector.rate)

    def _own(self, at: Attachment) -> list[int]:
        return [] if at.body == GROUND else [self.column[at.body] + k for k in range(3)]

    def direction(self, u: Array, at: Attachment, turn: Number) -> Vector:
        """Unit vector of a body at an attachment, turned by `turn` [rad]."""
        value, slope = self._angle(u, at)
        e = phasor(value + turn)
        return Vector(e, 1j * e[:, None] * slope, _lanes(1j * e * _bending(self.scene, at)[3], u))

    def _angle(self, u: Array, at: Attachment) -> tuple[Array, Array]:
        if at.body == GROUND:
            return np.zeros(len(u)), np.zeros((len(u), u.shape[1]))
        k = self.column[at.body] + 2
        return u[:, k] + lead(self.scene, at), self._unit(u, k)

    @staticmethod
    def _unit(u: Array, k: int) -> Array:
        row = np.zeros((len(u), u.shape[1]))
        row[:, k] = 1.0
        return row

    def _rows_of(self, condition: Condition, u: Array) -> list[tuple[Array, Array, Array]]:
        """Gaps of a condition with their derivatives by poses and by time."""
        none = np.zeros(len(u))
        if isinstance(condition, Sum):
            gap, slope = none - value_of(condition.value), np.zeros((len(u), u.shape[1]))
            for term in condition.terms:
                at = self.place(u, term.at).times(term.factor * (1.0 if term.axis == "x" else -1j))
                gap, slope, none = gap + at.value.real, slope + at.slope.real, none + at.rate.real
            return [(gap, slope, none - rate_of(condition.value))]
        if isinstance(condition, Geared):
            gap, slope = none, np.zeros((len(u), u.shape[1]))
            for factor, side in zip(condition.factors, condition.sides, strict=True):
                (now, along), (begin, _) = self._angle(u, side), self._angle(self.begin if self.own else u, side)
                gap, slope = gap + factor * (now - begin), slope + factor * along
            return [(gap, slope, none)]
        if isinstance(condition, Turned):
            if {condition.first.body, condition.second.body} & self._points:
                return []
            (a, a_slope), (b, b_slope) = self._angle(u, condition.first), self._angle(u, condition.second)
            rate = rate_of(condition.angle) if isinstance(condition.angle, Function) else 0.0
            bending = [_bending(self.scene, side)[3] for side in (condition.second, condition.first)]
            rates = none + bending[0] - bending[1] - rate
            return [(np.angle(phasor(b - a - self._turn(condition, u))), b_slope - a_slope, rates)]
        apart = self.place(u, condition.second) - self.place(u, condition.first)
        if isinstance(condition, Along):
            across = self.direction(u, condition.first, condition.direction).dot(apart)
            return [(across.value.imag, across.slope.imag, across.rate.imag)]
        if isinstance(condition, Apart):
            length = np.abs(apart.value)
            along = np.where(length > 0, apart.value, 1.0) / np.where(length > 0, length, 1.0)
            wanted, rate = self._length(condition, length)
            slope = np.real(np.conj(along)[:, None] * apart.slope)
            return [(length - wanted, slope, np.real(np.conj(along) * apart.rate) - rate)]
        if not isinstance(condition, Meet):
            raise unknown(condition)
        return [(f(apart.value), f(apart.slope), f(apart.rate)) for f in (np.real, np.imag)]

    def _length(self, condition: Apart, now: Array) -> tuple[Number, float]:
        if condition.length is not None:
            return value_of(condition.length), rate_of(condition.length)
        if not self.own:
            return now, 0.0
        begin = self.place(self.begin, condition.second) - self.place(self.begin, condition.first)
        return np.abs(begin.value), 0.0

    def _turn(self, condition: Turned, u: Array) -> Number:
        """Angle [rad] that a condition keeps from the first direction to the second."""
        if isinstance(condition.angle, Function):
            return value_of(condition.angle)
        at = u if condition.is_of_start and not self.own else self.begin
        return condition.kept(self._angle(at, condition.second)[0] - self._angle(at, condition.first)[0])


def _lanes(value: Number, u: Array) -> Array:
    return np.full(len(u), value, dtype=complex)


def place_of(scene: Scene, at: Attachment) -> Number:
    """Place x + iy [m] of an attachment in the frame of the body, unstrained but for its stated modes."""
    place, body = as_complex(scene.location(at)), scene.bodies.get(at.body)
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        s = np.real(place)
        return body.axis(s) + 1j * np.imag(place) * phasor(body.turn(s))
    return _bending(scene, at)[0]


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
