"""What the joints demand of the poses of the bodies: gaps, their derivatives, and how drives change them.

Every body, flexible ones too, is a rigid one here: x, y [m] of its origin and its angle [rad], three numbers a body in
the order of the scene. All arrays lead with the lanes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shoal.mechanics.affine import Number
from shoal.mechanics.pose import as_complex, unit
from shoal.mechanics.tile import Array, Index
from shoal.scene import (
    GROUND,
    Attachment,
    Coupling,
    Distance,
    DrivenAngle,
    Function,
    Parallel,
    Perpendicular,
    PointMass,
    Revolute,
    Rod,
    Scene,
    Slider,
    Weld,
)


class Rows(NamedTuple):
    """Gaps (lanes, rows) [m, rad], derivatives by the poses (lanes, rows, 3 bodies), and by time (lanes, rows).

    names: the joint of every row. angular: whether its gap is an angle.
    """

    gap: Array
    slope: Array
    rate: Array
    names: tuple[str, ...]
    angular: Index


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

    def rows(self, u: Array) -> Rows:
        """All joints at the poses u."""
        found: list[tuple[str, Array, Array, Array]] = []
        for name, joint in self.scene.joints.items():
            found += [(name, *part) for part in self._joint(joint, u)]
        for name, body in self.scene.bodies.items():
            if isinstance(body, PointMass):  # it has no angle
                k, none = self.column[name] + 2, np.zeros(len(u))
                found.append((name, u[:, k], self._unit(u, k), none))
        if not found:
            none = np.zeros((len(u), 0))
            return Rows(none, np.zeros((len(u), 0, u.shape[1])), none, (), np.zeros(0, dtype=np.int64))
        names, gap, slope, rate = zip(*found, strict=True)
        slopes = np.stack(slope, 1)
        angular = ~np.any(np.delete(slopes, np.s_[2::3], axis=2), axis=(0, 2))
        return Rows(np.stack(gap, 1), slopes, np.stack(rate, 1), names, angular.astype(np.int64))

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
        axis = unit(u[:, k + 2])
        arm = axis * place_of(self.scene, at)
        slope = np.zeros((len(u), u.shape[1]), dtype=complex)
        slope[:, k], slope[:, k + 1], slope[:, k + 2] = 1.0, 1j, 1j * arm
        return Vector(u[:, k] + 1j * u[:, k + 1] + arm, slope, np.zeros(len(u)))

    def direction(self, u: Array, at: Attachment, turn: Number) -> Vector:
        """Unit vector of a body at an attachment, turned by `turn` [rad]."""
        value, slope = self._angle(u, at)
        e = unit(value + turn)
        return Vector(e, 1j * e[:, None] * slope, np.zeros(len(u)))

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

    def _joint(self, joint: object, u: Array) -> list[tuple[Array, Array, Array]]:
        none = np.zeros(len(u))
        if isinstance(joint, Coupling):
            gap, slope = none - value_of(joint.value), np.zeros((len(u), u.shape[1]))
            for term in joint.terms:
                at = self.place(u, term.at).times(term.factor * (1.0 if term.axis == "x" else -1j))
                gap, slope, none = gap + at.value.real, slope + at.slope.real, none + at.rate.real
            return [(gap, slope, none - rate_of(joint.value))]
        assert isinstance(joint, Revolute | Weld | Slider | Distance | Parallel | Perpendicular | DrivenAngle)
        first, second = joint.first, joint.second
        found = []
        if isinstance(joint, Revolute | Weld | Slider | Distance):
            apart = self.place(u, second) - self.place(u, first)
            if isinstance(joint, Slider):
                across = self.direction(u, first, joint.direction).dot(apart)
                found.append((across.value.imag, across.slope.imag, across.rate.imag))
            elif isinstance(joint, Distance):
                length = np.abs(apart.value)
                along = np.where(length > 0, apart.value, 1.0) / np.where(length > 0, length, 1.0)
                wanted, rate = self._length(joint, u, length)
                slope = np.real(np.conj(along)[:, None] * apart.slope)
                found.append((length - wanted, slope, np.real(np.conj(along) * apart.rate) - rate))
            else:
                found += [(f(apart.value), f(apart.slope), f(apart.rate)) for f in (np.real, np.imag)]
        turn = self._turn(joint, u)
        if turn is not None and not {first.body, second.body} & self._points:
            (a, a_slope), (b, b_slope) = self._angle(u, first), self._angle(u, second)
            rate = rate_of(joint.angle) if isinstance(joint, DrivenAngle) else 0.0
            found.append((np.angle(unit(b - a - turn)), b_slope - a_slope, none - rate))
        return found

    @property
    def _points(self) -> set[str]:
        return {name for name, body in self.scene.bodies.items() if isinstance(body, PointMass)}

    def _length(self, joint: Distance, u: Array, now: Array) -> tuple[Number, float]:
        if joint.length is not None:
            return value_of(joint.length), rate_of(joint.length)
        if not self.own:
            return now, 0.0
        begin = self.place(self.begin, joint.second) - self.place(self.begin, joint.first)
        return np.abs(begin.value), 0.0

    def _turn(self, joint: object, u: Array) -> Number | None:
        """Angle [rad] that a joint keeps from the first direction to the second, if it keeps one."""
        if isinstance(joint, DrivenAngle):
            return value_of(joint.angle)
        if isinstance(joint, Weld) and joint.angle is not None:
            return joint.angle
        if isinstance(joint, Weld | Parallel | Perpendicular) or (isinstance(joint, Slider) and joint.rotation == "locked"):
            at = self.begin if self.own or isinstance(joint, Parallel | Perpendicular) else u
            ahead = self._angle(at, joint.second)[0] - self._angle(at, joint.first)[0]
            if isinstance(joint, Parallel):
                return np.where(np.cos(ahead) >= -1e-12, 0.0, np.pi)
            if isinstance(joint, Perpendicular):
                return np.where(np.sin(ahead) >= -1e-12, 0.5, -0.5) * np.pi
            return ahead
        return None


def _lanes(value: Number, u: Array) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=complex), len(u))


def place_of(scene: Scene, at: Attachment) -> Number:
    """Place x + iy [m] of an attachment in the frame of the unstrained body."""
    place, body = as_complex(scene.location(at)), scene.bodies.get(at.body)
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        s = np.real(place)
        return body.axis(s) + 1j * np.imag(place) * unit(body.turn(s))
    return place


def lead(scene: Scene, at: Attachment) -> Number:
    """Angle [rad] by which the direction at an attachment is ahead of the unstrained body's x axis."""
    body = scene.bodies.get(at.body)
    curved = isinstance(body, Rod) and body.element != "rigid" and bool(body.curvature)
    return body.turn(scene.location(at)[0]) if curved and isinstance(body, Rod) else 0.0


def value_of(f: Function) -> float:
    """A function of time at the start."""
    return float(f(np.zeros(1))[0])


def rate_of(f: Function) -> float:
    """Its derivative there, by forward differences of fourth order."""
    if f.number is not None:
        return 0.0
    step = 1e-4
    return float(np.array([-25, 48, -36, 16, -3]) @ f(step * np.arange(5))) / (12 * step)
