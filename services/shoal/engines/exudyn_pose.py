"""Where every body of a scene starts: a walk along the joints from the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.scene import GROUND, Scene
from shoal.trajectory import Array

CLOSURE = 1e-6
"""Gap [m] and relative speed [m/s] per metre of machine that a closed loop may have at the start."""


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


def normal(vector: Array) -> Array:
    """The vector turned by a quarter, counter-clockwise, (..., 2)."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def initial_poses(scene: Scene) -> dict[str, Pose]:
    """Pose of every body (and of the ground), undeformed. Raises InputError where a loop does not close."""
    still = np.zeros(2)
    poses = {GROUND: Pose(still, 0.0, still, 0.0)}
    while len(poses) <= len(scene.bodies):
        for joint in scene.joints.values():
            for known, new in ((joint.first, joint.second), (joint.second, joint.first)):
                if known.body in poses and new.body not in poses:
                    place = scene.location(known)
                    start = scene.start(new.body)
                    loose = Pose(still, start.angle, still, start.rate)
                    held = scene.location(new)
                    poses[new.body] = Pose(
                        poses[known.body].position(place) - loose.position(held),
                        start.angle,
                        poses[known.body].speed(place) - loose.speed(held),
                        start.rate,
                    )
    _check_loops(scene, poses)
    return poses


def extent(scene: Scene, body: str) -> float:
    """Largest distance [m] between two places of a body that joints or markers use."""
    ends = [end for joint in scene.joints.values() for end in (joint.first, joint.second)]
    used = np.array([scene.location(place) for place in (*ends, *scene.markers.values()) if place.body == body])
    return float(np.max(np.linalg.norm(used[:, None] - used[None], axis=-1)))


def _check_loops(scene: Scene, poses: dict[str, Pose]) -> None:
    allowed = CLOSURE * max(1.0, sum(extent(scene, body) for body in scene.bodies))
    for name, joint in scene.joints.items():
        first, second = (poses[end.body] for end in (joint.first, joint.second))
        places = scene.location(joint.first), scene.location(joint.second)
        gap = float(np.linalg.norm(first.position(places[0]) - second.position(places[1])))
        slip = float(np.linalg.norm(first.speed(places[0]) - second.speed(places[1])))
        if gap > allowed:
            raise InputError(f"joints.{name}: its places start {gap:.3g} m apart; change an angle under initial")
        if slip > allowed:
            raise InputError(f"joints.{name}: its places start at {slip:.3g} m/s apart; change a rate under initial")
