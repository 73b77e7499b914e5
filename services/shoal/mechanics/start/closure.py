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

from shoal.mechanics.assembly.affine import Number
from shoal.mechanics.assembly.pose import as_complex, unit
from shoal.mechanics.numerics.tile import Array, Index
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
from shoal.scene.joints import places

Flags = npt.NDArray[np.bool_]
"""Yes or no, by lane or by lane and pose."""


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

    def rows(self, u: Array) -> Rows:
        """All joints at the poses u."""
        found: list[tuple[str, list[int], Array, Array, Array]] = []
        for name, joint in self.scene.joints.items():
            bodies = dict.fromkeys(at.body for at in places(joint) if at.body != GROUND)
            columns = [self.column[body] + k for body in bodies for k in range(3)]
            part = copy(self)
            part.begin, part.column = self.begin[:, columns], {body: 3 * k for k, body in enumerate(bodies)}
            found += [(name, columns, *row) for row in part._joint(joint, u[:, columns])]
        none = np.zeros(len(u))
        for name in self._points:  # a point mass has no angle
            k = self.column[name] + 2
            found.append((name, [k], u[:, k], np.ones((len(u), 1)), none))
        if not found:
            return Rows(np.zeros((len(u), 0)), np.zeros((len(u), 0)), (), (), np.zeros(0, dtype=np.int64), u.shape[1])
        names, columns_of, gap, slope, rate = zip(*found, strict=True)
        angular = [not any(np.any(s[:, k]) for k, c in enumerate(cs) if c % 3 != 2)
                   for cs, s in zip(columns_of, slope, strict=True)]  # fmt: skip
        parts = tuple(zip(columns_of, slope, strict=True))
        return Rows(np.stack(gap, 1), np.stack(rate, 1), parts, names, np.array(angular, dtype=np.int64), u.shape[1])

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
        if isinstance(joint, Weld | Parallel | Perpendicular) or (
            isinstance(joint, Slider) and joint.rotation == "locked"
        ):
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
