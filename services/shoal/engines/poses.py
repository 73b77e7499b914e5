"""Initial poses of all bodies, for engines in absolute coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shoal.engines.course import slope_after
from shoal.errors import InputError
from shoal.mechanics.assembly.groups import moving
from shoal.mechanics.reach import span
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.rigid_bodies import place_of, value_of
from shoal.mechanics.start.start import complete
from shoal.scene import GROUND, Attachment, Scene
from shoal.trajectory import Array

SLIP = 1e-6
"""Relative speed [m/s] per metre of machine (and rad/s) that a joint may have at the start."""


@dataclass(frozen=True)
class InitialPose:
    """Origin [m] (2,), angle [rad], velocity of the origin [m/s] (2,) and rate [rad/s] of a body."""

    origin: Array
    angle: float
    velocity: Array
    rate: float

    def arm(self, place: tuple[float, float]) -> Array:
        """Vector from the origin to a place [m] given in the body's frame, (2,)."""
        axis = np.array([np.cos(self.angle), np.sin(self.angle)])
        return place[0] * axis + place[1] * normal(axis)

    def position(self, place: tuple[float, float]) -> Array:
        """Return the position of a point of the body [m], (2,)."""
        return self.origin + self.arm(place)

    def speed(self, place: tuple[float, float]) -> Array:
        """Velocity of a place of the body [m/s], (2,)."""
        return self.velocity + self.rate * normal(self.arm(place))


def normal(vector: Array) -> Array:
    """The vector turned by a quarter, counter-clockwise, (..., 2)."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def owner(at: Attachment) -> str:
    """The body of an attachment; a moving point of the ground is a body of its own."""
    return moving(at.point) if at.body == GROUND and isinstance(at.point, str) else at.body


def start_of(scene: Scene, poses: dict[str, InitialPose], at: Attachment) -> Array:
    """Return the position of an attachment at the start [m], (2,)."""
    place = complex(place_of(scene, at))
    return poses[owner(at)].position((place.real, place.imag))


def hanging(scene: Scene, engine: str) -> Iterator[tuple[str, Attachment, Attachment]]:
    """Yield the joints of open chains from the ground outwards, each with its places on the parent and on the child.

    engine: that refuses a scene with other bodies. Raises InputError.
    """
    reached, waiting = {GROUND}, {name: (joint.first, joint.second) for name, joint in scene.joints.items()}  # type: ignore[union-attr]
    while found := [name for name, sides in waiting.items() if any(side.body in reached for side in sides)]:
        for name in found:
            first, second = waiting.pop(name)
            parent, child = (first, second) if first.body in reached else (second, first)
            reached.add(child.body)
            yield name, parent, child
    for name in scene.bodies:
        if name not in reached:
            raise InputError(f"bodies.{name}: engine {engine} needs a chain of joints from the ground; use gauss")


def initial_poses(scene: Scene) -> dict[str, InitialPose]:
    """Pose of every body, of the ground and its moving points, undeformed. Raises InputError where joints forbid it."""
    poses = {GROUND: InitialPose(np.zeros(2), 0.0, np.zeros(2), 0.0)}
    for name, path in scene.ground_points.items():
        position, velocity = ([of(path.x), of(path.y)] for of in (value_of, lambda f: slope_after(f, 0.0)))
        poses[moving(name)] = InitialPose(np.array(position), 0.0, np.array(velocity), 0.0)
    scene = complete(scene).scene
    for name in scene.bodies:
        begin = scene.start(name)
        poses[name] = InitialPose(np.array(begin.position), begin.angle, np.array(begin.velocity), begin.rate)
    _check_speeds(scene, poses)
    return poses


def _check_speeds(scene: Scene, poses: dict[str, InitialPose]) -> None:
    """Raises InputError where a joint moves at once what only an elastic rod that gives way could follow."""
    u = np.concatenate([[*poses[name].origin, poses[name].angle] for name in scene.bodies])[None]
    v = np.concatenate([[*poses[name].velocity, poses[name].rate] for name in scene.bodies])
    rows = Closure(scene, u).rows(u)
    slip = np.abs(rows.along(v[None])[0] + rows.rate[0])
    fastest = SLIP * max(1.0, span(scene))
    for name, speed in zip(rows.names, slip, strict=True):
        if speed > fastest:
            raise InputError(f"joints.{name}: its places start at {speed:.3g} m/s apart; change a rate under initial")
