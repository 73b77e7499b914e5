"""Where every body of a scene starts, for engines that give each body a pose of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.engines.course import slope_after
from shoal.errors import InputError
from shoal.mechanics.reach import span
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.start import complete
from shoal.scene import (
    GROUND,
    Attachment,
    Coupling,
    Function,
    MovingPoint,
    Parallel,
    Perpendicular,
    Rod,
    Scene,
    Slider,
    Weld,
)
from shoal.scene.joints import Joint
from shoal.trajectory import Array

SLIP = 1e-6
"""Relative speed [m/s] per metre of machine (and rad/s) that a joint may have at the start."""


@dataclass(frozen=True)
class Pose:
    """Origin [m] (2,), angle [rad], velocity of the origin [m/s] (2,) and rate [rad/s] of a body."""

    origin: Array
    angle: float
    velocity: Array
    rate: float

    @property
    def axis(self) -> Array:
        """Unit vector along the body's x axis, (2,)."""
        return np.array([np.cos(self.angle), np.sin(self.angle)])

    def arm(self, place: tuple[float, float]) -> Array:
        """Vector from the origin to a place [m] given in the body's frame, (2,)."""
        return place[0] * self.axis + place[1] * normal(self.axis)

    def position(self, place: tuple[float, float]) -> Array:
        """Where a place of the body is [m], (2,)."""
        return self.origin + self.arm(place)

    def speed(self, place: tuple[float, float]) -> Array:
        """Velocity of a place of the body [m/s], (2,)."""
        return self.velocity + self.rate * normal(self.arm(place))


FIXED = Pose(np.zeros(2), 0.0, np.zeros(2), 0.0)


def normal(vector: Array) -> Array:
    """The vector turned by a quarter, counter-clockwise, (..., 2)."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def owner(at: Attachment) -> str:
    """The body of an attachment; a moving point of the ground is a body of its own, `ground.NAME`."""
    return f"{GROUND}.{at.point}" if at.body == GROUND and isinstance(at.point, str) else at.body


def local(scene: Scene, at: Attachment) -> tuple[float, float]:
    """Coordinates [m] of an attachment in the unstrained body's frame."""
    place, body = scene.location(at), scene.bodies.get(at.body)
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        axis = complex(body.axis(place[0]))
        return axis.real, axis.imag
    return place


def lead(scene: Scene, at: Attachment) -> float:
    """Angle [rad] by which the direction at an attachment is ahead of the unstrained body's x axis."""
    body = scene.bodies.get(at.body)
    curved = isinstance(body, Rod) and body.element != "rigid" and bool(body.curvature)
    return float(body.turn(scene.location(at)[0])) if curved and isinstance(body, Rod) else 0.0


def moving_point(path: MovingPoint, time: float = 0.0) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] of a moving point, (2,) each."""
    both = (path.x, path.y)
    return np.array([value(f, time) for f in both]), np.array([slope(f, time) for f in both])


def value(f: Function, time: float) -> float:
    """A function of time at one instant [s]."""
    return float(f(np.array([time]))[0])


def slope(f: Function, time: float) -> float:
    """Its derivative from then on."""
    return slope_after(f, time)


def kept_turn(scene: Scene, joint: Joint) -> float | None:
    """Angle [rad] from the direction at the first side to that at the second, if the joint keeps it."""
    if isinstance(joint, Coupling):
        return None
    first, second = (scene.start(side.body).angle + lead(scene, side) for side in (joint.first, joint.second))
    difference = second - first
    if isinstance(joint, Weld):
        return difference if joint.angle is None else joint.angle
    if isinstance(joint, Slider) and joint.rotation == "locked":
        return difference
    if isinstance(joint, Parallel):
        return 0.0 if np.cos(difference) >= 0 else np.pi
    if isinstance(joint, Perpendicular):
        return np.pi / 2 if np.sin(difference) >= 0 else -np.pi / 2
    return None


def initial_poses(scene: Scene) -> dict[str, Pose]:
    """Pose of every body, of the ground and its moving points, undeformed. Raises InputError where joints forbid it."""
    poses = {GROUND: FIXED}
    for name, path in scene.ground_points.items():
        position, velocity = moving_point(path)
        poses[f"{GROUND}.{name}"] = Pose(position, 0.0, velocity, 0.0)
    scene = complete(scene).scene
    for name in scene.bodies:
        begin = scene.start(name)
        poses[name] = Pose(np.array(begin.position), begin.angle, np.array(begin.velocity), begin.rate)
    _check_speeds(scene, poses)
    return poses


def _check_speeds(scene: Scene, poses: dict[str, Pose]) -> None:
    """Raises InputError where a joint moves at once what only an elastic rod that gives way could follow."""
    u = np.concatenate([[*poses[name].origin, poses[name].angle] for name in scene.bodies])[None]
    v = np.concatenate([[*poses[name].velocity, poses[name].rate] for name in scene.bodies])
    rows = Closure(scene, u).rows(u)
    slip = np.abs(rows.slope[0] @ v + rows.rate[0])
    for name, speed in zip(rows.names, slip, strict=True):
        if speed > SLIP * max(1.0, span(scene)):
            raise InputError(f"joints.{name}: its places start at {speed:.3g} m/s apart; change a rate under initial")
