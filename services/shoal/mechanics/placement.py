"""Scene -> coordinates: which pairs exist, how every body hangs on them, and where they start.

Bodies are placed by walking the joints from the ground. A cable brings a pair for the position and
one for the slope of every node; a rigid body (a point r and a unit vector e, |e| = 1) is expressed
by the joint points it has, so that chains stay banded, and brings e only if it has fewer than two.
A revolute joint is a shared position.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import Affine, Number, fixed
from shoal.mechanics.elements import ancf_cable
from shoal.scene import GROUND, Attachment, Revolute, Rod, Scene


def as_complex(vector: tuple[Number, Number]) -> Number:
    """x + iy."""
    return vector[0] + 1j * np.asarray(vector[1]) if np.ndim(vector[0]) or np.ndim(vector[1]) else complex(*vector)


@dataclass(frozen=True)
class Pose:
    """Initial position [m] and direction of a body's frame, velocity [m/s] and rate [rad/s]; complex, per lane."""

    position: Number
    direction: Number
    velocity: Number
    rate: Number

    def point(self, p: Number) -> Number:
        """Initial position of the material point p."""
        return self.position + self.direction * p

    def point_velocity(self, p: Number) -> Number:
        """Initial velocity of the material point p."""
        return self.velocity + 1j * self.rate * self.direction * p


@dataclass(frozen=True)
class RigidFrame:
    """A rigid body: position r of its origin and unit vector e, both affine in the coordinates."""

    origin: Affine
    axis: Affine

    def point(self, p: Number) -> Affine:
        """The material point p = x + iy [m]."""
        offset: Affine = self.axis * p
        return self.origin + offset

    def direction(self, p: Number) -> Affine:
        """A vector along the body's x axis."""
        return self.axis


@dataclass(frozen=True)
class CableFrame:
    """A cable: positions and slopes of its equally spaced nodes."""

    length: Number
    positions: tuple[Affine, ...]
    slopes: tuple[Affine, ...]

    @property
    def element_length(self) -> Number:
        """Length of one element [m]."""
        return self.length / (len(self.positions) - 1)

    def element(self, number: int) -> list[Affine]:
        """(r1, r1', r2, r2') of an element."""
        at = number
        return [self.positions[at], self.slopes[at], self.positions[at + 1], self.slopes[at + 1]]

    def _shape(self, p: Number, shape: Any) -> Affine:
        count = len(self.positions) - 1
        place = np.real(p) / np.asarray(self.length) * count
        number = min(int(np.min(place) + 1e-9), count - 1)
        if np.max(place) > number + 1 + 1e-9:
            raise InputError("markers: a marker must stay in one element of its cable while a length varies")
        weights = shape(place - number, np.asarray(self.element_length))
        total = fixed(0.0)
        for weight, vector in zip(weights, self.element(number), strict=True):
            total = total + vector * weight
        return total

    def point(self, p: Number) -> Affine:
        """The material point at the arc length p [m]."""
        node = self.node(p)
        return self._shape(p, ancf_cable.position_shape) if node is None else self.positions[node]

    def direction(self, p: Number) -> Affine:
        """The slope r' at the arc length p [m]."""
        node = self.node(p)
        return self._shape(p, ancf_cable.slope_shape) if node is None else self.slopes[node]

    def node(self, p: Number) -> int | None:
        """The node at the arc length p, if there is one."""
        place = np.real(p) / self.length * (len(self.positions) - 1)
        nearest = int(np.rint(np.asarray(place).flat[0]))
        return nearest if np.all(np.abs(place - nearest) < 1e-9) else None


Frame = RigidFrame | CableFrame


@dataclass
class Placement:
    """All pairs with their initial values, and the frame of every body."""

    positions: list[Number] = field(default_factory=list)
    velocities: list[Number] = field(default_factory=list)
    frames: dict[str, Frame] = field(default_factory=dict)
    poses: dict[str, Pose] = field(default_factory=dict)
    unit_vectors: list[tuple[str, Affine]] = field(default_factory=list)
    """Directions of rigid bodies, whose length the constraints keep at one."""
    closures: list[tuple[str, Affine]] = field(default_factory=list)
    """Differences that loops require to vanish where sharing cannot express them."""

    def new_pair(self, position: Number, velocity: Number) -> Affine:
        """Another pair of coordinates, with its initial value and rate."""
        self.positions.append(position)
        self.velocities.append(velocity)
        return Affine({len(self.positions) - 1: 1.0})


@dataclass
class _JointPoint:
    """Places that revolute joints hold together; `where` is known once a body that has it is placed."""

    name: str
    places: list[tuple[str, Number]]
    where: Affine | None = None


def place(scene: Scene) -> Placement:
    """Walk the joints from the ground and give every body its coordinates and initial state."""
    result = Placement()
    joint_points = _joint_points(scene)
    waiting = dict(scene.bodies)
    while waiting:
        name = next(name for name in waiting if any(_touches(p, name) and p.where is not None for p in joint_points))
        del waiting[name]
        _place_body(scene, name, [p for p in joint_points if _touches(p, name)], result)
    return result


def _touches(point: _JointPoint, body: str) -> bool:
    return any(name == body for name, _ in point.places)


