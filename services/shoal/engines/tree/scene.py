"""A scene of open rigid chains as a tree of joints, whose coordinates count from its start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.engines.poses import hanging, initial_poses
from shoal.engines.tree.tree import COORDINATES, FIXED, PRISMATIC, RATES, REVOLUTE, SPHERICAL, Tree
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
    """The tree of a scene, and the start of its bodies as the native machine has it. Raises InputError.

    rows: row of the tree of every body; tree: its numbers; q, v: coordinates and rates at the start
    initial: the start of every body as it is used
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._begin, self._axis, self.initial = started(scene)
        links = list(hanging(scene, "tree"))
        self.rows = {GROUND: 0} | {child.body: row for row, (_, _, child) in enumerate(links, start=1)}
        count = len(self.rows)
        # Of the moved frames at the start: their origins, and their axes as columns.
        self._origins, self._axes = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
        parents, kinds = np.zeros(count, dtype=np.int64), np.full(count, FIXED)
        mass, lever, inertia = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
        rates, damping = [np.zeros(0)], [np.zeros(0)]
        for row, (name, parent, child) in enumerate(links, start=1):
            body = scene.bodies[child.body]
            assert not isinstance(body, PointMass)
            where = self._begin[child.body].point(self._place(child))
            kinds[row], axes, rate, friction = self._joint(name, self._begin[parent.body], child.body, where)
            parents[row], self._origins[row], self._axes[row] = self.rows[parent.body], where, axes
            rates.append(rate)
            damping.append(np.full(len(rate), friction))
            mass[row] = body.mass
            lever[row] = self.moved(child.body, np.array(padded(body.centre_of_mass, 3)))
            turn = axes.T @ self._begin[child.body].axes
            arm = lever[row]
            about_centre = turn @ _inertia(body, span(scene)) @ turn.T
            inertia[row] = about_centre + mass[row] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        # Of every joint in the moved frame of the parent.
        back = self._axes[parents].transpose(0, 2, 1)
        offset = np.einsum("nij,nj->ni", back, self._origins - self._origins[parents])
        loads = [self._load(name, load) for name, load in scene.loads.items()]
        first_q, first_v = (np.cumsum([0, *(size[kind] for kind in kinds)])[:-1] for size in (COORDINATES, RATES))
        self.tree = Tree(
            parents,
            kinds,
            first_q,
            first_v,
            offset,
            (back @ self._axes).reshape(count, 9),
            mass,
            lever,
            np.ascontiguousarray(inertia[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]),
            np.concatenate(damping),
            np.array(padded(scene.gravity, 3), dtype=float),
            np.array([row for row, *_ in loads], dtype=np.int64),
            *(np.array([load[k] for load in loads], dtype=float).reshape(-1, 3) for k in (1, 2, 3)),
        )
        self.v = np.concatenate(rates)
        self.q = np.zeros(sum(COORDINATES[kind] for kind in kinds))
        self.q[first_q[kinds == SPHERICAL]] = 1.0

    def moved(self, body: str, place: Array) -> Array:
        """Return a place of a body [m] in its moved frame."""
        row = self.rows[body]
        return np.asarray(self._axes[row].T @ (self._begin[body].point(place) - self._origins[row]))

    def marker(self, at: Attachment) -> Array:
        """Return an attachment [m] in the moved frame of its body."""
        return self.moved(at.body, self._place(at))

    def first_axis(self, body: str) -> Array:
        """Return the direction of a body's x axis in its moved frame."""
        return np.asarray(self._axes[self.rows[body]].T @ self._begin[body].axes[:, 0])

    def _place(self, at: Attachment) -> Array:
        return np.array([float(part) for part in padded(self.scene.location(at), 3)])

    def _joint(self, name: str, parent: BodyStart, child: str, where: Array) -> tuple[int, Array, Array, float]:
        """Kind, axes at the start of which the third is the joint's, rates and friction of the joint at a point."""
        joint, body = self.scene.joints[name], self._begin[child]
        turning, speed = body.spin - parent.spin, body.speed(where) - parent.speed(where)
        if isinstance(joint, Spherical):
            return SPHERICAL, np.eye(3), turning, 0.0
        if isinstance(joint, Revolute):
            axes = _with_third(self._axis(joint.first, joint.axis))
            return REVOLUTE, axes, turning @ axes[:, 2:], joint.friction
        if isinstance(joint, Slider):
            if joint.rotation != "locked":
                raise InputError(f"joints.{name}.rotation: engine tree slides bodies that do not turn; use gauss")
            if joint.axis is None:
                line = np.array([np.cos(joint.direction), np.sin(joint.direction), 0.0])
                axes = _with_third(self._begin[joint.first.body].axes @ line)
            else:
                axes = _with_third(self._axis(joint.first, joint.axis))
            return PRISMATIC, axes, speed @ axes[:, 2:], joint.friction
        return FIXED, np.eye(3), np.zeros(0), 0.0

    def _load(self, name: str, load: Any) -> tuple[int, Array, Array, Array]:
        """Return the row, the place in the moved frame [m], the force [N] and the torque [N m] of a load."""
        row, place, none = self.rows[load.at.body], self.marker(load.at), np.zeros(3)
        if isinstance(load, Force):
            if load.follows:
                raise InputError(f"loads.{name}.follows: engine tree knows forces of fixed direction; use gauss")
            return row, place, float(load.scale.number or 0.0) * np.array(padded(load.force, 3)), none
        assert isinstance(load, Torque)
        if load.reaction is not None and load.reaction.body != GROUND:
            raise InputError(f"loads.{name}.reaction: engine tree knows torques that the ground takes; use gauss")
        axis = np.array(load.axis) / np.linalg.norm(load.axis)
        return row, place, none, float(load.torque.number or 0.0) * axis


THINNEST = 1e-14
"""Of mass times size squared: the least moment of inertia, as the recursion needs one about every axis."""


def _inertia(body: Any, size: float) -> Array:
    """Inertia of a rigid body about its centre of mass [kg m^2], (3, 3); size: of the machine [m]."""
    moments = np.array(second_moments(body), dtype=float)
    return np.asarray((np.trace(moments) + THINNEST * body.mass * size**2) * np.eye(3) - moments)


def _with_third(axis: Array) -> Array:
    """Axes as columns of which the third is a unit vector."""
    other = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(other, axis)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


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
