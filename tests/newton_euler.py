"""Rigid machines in the plane by Newton and Euler in absolute coordinates: an oracle that shares no code with Shoal.

Every body has the place of its centre of mass and an angle; multipliers of the joints are solved for at every instant,
and scipy's DOP853 integrates. Scenes are mappings as a file would state them, of rigid bodies alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

Array = npt.NDArray[np.float64]
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


class Place(NamedTuple):
    """Where a point is and how it moves: its acceleration is `jacobian a + bias`."""

    at: Array
    velocity: Array
    jacobian: Array
    bias: Array


class Row(NamedTuple):
    """`jacobian a + bias = 0`; a multiplier of 1 is this force and torque on the joint's second body."""

    joint: str
    jacobian: Array
    bias: float
    force: Array
    torque: float


def turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


class NewtonEuler:
    """A machine; poses: (x, y, angle) of each body's frame at the start, rates: (vx, vy, rate)."""

    def __init__(self, scene: dict[str, Any], poses: dict[str, Array], rates: dict[str, Array]) -> None:
        self.scene, self.numbers = scene, {name: 3 * k for k, name in enumerate(scene["bodies"])}
        self.gravity = np.array([0.0, -9.81])
        bodies = scene["bodies"].values()
        self.mass = np.concatenate([[body["mass"], body["mass"], body["inertia"]] for body in bodies])
        self.start = np.zeros(2 * self.mass.size)
        for name, k in self.numbers.items():
            arm = turned(poses[name][2]) @ self._centre(name)
            self.start[k : k + 3] = [*(poses[name][:2] + arm), poses[name][2]]
            spun = rates[name][2] * QUARTER @ arm
            self.start[self.mass.size + k :][:3] = [*(rates[name][:2] + spun), rates[name][2]]

    def run(self, times: Array) -> list[tuple[Array, Array, float]]:
        """Coordinates, rates and time of every sample."""
        n = self.mass.size

        def change(t: float, y: Array) -> Array:
            return np.concatenate([y[n:], self.solve(y[:n], y[n:], t)[0]])

        found = solve_ivp(change, (0.0, times[-1]), self.start, t_eval=times, method="DOP853", rtol=1e-13, atol=1e-14)
        assert found.success
        return [(y[:n], y[n:], t) for y, t in zip(found.y.T, times.tolist(), strict=True)]

    def solve(self, q: Array, v: Array, t: float) -> tuple[Array, dict[str, Array]]:
        """Accelerations, and what each joint exerts on its second body: force x, y and torque."""
        rows = self._rows(q, v)
        jacobian, bias = np.array([row.jacobian for row in rows]), np.array([row.bias for row in rows])
        force, exerted = self._forces(q, v, t)
        free = force / self.mass
        multiplier = np.linalg.solve(jacobian / self.mass @ jacobian.T, -bias - jacobian @ free)
        for row, size in zip(rows, multiplier.tolist(), strict=True):
            exerted[row.joint] = exerted.get(row.joint, np.zeros(3)) + size * np.append(row.force, row.torque)
        return free + jacobian.T @ multiplier / self.mass, exerted

    def specific_force(self, at: dict[str, Any], tilt: float, q: Array, v: Array, a: Array) -> Array:
        """Acceleration less gravity along the body's axes, turned by `tilt`."""
        place = self.place(at, q, v)
        angle = q[self.numbers[at["body"]] + 2] + tilt
        return np.asarray(turned(angle).T @ (place.jacobian @ a + place.bias - self.gravity))

    def rate(self, at: dict[str, Any], v: Array) -> float:
        """Of the body of a place."""
        return float(v[self.numbers[at["body"]] + 2])

    def place(self, at: dict[str, Any], q: Array, v: Array) -> Place:
        """The motion of a point of a body or the ground."""
        jacobian = np.zeros((2, q.size))
        point = at.get("point", "start")
        if at["body"] == "ground":
            return Place(np.array(point, dtype=float), np.zeros(2), jacobian, np.zeros(2))
        named = self.scene["bodies"][at["body"]].get("named_points", {})
        local = np.array(named.get(point, [0.0, 0.0]) if isinstance(point, str) else point) - self._centre(at["body"])
        k = self.numbers[at["body"]]
        arm, rate = turned(q[k + 2]) @ local, v[k + 2]
        jacobian[:, k : k + 2], jacobian[:, k + 2] = np.eye(2), QUARTER @ arm
        return Place(q[k : k + 2] + arm, v[k : k + 2] + rate * QUARTER @ arm, jacobian, -(rate**2) * arm)

    def _centre(self, body: str) -> Array:
        return np.array(self.scene["bodies"][body].get("centre_of_mass", [0.0, 0.0]))

    def _angle(self, at: dict[str, Any], q: Array, v: Array) -> tuple[float, float, Array]:
        row = np.zeros(q.size)
        if at["body"] == "ground":
            return 0.0, 0.0, row
        k = self.numbers[at["body"]] + 2
        row[k] = 1.0
        return float(q[k]), float(v[k]), row

    def _rows(self, q: Array, v: Array) -> list[Row]:
        """Pins, and sliders of the ground that hold the angle."""
        found = []
        for name, joint in self.scene["joints"].items():
            first, second = self.place(joint["first"], q, v), self.place(joint["second"], q, v)
            jacobian, bias = second.jacobian - first.jacobian, second.bias - first.bias
            if joint.get("kind", "revolute") == "revolute":
                found += [Row(name, jacobian[k], bias[k], np.eye(2)[k], 0.0) for k in range(2)]
            else:
                assert joint["first"]["body"] == "ground"
                found.append(Row(name, jacobian[1], bias[1], np.array([0.0, 1.0]), 0.0))
                found.append(Row(name, self._angle(joint["second"], q, v)[2], 0.0, np.zeros(2), 1.0))
        return found

    def _forces(self, q: Array, v: Array, t: float) -> tuple[Array, dict[str, Array]]:
        """Generalised forces, and what rubs in each joint, on its second body."""
        force, rubbing = np.zeros(q.size), dict[str, Array]()
        for k in self.numbers.values():
            force[k : k + 2] += self.mass[k] * self.gravity
        for name, joint in self.scene["joints"].items():
            if joint.get("kind", "revolute") == "revolute":
                (_, rate, _), (_, other, _) = (self._angle(joint[side], q, v) for side in ("first", "second"))
                speed, way = other - rate, self._angle(joint["second"], q, v)[2] - self._angle(joint["first"], q, v)[2]
                unit = np.array([0.0, 0.0, 1.0])
            else:
                place = self.place(joint["second"], q, v)
                speed, way, unit = place.velocity[0], place.jacobian[0], np.array([1.0, 0.0, 0.0])
            drag = -joint["friction"] * speed
            drag -= joint.get("coulomb", 0.0) * np.tanh(speed / joint.get("coulomb_speed", 0.01))
            force, rubbing[name] = force + drag * way, drag * unit
        for load in self.scene["loads"].values():
            if load["kind"] == "spring":
                first, second = self.place(load["first"], q, v), self.place(load["second"], q, v)
                way, speed = second.at - first.at, second.velocity - first.velocity
                length = float(np.linalg.norm(way))
                pull = load["stiffness"] * (length - load["length"]) + load["damping"] * float(way @ speed) / length
                force = force - pull * (way / length) @ (second.jacobian - first.jacobian)
            elif load["kind"] == "torsion-spring":
                angle, rate, row = self._angle(load["second"], q, v)
                force = force - (load["stiffness"] * (angle - load["angle"]) + load["damping"] * rate) * row
            else:
                size, _, rest = load["torque"].partition("*sin(")
                pace = float(rest.removesuffix("*t)"))
                force = force + float(size) * np.sin(pace * t) * self._angle(load["at"], q, v)[2]
        return force, rubbing
