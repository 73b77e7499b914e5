"""A scene of open rigid chains as a tree of joints, whose coordinates count from its start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.engines.poses import initial_poses
from shoal.engines.tree.description import (
    JointFrame,
    JointState,
    Load,
    Place,
    SpatialBody,
    SpatialChain,
    SpatialJoint,
    Vector3,
)
from shoal.errors import InputError
from shoal.mechanics.assembly.masses import second_moments
from shoal.mechanics.assembly.space.start import place_started
from shoal.mechanics.numerics.tile import stacked
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import body_states
from shoal.scene import GROUND, Attachment, Force, InitialState, PointMass, Revolute, Scene, Slider, Spherical, Torque
from shoal.scene.dimensions import padded
from shoal.trajectory import Array


@dataclass(frozen=True)
class BodyStart:
    """Origin [m], axes as columns, velocity [m/s] and spin [rad/s] of a body at the start, (3,), (3, 3), (3,), (3,)."""

    origin: Array
    axes: Array
    velocity: Array
    spin: Array

    def point(self, place: Array) -> Array:
        """Return the position of a point of the body [m]."""
        return self.origin + self.axes @ place

    def speed(self, point: Array) -> Array:
        """Velocity [m/s] of what of the body is at a point."""
        return self.velocity + np.cross(self.spin, point - self.origin)

    def back(self, point: Array) -> Array:
        """The place of the body that is at a point [m]."""
        return np.asarray(self.axes.T @ (point - self.origin))


class SceneTree:
    """The tree of a scene, and the start of its bodies as the native machine has it.

    chain: bodies in their scene's frames; joints' frames are turned as the ground's at the start. Raises InputError.
    initial: the start of every body as it is used
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._begin, self._axis, self.initial = started(scene)
        joints: dict[str, Any] = {}
        states: dict[str, Any] = {}
        for name, parent, child in _links(scene):
            joints[name], states[name] = self._joint(name, parent, child)
        self.chain = SpatialChain(
            name=scene.name,
            gravity=padded(scene.gravity, 3),
            bodies={name: _body(body, span(scene)) for name, body in scene.bodies.items()},
            joints=joints,
            points={name: Place(body=at.body, position=self._place(at)) for name, at in scene.markers.items()},
            loads={name: self._load(name, load) for name, load in scene.loads.items()},
            initial=states,
        )

    def _place(self, at: Attachment) -> Vector3:
        x, y, z = (float(part) for part in padded(self.scene.location(at), 3))
        return x, y, z

    def _joint(self, name: str, parent: Attachment, child: Attachment) -> tuple[SpatialJoint, JointState]:
        joint = self.scene.joints[name]
        one, other = self._begin[parent.body], self._begin[child.body]
        where = other.point(np.array(self._place(child)))
        frames = [
            JointFrame(position=tuple(side.back(where)), rotation=tuple(Rotation.from_matrix(side.axes.T).as_rotvec()))
            for side in (one, other)
        ]
        turning, speed = other.spin - one.spin, other.speed(where) - one.speed(where)
        kind, axis, rate, damping = "fixed", None, None, 0.0
        if isinstance(joint, Spherical):
            kind, rate = "spherical", tuple(turning)
        elif isinstance(joint, Revolute):
            direction = self._axis(joint.first, joint.axis)
            kind, axis, rate, damping = "revolute", tuple(direction), (float(turning @ direction),), joint.friction
        elif isinstance(joint, Slider):
            if joint.rotation != "locked":
                raise InputError(f"joints.{name}.rotation: engine tree slides bodies that do not turn; use gauss")
            along = joint.axis
            if along is None:
                line = np.array([np.cos(joint.direction), np.sin(joint.direction), 0.0])
                direction = self._begin[joint.first.body].axes @ line
            else:
                direction = self._axis(joint.first, along)
            kind, axis, rate, damping = "prismatic", tuple(direction), (float(speed @ direction),), joint.friction
        made = SpatialJoint.model_validate(
            {"body": child.body, "parent": parent.body, "kind": kind, "axis": axis, "damping": damping,
             "on_parent": frames[0], "on_body": frames[1]}
        )  # fmt: skip
        return made, JointState(rate=rate)

    def _load(self, name: str, load: Any) -> Load:
        if isinstance(load, Force):
            if load.follows:
                raise InputError(f"loads.{name}.follows: engine tree knows forces of fixed direction; use gauss")
            scale = float(load.scale.number or 0.0)
            force = tuple(scale * float(part) for part in padded(load.force, 3))
            return Load(body=load.at.body, position=self._place(load.at), force=force)
        assert isinstance(load, Torque)
        if load.reaction is not None and load.reaction.body != GROUND:
            raise InputError(f"loads.{name}.reaction: engine tree knows torques that the ground takes; use gauss")
        axis = np.array(load.axis) / np.linalg.norm(load.axis)
        return Load(body=load.at.body, torque=tuple(float(load.torque.number or 0.0) * axis))


