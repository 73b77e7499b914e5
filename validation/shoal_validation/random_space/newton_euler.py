"""A second opinion on rigid machines in space, open or closed: Newton's and Euler's equations with quaternions.

It reads the mapping of a scene, not Shoal's model of it, and shares no code with what it judges. Every body has all six
coordinates, every joint all its conditions; the accelerations are those of least constraint by a pseudo-inverse, which
takes redundant rows as they come, and after every part of the run the state is put back onto the conditions. Singular
positions are beyond it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

Array = Any
DEPENDENT = 1e-5
"""Below this part of the largest singular value a row of the conditions is redundant."""
PART, LONGEST = 0.01, (np.inf, 1e-3)
"""So often the state is put back [s]; the longest step in between, and if that fails [s]: far from the conditions
redundant rows contradict each other."""
TOLERANCE = 1e-10


@dataclass(frozen=True)
class _Vector:
    """A vector of the machine at an instant: its value, its rate, its Jacobian and the rest of its acceleration."""

    value: Array
    rate: Array
    slope: Array
    rest: Array

    def __sub__(self, other: _Vector) -> _Vector:
        return _Vector(
            self.value - other.value, self.rate - other.rate, self.slope - other.slope, self.rest - other.rest
        )


class NewtonEuler:
    """A rigid machine of rigid bodies and point masses, from the mapping of its scene; poses must be stated."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = {"joints": {}, "loads": {}, **data}
        self.names = list(data["bodies"])
        self.bodies = [_properties(data["bodies"][name]) for name in self.names]
        turns = [Rotation.from_rotvec(_start(data, name).get("rotation", [0.0, 0.0, 0.0])) for name in self.names]
        self.place = np.array([_start(data, name)["position"] for name in self.names], dtype=float)
        self.place += np.array([turn.apply(body[2]) for turn, body in zip(turns, self.bodies, strict=True)])
        self.turn = np.array([turn.as_quat() for turn in turns])
        self.begin = np.concatenate([self.place.ravel(), self.turn.ravel()])
        self.images = {name: self._images(joint, turns) for name, joint in self.data["joints"].items()}
        self.rest = {name: np.linalg.norm(self._gap(load, self.begin)) for name, load in self._of_kind("spring")}
        self.apart = {name: np.linalg.norm(self._gap(joint, self.begin)) for name, joint in self.data["joints"].items()}

    def markers(self, times: Sequence[float] | Array) -> dict[str, Array]:
        """Places of the markers at some times [s], (times, 3) each."""
        count, state, now, found = len(self.names), self._start_state(), 0.0, []
        for time in times:
            parts = max(1, int(np.ceil((time - now) / PART)))
            for end in np.linspace(now, time, parts + 1)[1:]:
                state, now = self._part(now, end, state), end
            found.append(state)
        return {
            name: np.array([self._point(marker, one[: 7 * count], one[7 * count :]).value for one in found])
            for name, marker in self.data["markers"].items()
        }

    def _part(self, now: float, end: float, state: Array) -> Array:
        for longest in LONGEST:
            with suppress(np.linalg.LinAlgError), np.errstate(all="ignore"):
                within: Any = {"rtol": TOLERANCE, "atol": TOLERANCE / 10, "max_step": longest}
                run = solve_ivp(self._rate, (now, end), state, "DOP853", **within)
                if run.success:
                    return self._put_back(run.y[:, -1])
        raise ArithmeticError(f"no motion from {now:g} s on")

    def drift(self) -> float:
        """Constraint violation of the stated start."""
        q = self.begin
        rows = [value for value, *_ in self._conditions(q, np.zeros(6 * len(self.names)))]
        return float(np.max(np.abs(rows), initial=0.0))

    # --- the state

    def _images(self, joint: dict[str, Any], turns: list[Rotation]) -> tuple[Array, Array]:
        """The axis of a joint in the frames of its bodies; a second axis is that of the second body."""
        axis = np.array(joint.get("axis", [0.0, 0.0, 1.0]), dtype=float)
        other = np.array(joint.get("second_axis", axis), dtype=float)
        found = []
        for side, one in ((joint["first"], axis), (joint["second"], other)):
            k = self._index(side)
            one = one / np.linalg.norm(one)
            found.append(one if k is None else turns[k].inv().apply(one))
        return found[0], found[1]

    def _start_state(self) -> Array:
        """Stated spins and velocities, and the rates of least kinetic energy of all others."""
        count = len(self.names)
        rows, right = [], []
        for k, name in enumerate(self.names):
            start = _start(self.data, name)
            if "spin" in start:
                rows.append(np.eye(6 * count)[6 * k + 3 : 6 * k + 6])
                right.append(np.array(start["spin"], dtype=float))
            if "velocity" in start:
                vector = self._point({"body": name}, self.begin, np.zeros(6 * count))
                rows.append(vector.slope)
                right.append(np.array(start["velocity"], dtype=float))
        slopes = [row for _, _, row, _ in self._conditions(self.begin, np.zeros(6 * count))]
        matrix = np.vstack([*slopes, *rows, np.zeros((0, 6 * count))])
        wanted = np.concatenate([np.zeros(len(slopes)), *right])
        v = _least(matrix, wanted, self._root(self.begin))
        return np.concatenate([self.begin, v])

    def _root(self, q: Array) -> Array:
        """The inverse root of the mass matrix, by bodies, as a block-diagonal matrix."""
        count = len(self.names)
        found = np.zeros((6 * count, 6 * count))
        for k, (mass, inertia, _) in enumerate(self.bodies):
            found[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = np.eye(3) / np.sqrt(mass)
            turn = self._turn(q, k)
            size, axes = np.linalg.eigh(turn @ inertia @ turn.T)
            found[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = axes / np.sqrt(size)
        return found

    def _rate(self, _: float, state: Array) -> Array:
        count = len(self.names)
        q, v = state[: 7 * count], state[7 * count :]
        force = self._forces(q, v)
        root = self._root(q)
        free = root @ (root.T @ force)
        conditions = list(self._conditions(q, v))
        if conditions:
            rows = np.array([row for _, _, row, _ in conditions])
            wanted = -np.array([rest for *_, rest in conditions])
            free = free + _least(rows, wanted - rows @ free, root)
        return np.concatenate([self._flow(q, v), free])

    def _flow(self, q: Array, v: Array) -> Array:
        count = len(self.names)
        places = v.reshape(count, 6)[:, :3].ravel()
        turning = []
        for k in range(count):
            x, y, z, w = q[3 * count + 4 * k : 3 * count + 4 * k + 4]
            spin, own = v[6 * k + 3 : 6 * k + 6], np.array([x, y, z])
            turning.append([*(0.5 * (w * spin + np.cross(spin, own))), -0.5 * spin @ own])
        return np.concatenate([places, np.ravel(turning)])

    def _put_back(self, state: Array) -> Array:
        count = len(self.names)
        q, v = state[: 7 * count].copy(), state[7 * count :]
        for _ in range(4):
            for k in range(count):
                part = slice(3 * count + 4 * k, 3 * count + 4 * k + 4)
                q[part] /= np.linalg.norm(q[part])
            conditions = list(self._conditions(q, 0 * v))
            if not conditions:
                return np.concatenate([q, v])
            rows, gap = np.array([row for _, _, row, _ in conditions]), np.array([one[0] for one in conditions])
            if np.max(np.abs(gap)) < 1e-14:
                break
            q = q + self._flow(q, _least(rows, -gap, self._root(q)))
        return np.concatenate([q, v - _least(rows, rows @ v, self._root(q))])

    # --- vectors

    def _index(self, side: dict[str, Any]) -> int | None:
        return None if side["body"] == "ground" else self.names.index(side["body"])

    def _turn(self, q: Array, k: int) -> Array:
        count = len(self.names)
        return Rotation.from_quat(q[3 * count + 4 * k : 3 * count + 4 * k + 4]).as_matrix()

    def _point(self, side: dict[str, Any], q: Array, v: Array) -> _Vector:
        k, point = self._index(side), side.get("point", "start")
        size = 6 * len(self.names)
        if k is None:
            return _Vector(np.array([*point, 0.0][:3], dtype=float), np.zeros(3), np.zeros((3, size)), np.zeros(3))
        if isinstance(point, str):
            point = self.data["bodies"][self.names[k]].get("named_points", {}).get(point, [0.0, 0.0, 0.0])
        away = self._direction(k, np.array(point, dtype=float) - self.bodies[k][2], q, v)
        slope = away.slope.copy()
        slope[:, 6 * k : 6 * k + 3] = np.eye(3)
        return _Vector(q[3 * k : 3 * k + 3] + away.value, v[6 * k : 6 * k + 3] + away.rate, slope, away.rest)

    def _direction(self, k: int | None, image: Array, q: Array, v: Array) -> _Vector:
        size = 6 * len(self.names)
        if k is None:
            return _Vector(image, np.zeros(3), np.zeros((3, size)), np.zeros(3))
        a, spin = self._turn(q, k) @ image, v[6 * k + 3 : 6 * k + 6]
        slope = np.zeros((3, size))
        slope[:, 6 * k + 3 : 6 * k + 6] = -_skew(a)
        rate = np.cross(spin, a)
        return _Vector(a, rate, slope, np.cross(spin, rate))

    def _gap(self, pair: dict[str, Any], q: Array) -> Array:
        v = np.zeros(6 * len(self.names))
        return (self._point(pair["second"], q, v) - self._point(pair["first"], q, v)).value

    # --- conditions and forces

    def _conditions(self, q: Array, v: Array) -> Iterator[tuple[float, float, Array, float]]:
        """Value, rate, row and rest of the acceleration of every condition."""
        for name, joint in self.data["joints"].items():
            kind, (one, other) = joint.get("kind", "revolute"), self.images[name]
            first, second = self._index(joint["first"]), self._index(joint["second"])
            gap = self._point(joint["second"], q, v) - self._point(joint["first"], q, v)
            a, b = self._direction(first, one, q, v), self._direction(second, other, q, v)
            fixed = [self._direction(first, normal, q, v) for normal in _across(one)]
            if kind in ("revolute", "spherical", "universal", "weld"):
                for k in range(3):
                    yield float(gap.value[k]), float(gap.rate[k]), gap.slope[k], float(gap.rest[k])
            if kind in ("slider", "cylindrical"):
                for normal in fixed:
                    yield _dot(normal, gap)
            if kind == "planar":
                yield _dot(a, gap)
            if kind == "distance":
                length = float(self.apart[name])
                value, rate, row, rest = _dot(gap, gap)
                yield float(value - length**2), rate, row, rest
            if kind == "universal":
                yield _dot(a, b)
            locked = kind == "weld" or joint.get("rotation") == "locked"
            if (
                kind in ("revolute", "cylindrical")
                or locked
                or (kind == "planar" and joint.get("rotation", "axis") == "axis")
            ):
                for normal in fixed:
                    yield _dot(normal, b)
            if locked:
                turned = self._index(joint["second"])
                away = fixed[0]
                start = Rotation.from_quat(self.turn[turned]) if turned is not None else Rotation.identity()
                base = Rotation.from_quat(self.turn[first]) if first is not None else Rotation.identity()
                image = start.inv().apply(base.apply(_across(one)[1]))
                yield _dot(away, self._direction(turned, image, q, v))

    def _of_kind(self, kind: str) -> list[tuple[str, Any]]:
        return [(name, load) for name, load in self.data["loads"].items() if load["kind"] == kind]

    def _forces(self, q: Array, v: Array) -> Array:
        found, gravity = np.zeros(6 * len(self.names)), np.array([*self.data.get("gravity", [0, -9.81]), 0.0][:3])
        for k, (mass, inertia, _) in enumerate(self.bodies):
            turn, spin = self._turn(q, k), v[6 * k + 3 : 6 * k + 6]
            found[6 * k : 6 * k + 3] = mass * gravity
            found[6 * k + 3 : 6 * k + 6] = -np.cross(spin, turn @ inertia @ turn.T @ spin)
        for name, load in self._of_kind("spring"):
            gap = self._point(load["second"], q, v) - self._point(load["first"], q, v)
            length = np.linalg.norm(gap.value)
            along = gap.value / length
            pull = load["stiffness"] * (length - self.rest[name]) + load.get("damping", 0.0) * along @ gap.rate
            found -= pull * along @ gap.slope
        for _, load in self._of_kind("force"):
            found += np.array(load["force"]) @ self._point(load["at"], q, v).slope
        for name, joint in self.data["joints"].items():
            if joint.get("friction") or joint.get("coulomb"):
                first, second = self._index(joint["first"]), self._index(joint["second"])
                axis = self._direction(first, self.images[name][0], q, v).value
                row = np.zeros_like(found)
                for side, sign in ((first, -1.0), (second, 1.0)):
                    if side is not None:
                        row[6 * side + 3 : 6 * side + 6] = sign * axis
                rate = row @ v
                dry = joint.get("coulomb", 0.0) * np.tanh(rate / joint.get("coulomb_speed", 0.01))
                found -= (joint.get("friction", 0.0) * rate + dry) * row
        return found


def _start(data: dict[str, Any], name: str) -> dict[str, Any]:
    return dict(data.get("initial", {}).get(name, {}))


def _properties(body: dict[str, Any]) -> tuple[float, Array, Array]:
    """Mass, inertia as a matrix about the centre of mass, and that centre in the frame of the body."""
    given = np.asarray(body.get("inertia", 1.0), dtype=float)
    matrix = given * np.eye(3) if given.ndim == 0 else np.diag(given) if given.ndim == 1 else given
    return float(body["mass"]), matrix, np.array([*body.get("centre_of_mass", [0, 0, 0]), 0.0][:3], dtype=float)


def _skew(a: Array) -> Array:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _across(axis: Array) -> tuple[Array, Array]:
    """Two directions at right angles to a unit vector."""
    one = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    one = one / np.linalg.norm(one)
    return one, np.cross(axis, one)


def _dot(u: _Vector, w: _Vector) -> tuple[float, float, Array, float]:
    rest = w.value @ u.rest + u.value @ w.rest + 2 * u.rate @ w.rate
    return (
        float(u.value @ w.value),
        float(u.rate @ w.value + u.value @ w.rate),
        w.value @ u.slope + u.value @ w.slope,
        float(rest),
    )


def _least(rows: Array, wanted: Array, root: Array) -> Array:
    """The smallest change, in the metric of the mass, by which the rows reach what is wanted."""
    return root @ np.linalg.lstsq(rows @ root, wanted, DEPENDENT)[0]
