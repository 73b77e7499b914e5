"""Scene -> coordinates in space: bodies by shared points and axes, with a constant mass matrix (natural coordinates).

Bodies are placed one after the other from the ground. A rigid body takes its three directors from what it shares with
its joints: ways between joint points and joint axes that exist already, then those that it makes for its neighbours,
then vectors of its own; that their products stay is stated as constraints. A body whose axis rests on the ground has
two numbers for its direction, as in the plane. What sharing cannot express becomes a constraint.
Garcia de Jalon and Bayo, Kinematic and dynamic simulation of multibody systems, 1994.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from shoal.mechanics import joints, reach
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.assembly.coordinates import Pose, arm
from shoal.mechanics.assembly.groups import JointPoint, is_stiff, rotated, transposed
from shoal.mechanics.assembly.phases import make_phases
from shoal.mechanics.assembly.placing import hold, next_body, place_driver, place_point
from shoal.mechanics.assembly.space.axes import JointAxis
from shoal.mechanics.assembly.space.bushings import make_turns
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.hinges import make_axes
from shoal.mechanics.assembly.space.rod_joints import hold_rod
from shoal.mechanics.assembly.space.rods import place_rod
from shoal.mechanics.assembly.space.sections import material
from shoal.mechanics.frames import Place, RigidFrame
from shoal.mechanics.joints import Aligned, Along, InPlane, Meet, Square, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Attachment, PointMass, Rod, Scene

APART = 0.3
"""Sine of the angle between a vector and the span of those chosen before it, from which it is chosen too."""


def place_in_space(scene: Scene, poses: Mapping[str, tuple[Array, Array]] | None = None) -> SpatialPlacement:
    """Give every body its coordinates and a state that joints need not agree with yet. Raises InputError.

    poses: places [m], (3, lanes), and axes as columns, (3, 3, lanes), of bodies, by default along the joints. Axes of
    joints are those of the stated attitudes
    """
    result = SpatialPlacement(scene)
    for name, path in scene.ground_points.items():
        place_driver(name, (path.x, path.y, path.z), result.points, result)
    touching = {name: [point for point in result.points if point.touches(name)] for name in scene.bodies}
    waiting = list(scene.bodies)
    while waiting:
        name = next_body(scene, waiting, touching, lambda one: next(_guides(scene, one, result), None) is not None)
        waiting.remove(name)
        pose = _pose(scene, name, touching[name], result, poses)
        result.poses[name] = pose
        body = scene.bodies[name]
        if isinstance(body, PointMass):
            place_point(name, touching[name], pose, result)
        elif isinstance(body, Rod) and body.element != "rigid":
            place_rod(scene, name, body, touching[name], pose, result)
        else:
            _place_rigid(name, touching[name], pose, result)
    for point in result.points:
        if point.line and not point.on_line and point.where is not None:
            joint, base, direction = point.line
            for normal in turns.across(direction):
                result.terms.dot(joint, fixed(normal), point.where - fixed(base), 1)
    make_phases(scene, result)
    make_turns(scene, result)
    hold(scene, result)
    for joint, condition in joints.of_scene(scene):
        sides_of_rods = isinstance(condition, Aligned | Turned | Square) and not all(
            is_stiff(scene, side.body) for side in (condition.first, condition.second)
        )
        if sides_of_rods and joint not in result.held:
            hold_rod(scene, joint, condition, result)
    make_axes(scene, result)
    result.terms.settle(reach.span(scene))
    return result


def _pose(
    scene: Scene,
    name: str,
    mine: list[JointPoint],
    result: SpatialPlacement,
    poses: Mapping[str, tuple[Array, Array]] | None,
) -> Pose:
    rotation, spin = result.attitudes.rotation(name), result.attitudes.spin(name)
    if poses is not None:
        rotation = poses[name][1]
    directors = rotation.transpose(1, 0, 2)
    turning = np.stack([turns.cross(spin, director) for director in directors])
    start = scene.start(name)
    known = [point for point in mine if point.where is not None]
    p: Place = (0.0, 0.0, 0.0)
    if known:
        assert known[0].where is not None
        position, velocity = result.start_of(known[0].where)
        p = known[0].local(name)
    elif start.position is not None:
        position, velocity = vector(*start.position), vector(*start.velocity)
    elif lines := [point for point in mine if point.line]:
        assert lines[0].line is not None
        position, p = lines[0].line[1], lines[0].local(name)
        velocity = 0.0 * position
    else:
        position, velocity, p = _rail(scene, name, result)
    p = material(scene, name, p)
    origin = position - arm(directors, p) if poses is None else poses[name][0]
    return Pose(origin, directors, velocity - arm(turning, p), turning)


def _rail(scene: Scene, name: str, result: SpatialPlacement) -> tuple[Array, Array, Place]:
    """Initial place and velocity of what leads a body, and the body's place there."""
    for here, there in _guides(scene, name, result):
        return *result.start_of(result.point(scene, here)), scene.location(there)
    return np.zeros((3, 1)), np.zeros((3, 1)), (0.0, 0.0, 0.0)