THINNEST = 1e-14
"""Of mass times size squared: the least moment of inertia, as the recursion needs one about every axis."""


def _body(body: Any, size: float) -> SpatialBody:
    """Mass, inertia and centre of a rigid body, in its frame; size: of the machine [m]."""
    assert not isinstance(body, PointMass)
    moments = np.array(second_moments(body), dtype=float)
    inertia = np.trace(moments) * np.eye(3) - moments + THINNEST * body.mass * size**2 * np.eye(3)
    return SpatialBody.model_validate(
        {"mass": body.mass, "inertia": inertia.tolist(), "centre_of_mass": padded(body.centre_of_mass, 3)}
    )


def started(scene: Scene) -> tuple[dict[str, BodyStart], Any, dict[str, InitialState]]:
    """Return the start of every body, and a function for the direction of a stated joint axis at the start."""
    still = BodyStart(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))
    found = {GROUND: still}
    if scene.dimensions == 2:
        initial = {}
        for name, pose in initial_poses(scene).items():
            axes = Rotation.from_rotvec([0.0, 0.0, pose.angle]).as_matrix()
            origin, velocity = np.array([*pose.origin, 0.0]), np.array([*pose.velocity, 0.0])
            found[name] = BodyStart(origin, axes, velocity, np.array([0.0, 0.0, pose.rate]))
            if name != GROUND:
                initial[name] = InitialState(
                    angle=pose.angle, rate=pose.rate, position=tuple(pose.origin), velocity=tuple(pose.velocity)
                )
        return found, lambda side, axis: np.array([0.0, 0.0, 1.0]), initial
    placement = place_started(scene)
    q, v = stacked(placement.positions)[:, 0], stacked(placement.velocities)[:, 0]
    initial = body_states(placement.frames, scene, q, v)
    for name, begin in initial.items():
        axes = Rotation.from_rotvec(begin.rotation or (0.0, 0.0, 0.0)).as_matrix()
        parts = (np.array(part, dtype=float) for part in (begin.position, begin.velocity, begin.spin or (0, 0, 0)))
        origin, velocity, spin = parts
        found[name] = BodyStart(origin, axes, velocity, spin)

    def pointing(side: Attachment, axis: Any) -> Array:
        return np.asarray(found[side.body].axes @ placement.attitudes.image(side.body, axis)[:, 0])

    return found, pointing, initial


def _links(scene: Scene) -> list[tuple[str, Attachment, Attachment]]:
    """Joints from the ground outwards, each with its places on the parent and on the child. Raises InputError."""
    reached, waiting, found = {GROUND}, dict(scene.joints), []
    while waiting:
        before = len(waiting)
        for name, joint in list(waiting.items()):
            first, second = joint.first, joint.second  # type: ignore[union-attr]
            if (first.body in reached) == (second.body in reached):
                continue
            parent, child = (first, second) if first.body in reached else (second, first)
            waiting.pop(name)
            reached.add(child.body)
            found.append((name, parent, child))
        if len(waiting) == before:
            break
    for name in scene.bodies:
        if name not in reached:
            raise InputError(f"bodies.{name}: engine tree needs a chain of joints from the ground; use gauss")
    return found