def _joint_points(scene: Scene) -> list[_JointPoint]:
    """Group the places that revolute joints share, transitively; grounded groups are known from the start."""
    groups: list[_JointPoint] = []
    for name, joint in scene.joints.items():
        if not isinstance(joint, Revolute):
            continue
        places = [_place_of(scene, joint.first), _place_of(scene, joint.second)]
        merged = [g for g in groups if any(_same(p, q) for p in g.places for q in places)]
        groups = [g for g in groups if g not in merged]
        for group in merged:
            places += [p for p in group.places if not any(_same(p, q) for q in places)]
        groups.append(_JointPoint(name, places))
    for group in groups:
        bodies = [body for body, _ in group.places]
        for body in bodies:
            if bodies.count(body) > 1:
                raise InputError(f"joints.{group.name}: two places of {body} cannot be joined into one point")
        grounded = [position for body, position in group.places if body == GROUND]
        if grounded:
            group.where = fixed(grounded[0])
    return groups


def _place_of(scene: Scene, attachment: Attachment) -> tuple[str, Number]:
    return attachment.body, as_complex(scene.location(attachment))


def _same(one: tuple[str, Number], other: tuple[str, Number]) -> bool:
    return one[0] == other[0] and bool(np.all(np.abs(one[1] - other[1]) < 1e-12))


def _place_body(scene: Scene, name: str, points: list[_JointPoint], result: Placement) -> None:
    body = scene.bodies[name]
    local = {id(point): next(p for owner, p in point.places if owner == name) for point in points}
    known = [point for point in points if point.where is not None]
    open_points = [point for point in points if point.where is None]
    pose = _initial_pose(scene, name, known[0], local[id(known[0])], result)
    result.poses[name] = pose
    if isinstance(body, Rod) and body.element != "rigid":
        frame: Frame = _cable(name, body, points, local, pose, result)
    else:
        anchors = [*known, *open_points][:2]
        for point in anchors:
            if point.where is None:
                p = local[id(point)]
                point.where = result.new_pair(pose.point(p), pose.point_velocity(p))
        frame = rigid = _rigid(anchors, local, pose, result)
        result.unit_vectors.append((name, rigid.axis))
        for point in known[2:]:
            assert point.where is not None
            result.closures.append((point.name, point.where - rigid.point(local[id(point)])))
    result.frames[name] = frame
    for point in open_points:
        point.where = point.where or frame.point(local[id(point)])


def _initial_pose(scene: Scene, name: str, anchor: _JointPoint, p: Number, result: Placement) -> Pose:
    start = scene.start(name)
    direction = np.exp(1j * np.asarray(start.angle)) if np.ndim(start.angle) else complex(np.exp(1j * start.angle))
    assert anchor.where is not None
    position, velocity = _start_of(anchor.where, result)
    return Pose(position - direction * p, direction, velocity - 1j * start.rate * direction * p, start.rate)


def _rigid(anchors: list[_JointPoint], local: dict[int, Number], pose: Pose, result: Placement) -> RigidFrame:
    first = anchors[0]
    p = local[id(first)]
    assert first.where is not None
    if len(anchors) == 2:
        assert anchors[1].where is not None
        axis = (anchors[1].where - first.where) * (1.0 / (local[id(anchors[1])] - p))
    else:
        axis = result.new_pair(pose.direction, 1j * pose.rate * pose.direction)
    return RigidFrame(first.where + axis * (-p), axis)


def _check_fit(name: str, rod: Rod, planned: Number, point: _JointPoint, result: Placement) -> None:
    """A cable starts straight: raises InputError if a joint holds it somewhere else."""
    assert point.where is not None
    held, _ = _start_of(point.where, result)
    if np.any(np.abs(held - planned) > 1e-6 * rod.length):
        raise InputError(
            f"initial.{name}.angle: joint {point.name} holds {name} {np.max(np.abs(held - planned)):.3g} m away from "
            f"where the straight rod would start; a cable starts straight and unstrained"
        )


def _start_of(where: Affine, result: Placement) -> tuple[Number, Number]:
    """Initial position and velocity of a vector."""
    position, velocity = where.constant, 0.0
    for pair, coefficient in where.terms.items():
        position = position + coefficient * result.positions[pair]
        velocity = velocity + coefficient * result.velocities[pair]
    return position, velocity


def _cable(
    name: str, rod: Rod, points: list[_JointPoint], local: dict[int, Number], pose: Pose, result: Placement
) -> CableFrame:
    positions: list[Affine] = []
    slopes: list[Affine] = []
    shared = {}
    for point in points:
        if point.where is not None:
            _check_fit(name, rod, pose.point(local[id(point)]), point, result)
        place = np.real(local[id(point)]) / rod.length * rod.elements
        node = int(np.rint(np.asarray(place).flat[0]))
        if np.any(np.abs(place - node) > 1e-9):
            raise InputError(
                f"joints.{point.name}: a cable is joined at a node; bodies.{name} has nodes every "
                f"{rod.length / rod.elements:g} m (change bodies.{name}.elements or the point)"
            )
        shared[node] = point
    for node in range(rod.elements + 1):
        p = rod.length * node / rod.elements
        joint = shared.get(node)
        if joint is not None and joint.where is not None:
            positions.append(joint.where)
        else:
            positions.append(result.new_pair(pose.point(p), pose.point_velocity(p)))
        slopes.append(result.new_pair(pose.direction, 1j * pose.rate * pose.direction))
    return CableFrame(rod.length, tuple(positions), tuple(slopes))
