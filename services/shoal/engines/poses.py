"""Where every body of a scene starts: a walk along the joints from the ground, and from bodies that say it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shoal.engines.course import slope_after
from shoal.errors import InputError
from shoal.scene import (
    GROUND,
    Attachment,
    Coupling,
    Distance,
    DrivenAngle,
    Function,
    MovingPoint,
    Parallel,
    Perpendicular,
    Revolute,
    Rod,
    Scene,
    Slider,
    Weld,
)
from shoal.scene.joints import Joint, places
from shoal.scene.loads import sides as load_sides
from shoal.trajectory import Array

CLOSURE = 1e-6
"""Gap [m] and relative speed [m/s] per metre of machine (and rad, rad/s) that a joint may have at the start."""


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
    """Pose of every body, of the ground and its moving points, undeformed. Raises InputError if a joint is open."""
    angles = _angles(scene)
    poses = {GROUND: FIXED}
    for name, path in scene.ground_points.items():
        position, velocity = moving_point(path)
        poses[f"{GROUND}.{name}"] = Pose(position, 0.0, velocity, 0.0)
    while waiting := [name for name in scene.bodies if name not in poses]:
        name, position, speed, place = _next(scene, waiting, poses)
        loose = Pose(np.zeros(2), angles[name][0], np.zeros(2), angles[name][1])
        origin, velocity = position - loose.position(place), speed - loose.speed(place)
        poses[name] = Pose(origin, loose.angle, velocity, loose.rate)
    _check(scene, poses)
    return poses


def _next(scene: Scene, waiting: list[str], poses: dict[str, Pose]) -> tuple[str, Array, Array, tuple[float, float]]:
    """A body whose start is known: position, velocity and which of its places has them."""
    for kind in (Revolute | Weld, None, Slider):
        if kind is None:
            for name in waiting:
                start = scene.start(name)
                if start.position is not None:
                    return name, np.array(start.position), np.array(start.velocity), (0.0, 0.0)
            continue
        for joint in scene.joints.values():
            if isinstance(joint, kind) and not isinstance(joint, Coupling):
                both = ((joint.first, joint.second), (joint.second, joint.first))
                for known, new in both[:1] if isinstance(joint, Slider) else both:
                    if owner(known) in poses and new.body in waiting:
                        pose, place = poses[owner(known)], local(scene, known)
                        return new.body, pose.position(place), pose.speed(place), local(scene, new)
    raise InputError(f"initial.{waiting[0]}.position: say where {waiting[0]} starts; no joint point tells it")


def _angles(scene: Scene) -> dict[str, tuple[float, float]]:
    """Angle [rad] and rate [rad/s] of every body: the ground's, the scene's, or those a rigid neighbour passes on."""
    found = {GROUND: (0.0, 0.0)}

    def spread() -> None:
        frontier = list(found)
        while frontier:
            here = frontier.pop()
            for first, second, turn in _rigid_turns(scene):
                for known, new, sign in ((first, second, 1), (second, first, -1)):
                    if known == here and new not in found:
                        angle = found[here][0] + sign * turn
                        turns = np.round((scene.start(new).angle - angle) / (2 * np.pi))
                        found[new] = (angle + 2 * np.pi * turns, found[here][1])
                        frontier.append(new)

    spread()
    for name in (*scene.initial, *scene.bodies):
        if name not in found:
            found[name] = (scene.start(name).angle, scene.start(name).rate)
            spread()
    return found


def _rigid_turns(scene: Scene) -> Iterator[tuple[str, str, float]]:
    for joint in scene.joints.values():
        turn = kept_turn(scene, joint)
        if turn is not None and not isinstance(joint, Coupling):
            names = joint.first.body, joint.second.body
            if all(name == GROUND or scene.bodies[name].element == "rigid" for name in names):
                yield (*names, turn)


def extent(scene: Scene, body: str) -> float:
    """Largest distance [m] between two places of a body that have a name or that joints or markers use."""
    ends = [end for joint in scene.joints.values() for end in places(joint)]
    used = [scene.location(place) for place in (*ends, *scene.markers.values()) if place.body == body]
    used += scene.bodies[body].points.values()
    at = np.array(used)
    return float(np.max(np.linalg.norm(at[:, None] - at[None], axis=-1)))


def size(scene: Scene) -> float:
    """Sum of the bodies' extents [m]: how far a machine reaches from the ground that holds it."""
    return sum(extent(scene, body) for body in scene.bodies)


def span(scene: Scene, poses: dict[str, Pose]) -> float:
    """Largest distance [m] between two places of joints, loads and markers at the start, or the size if larger.

    One metre where they all coincide.
    """
    joined = [end for joint in scene.joints.values() for end in places(joint)]
    loaded = [end for load in scene.loads.values() for end in load_sides(load).values()]
    used = (*joined, *loaded, *scene.markers.values())
    at = np.array([poses[owner(end)].position(local(scene, end)) for end in used])
    return max(size(scene), float(np.max(np.linalg.norm(at[:, None] - at[None], axis=-1)))) or 1.0


def _check(scene: Scene, poses: dict[str, Pose]) -> None:
    """Raises InputError where a joint does not hold at the start."""
    metres = CLOSURE * max(1.0, span(scene, poses))
    for name, joint in scene.joints.items():
        if isinstance(joint, Coupling):
            continue
        first, second = (poses[owner(end)] for end in (joint.first, joint.second))
        one, other = local(scene, joint.first), local(scene, joint.second)
        apart = second.position(other) - first.position(one)
        moving = second.speed(other) - first.speed(one)
        if isinstance(joint, Slider):
            line = Pose(np.zeros(2), first.angle + joint.direction, np.zeros(2), 0.0)
            moving = moving - first.rate * normal(apart)
            apart, moving = (np.array([normal(line.axis) @ part]) for part in (apart, moving))
        elif isinstance(joint, Distance):
            length = np.linalg.norm(apart)
            moving = np.array([apart @ moving / max(float(length), 1e-300)])
            held = length if joint.length is None else value(joint.length, 0.0)
            apart = np.array([length - held])
        elif not isinstance(joint, Revolute | Weld):
            apart, moving = np.zeros(2), np.zeros(2)
        gap, slip = float(np.linalg.norm(apart)), float(np.linalg.norm(moving))
        if gap > metres:
            raise InputError(f"joints.{name}: its places start {gap:.3g} m apart; change an angle under initial")
        if slip > metres:
            raise InputError(f"joints.{name}: its places start at {slip:.3g} m/s apart; change a rate under initial")
        turn, rate = kept_turn(scene, joint), 0.0
        if isinstance(joint, DrivenAngle):
            turn, rate = value(joint.angle, 0.0), slope(joint.angle, 0.0)
        if turn is not None:
            ahead = second.angle + lead(scene, joint.second) - first.angle - lead(scene, joint.first)
            off = abs(np.angle(np.exp(1j * (ahead - turn))))
            faster = abs(second.rate - first.rate - rate)
            if off > CLOSURE:
                raise InputError(f"joints.{name}: starts {off:.3g} rad off; change an angle under initial")
            if faster > CLOSURE:
                raise InputError(f"joints.{name}: starts {faster:.3g} rad/s off; change a rate under initial")