def _guides(scene: Scene, name: str, result: SpatialPlacement) -> Iterator[tuple[Attachment, Attachment]]:
    """Places that lead a body, and its own there: base points of lines and planes, and places that constraints join."""
    for _, guide in joints.of_scene(scene):
        if not isinstance(guide, Along | InPlane) and not (isinstance(guide, Meet) and guide.held):
            continue
        for here, there in ((guide.first, guide.second), (guide.second, guide.first)):
            known = here.body in result.frames or (isinstance(guide, Meet) and here.body == GROUND)
            if there.body == name and known and (isinstance(guide, Meet) or here is guide.first):
                yield here, there


def _place_rigid(name: str, mine: list[JointPoint], pose: Pose, result: SpatialPlacement) -> None:
    kept = result.attitudes.kept
    root, relative = kept.root(name)
    axes = [axis for axis in result.axes if axis.touches(name)]
    anchor = min(mine, key=lambda point: (point.where is None, point.line is None), default=None)
    p: Place = (0.0, 0.0, 0.0) if anchor is None else anchor.local(name)
    if anchor is None:
        where = result.new_vector(pose.position, pose.velocity)
    else:
        where = anchor.where or result.make(anchor, pose.point(p), pose.point_velocity(p))
    others = [point for point in mine if point is not anchor]
    if root not in kept.directors:
        hinge = next((axis for axis in axes if axis.where is not None and not axis.where.terms), None)
        body = _DirectorVectors(name, pose, where, p, result)
        own = body.free(axes, others) if hinge is None else body.hinged(hinge, others)
        kept.directors[root] = rotated(own, transposed(relative))
    directors = kept.of_body(name)
    frame = RigidFrame(where - combined(directors, p), directors)
    result.frames[name] = frame
    for point in others:
        if (name, id(point)) not in result.chosen:
            result.share(point, frame.point(point.local(name)))
    for axis in axes:
        image = axis.local(name)
        if axis.where is None:
            axis.where = combined(directors, tuple(image))
        elif name not in axis.holders and not (root == GROUND and not axis.where.terms):
            for normal in turns.across(image):
                result.terms.dot(axis.name, combined(directors, tuple(normal)), axis.where, 0)
        axis.holders.add(name)


