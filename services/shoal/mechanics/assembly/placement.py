"""Scene -> coordinates: which unknowns exist, how every body hangs on them, and where they start.

Bodies are placed by walking the joints from the ground. A flexible rod brings the vectors of its nodes; a rigid body
(a point and its directors) is expressed by the joint points it has, so that chains stay banded, and brings a director
only if it has too few of them and no joint keeps its angle to a body that has one. What sharing cannot express becomes
a constraint: closed loops, lines that move, distances, driven motion, slopes of welded rods.
"""

from __future__ import annotations

import numpy as np

from shoal.mechanics import joints, plane
from shoal.mechanics.affine import combined, fixed
from shoal.mechanics.assembly.coordinates import Placement, Pose, arm
from shoal.mechanics.assembly.groups import (
    JointPoint,
    Orientations,
    joint_points,
    orientations,
    rotated,
    transposed,
)
from shoal.mechanics.assembly.modal import place_modal
from shoal.mechanics.assembly.phases import make_phases
from shoal.mechanics.assembly.placing import hold, next_body, place_driver, place_point
from shoal.mechanics.assembly.rods import place_rod, rod_axis
from shoal.mechanics.assembly.space.start import place_started
from shoal.mechanics.frames import Place, RigidFrame
from shoal.mechanics.joints import Along, Meet
from shoal.mechanics.modal.modes import bent
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.start.start import started
from shoal.scene import GROUND, PointMass, Rod, Scene
from shoal.scene.signals import continuous_states


def place(scene: Scene) -> Placement:
    """Give every body its coordinates and initial state, and state what they must satisfy. Raises InputError."""
    result = place_started(scene) if scene.dimensions == 3 else _place(scene)
    for name, state in continuous_states(scene).items():
        result.add_state(name, state.start / state.size)
    return result


def _place(scene: Scene) -> Placement:
    """Place the bodies of the plane."""
    stated = scene
    scene, failed = started(scene)
    result = Placement(scene, failed)
    points, turning = joint_points(scene), orientations(scene)
    for name, path in scene.ground_points.items():
        place_driver(name, (path.x, path.y), points, result)
    touching: dict[str, list[JointPoint]] = {name: [] for name in scene.bodies}
    for point in points:
        for owner in {owner for owner, _ in point.places} & touching.keys():
            touching[owner].append(point)
    waiting = list(scene.bodies)
    while waiting:
        name = next_body(stated, waiting, touching, lambda one: _rail(stated, one, result) is not None)
        waiting.remove(name)
        mine = touching[name]
        pose = _pose(scene, name, mine, turning, result)
        result.poses[name] = pose
        body = scene.bodies[name]
        if isinstance(body, PointMass):
            place_point(name, mine, pose, result)
        elif body.element == "modal":
            place_modal(scene, name, mine, pose, result)
        elif isinstance(body, Rod) and body.element != "rigid":
            place_rod(scene, name, body, mine, pose, result)
        else:
            _place_rigid(name, mine, pose, turning, result)
    for point in points:
        if point.line and not point.on_line and point.where is not None:
            joint, base, direction = point.line
            result.terms.cross(joint, fixed(direction), point.where - fixed(base), 1)
    make_phases(scene, result)
    hold(scene, result)
    result.terms.begin(lambda vector: result.start_of(vector)[0])
    return result


def _rail(scene: Scene, name: str, result: Placement) -> tuple[Array, Array, Place] | None:
    """Initial place and velocity of what constraints hold the body to, a line's point or a pin, and its own place."""
    for _, held in joints.of_scene(scene):
        ways = [(held.first, held.second)] if isinstance(held, Along | Meet) else []
        ways += [(held.second, held.first)] if isinstance(held, Meet) else []
        for base, mine in ways:
            if mine.body == name and (base.body == GROUND or base.body in result.frames):
                position, velocity = result.start_of(result.point(scene, base))
                return position, velocity, scene.location(mine)
    return None


def _pose(scene: Scene, name: str, mine: list[JointPoint], turning: Orientations, result: Placement) -> Pose:
    start = scene.start(name)
    root, relative = turning.root(name)
    rate = 0.0 if root == GROUND else start.rate
    rotation = relative if root == GROUND else plane.rotation(start.angle)
    directors = rotation.transpose(1, 0, 2)
    spin = np.stack([rate * plane.quarter(director) for director in directors])
    known = [point for point in mine if point.where is not None]
    if known:
        assert known[0].where is not None
        position, velocity = result.start_of(known[0].where)
        p = known[0].local(name)
    elif start.position is not None:
        position, velocity = plane.vector(*start.position), plane.vector(*start.velocity)
        p = (0.0,) * len(directors)
    elif lines := [point for point in mine if point.line]:
        assert lines[0].line is not None
        position, p = lines[0].line[1], lines[0].local(name)
        velocity = 0.0 * position
    else:
        rail = _rail(scene, name, result)
        assert rail is not None
        position, velocity, p = rail
    body = scene.bodies[name]
    if isinstance(body, Rod) and body.element != "rigid" and body.curvature:
        p = rod_axis(body, p[0])  # on a flexible rod a place is an arc length
    if body.element == "modal" and (known or start.position is None):
        place, rate, _, _ = bent(scene, name, p)
        p, pdot = ((np.real(part), np.imag(part)) for part in (place, rate))
        velocity = velocity - arm(directors, pdot)
    return Pose(position - arm(directors, p), directors, velocity - arm(spin, p), spin)


def _place_rigid(name: str, mine: list[JointPoint], pose: Pose, turning: Orientations, result: Placement) -> None:
    root, relative = turning.root(name)
    ranked = sorted(mine, key=lambda point: (point.where is None, point.line is None))
    anchors = ranked[: 1 if root in turning.directors else 2]
    for point in anchors:
        if point.where is None:
            p = point.local(name)
            result.make(point, pose.point(p), pose.point_velocity(p))
    wheres = [(point.local(name), point.where) for point in anchors if point.where is not None]
    if not wheres:
        wheres = [((0.0,) * len(pose.directors), result.new_vector(pose.position, pose.velocity))]
    (p, where), *second = wheres
    if root not in turning.directors:
        if second:
            apart = plane.vector(*(there - here for here, there in zip(p, second[0][0], strict=True)))
            axis = (second[0][1] - where).turned(plane.aligning(apart))
        else:
            axis = result.new_vector(pose.directors[0], pose.turning[0])
        turning.directors[root] = rotated((axis, axis.turned(plane.QUARTER)), transposed(relative))
        if root not in turning.driven:
            result.terms.dot(name, axis, axis, 0, -1.0)
    directors = turning.of_body(name)
    frame = RigidFrame(where - combined(directors, p), directors)
    result.frames[name] = frame
    for point in ranked:
        if point not in anchors:
            result.share(point, frame.point(point.local(name)))