class _DirectorVectors:
    """The directors of one body from vectors that it shares or makes."""

    def __init__(self, name: str, pose: Pose, where: Affine, p: Place, result: SpatialPlacement) -> None:
        self.name, self.pose, self.where, self.result = name, pose, where, result
        self.p = vector(*p)

    def _away(self, point: JointPoint) -> Array:
        """The way from the anchor to another place in the body's frame [m], (3, lanes)."""
        return vector(*point.local(self.name)) - self.p

    def hinged(self, axis: JointAxis, others: list[JointPoint]) -> tuple[Affine, ...]:
        """Return the vectors of a body that turns about a fixed axis: one direction at right angles defines all."""
        name, result = self.name, self.result
        assert axis.where is not None
        normal, image = axis.where.constant, axis.local(name)
        axis.holders.add(name)
        onto = normal[:, None] * normal[None]
        quarter = turns.skew(normal)
        level = self.where.turned(onto).rests
        for point in sorted(others, key=lambda point: point.where is None):
            away = self._away(point)
            height = np.sum(away * image, axis=0)
            flat = away - image * height
            width = np.sqrt(np.sum(flat**2, axis=0))
            if np.any(width < 1e-6 * np.sqrt(np.sum(away**2, axis=0)) + 1e-300):
                continue
            place = tuple(point.local(name))
            if point.where is None:
                if not level or point.line is not None:
                    continue
                base = normal * np.sum(normal * self.pose.point(place), axis=0)
                rest = self.pose.point(place) - base
                one, other = turns.across(normal)
                speed = self.pose.point_velocity(place)
                point.where = fixed(base) + result.new_along(0.0 * one, one, rest, speed)
                point.where = point.where + result.new_along(0.0 * other, other, rest, speed)
            gap = point.where - self.where
            risen = gap.turned(onto)
            if not risen.rests:
                result.terms.dot(name, fixed(normal), gap, 1, -height)
            result.chosen.add((name, id(point)))
            first_image = flat / width
            first = (gap - risen) * (1.0 / width)
            break
        else:
            first_image, _ = turns.across(image)
            start, rate = arm(self.pose.directors, tuple(first_image)), arm(self.pose.turning, tuple(first_image))
            one, other = turns.across(normal)
            first = result.new_along(0.0 * one, one, start, rate) + result.new_along(0.0 * other, other, start, rate)
        if first.terms and not result.is_turned_by_ground(name):
            result.terms.dot(name, first, first, 0, -1.0)
        basis = [first, first.turned(quarter), fixed(normal)]
        images = np.stack(np.broadcast_arrays(first_image, turns.cross(image, first_image), image))
        return tuple(combined(tuple(basis), tuple(images[:, k])) for k in range(3))

    def free(self, axes: list[JointAxis], others: list[JointPoint]) -> tuple[Affine, ...]:
        """Return the vectors of any other body: three whose products are constrained."""
        name, result = self.name, self.result
        chosen: list[_Chosen] = []
        for known in (True, False):
            for axis in axes:
                image = axis.local(name)
                if (axis.where is not None) == known and _independent(image, chosen):
                    if axis.where is None:
                        axis.where = self._new(image)
                        result.terms.dot(name, axis.where, axis.where, 0, -1.0)
                    chosen.append(_Chosen(image, axis.where, 0, axis))
            for point in others:
                away = self._away(point)
                if (point.where is not None) == known and point.line is None and _independent(away, chosen):
                    if point.where is None:
                        at = point.local(name)
                        point.where = result.make(point, self.pose.point(at), self.pose.point_velocity(at))
                    result.chosen.add((name, id(point)))
                    chosen.append(_Chosen(away, point.where - self.where, 1, None))
        while len(chosen) < 3:
            image = _completing([one.image for one in chosen])
            chosen.append(_Chosen(image, self._new(image), 0, None))
        for one, other in combinations_with_replacement(chosen, 2):
            if not (_is_kept(one, other) or not (one.where.terms or other.where.terms)):
                product = np.sum(one.image * other.image, axis=0)
                result.terms.dot(name, one.where, other.where, one.lengths + other.lengths, -product)
        for one in chosen:
            if one.axis is not None:
                one.axis.holders.add(name)
        images = np.stack(np.broadcast_arrays(*(one.image for one in chosen)), 1)
        weights = np.linalg.inv(images.transpose(2, 0, 1)).transpose(1, 2, 0)
        vectors = tuple(one.where for one in chosen)
        return tuple(combined(vectors, tuple(weights[:, k])) for k in range(3))

    def _new(self, image: Array) -> Affine:
        """A vector of its own for a direction of the body."""
        return self.result.new_vector(arm(self.pose.directors, tuple(image)), arm(self.pose.turning, tuple(image)))


@dataclass(frozen=True)
class _Chosen:
    """A vector that defines the rotation of a body; image: in the body's frame; lengths: its power of a length."""

    image: Array
    where: Affine
    lengths: int
    axis: JointAxis | None


def _independent(image: Array, chosen: list[_Chosen]) -> bool:
    """Return whether a vector is far enough from the span of those chosen, which are fewer than three."""
    size = np.sqrt(np.sum(image**2, axis=0))
    if len(chosen) == 3 or np.any(size == 0.0):
        return False
    rest = image / size
    span: list[Array] = []
    for one in chosen:
        direction = one.image
        for known in span:
            direction = direction - known * np.sum(known * direction, axis=0)
        span.append(turns.unit(direction))
        rest = rest - span[-1] * np.sum(span[-1] * rest, axis=0)
    return bool(np.all(np.sum(rest**2, axis=0) > APART**2))


def _is_kept(one: _Chosen, other: _Chosen) -> bool:
    """Return whether a product of axes is kept already: their length by who made them, their angle by a body that has
    both.
    """
    if one.axis is None or other.axis is None:
        return False
    return one.axis is other.axis or bool(one.axis.holders & other.axis.holders)


def _completing(images: list[Array]) -> Array:
    """A unit vector at right angles to one or two vectors, or any, (3, lanes)."""
    if not images:
        return vector(1.0, 0.0, 0.0)
    if len(images) == 1:
        return turns.across(turns.unit(images[0]))[0]
    return turns.unit(turns.cross(images[0], images[1]))
