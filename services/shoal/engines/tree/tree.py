"""The numbers of a spatial tree as the kernels see them, and the room in which they work.

Row 0 is the ground, body rows follow so that a parent stands before its children. A body's frame is moved
to its joint: origin in the joint, axes those of the joint, turned such that the third is the joint's axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from shoal.engines.tree.description import FREEDOMS, JointFrame, SpatialBody, SpatialChain, SpatialJoint

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

FIXED, REVOLUTE, PRISMATIC, SPHERICAL = range(4)
KINDS = {"fixed": FIXED, "revolute": REVOLUTE, "prismatic": PRISMATIC, "spherical": SPHERICAL}


class Tree(NamedTuple):
    """Constant data of a tree; `bodies` rows count the ground as the first.

    parents, kinds, first_q, first_v: row of the parent, kind of joint, its first coordinate and rate, (bodies,)
    offset: joint in the parent's frame [m], (bodies, 3); turn: axes at coordinate zero in it, (bodies, 9)
    mass: [kg], (bodies,); lever: centre of mass [m], (bodies, 3); inertia: about the joint [kg m^2], (bodies, 6)
    damping: torque or force over rate; drive: applied torque [N m] or force [N], (rates,)
    gravity: [m/s^2], (3,)
    load_body: row; load_place: [m] in its frame, (loads, 3); load_force [N], load_torque [N m], (loads, 3)
    """

    parents: Index
    kinds: Index
    first_q: Index
    first_v: Index
    offset: Array
    turn: Array
    mass: Array
    lever: Array
    inertia: Array
    damping: Array
    drive: Array
    gravity: Array
    load_body: Index
    load_place: Array
    load_force: Array
    load_torque: Array


class Room(NamedTuple):
    """Work space of the recursion, in the axes of the fixed frame; one row per body.

    rotation: of the body's frame, (bodies, 9); position: of its origin [m], (bodies, 3)
    turning, speed: omega [rad/s] and v [m/s]; turning_rate, speed_rate: epsilon and a less gravity, (bodies, 3)
    arm: from the parent's origin [m]; turn_bias, speed_bias: Tdot S + Ddot qdot, (bodies, 3)
    A, B, C: articulated inertia [A, B; B', C], (bodies, 6), (bodies, 9), (bodies, 6)
    torque, force: its bias, (bodies, 3)
    turn_share, speed_share: dependence of qddot on the parent's epsilon and a; of a spherical joint A^-1 and B
    rest: D^-1 times the force that is left for the joint, (bodies, 3)
    """

    rotation: Array
    position: Array
    turning: Array
    speed: Array
    turning_rate: Array
    speed_rate: Array
    arm: Array
    turn_bias: Array
    speed_bias: Array
    A: Array
    B: Array
    C: Array
    torque: Array
    force: Array
    turn_share: Array
    speed_share: Array
    rest: Array


@dataclass(frozen=True)
class ChainModel:
    """A tree with its names and its state at time zero.

    q0: coordinates (spherical joints: unit quaternions, scalar first); v0: rates
    point_bodies: rows; point_places: [m] in the bodies' moved frames, (points, 3)
    body_turns: rotation of the described frame in the moved one, (bodies, 3, 3)
    """

    tree: Tree
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    points: tuple[str, ...]
    q0: Array
    v0: Array
    point_bodies: Index
    point_places: Array
    body_turns: Array

    def coordinates(self, joint: str) -> slice:
        """Return the slice of the coordinates of a joint in q."""
        row = self.joints.index(joint) + 1
        return slice(int(self.tree.first_q[row]), int(self.tree.first_q[row]) + _coordinates(int(self.tree.kinds[row])))

    def rates(self, joint: str) -> slice:
        """Return the slice of the rates of a joint in v."""
        row = self.joints.index(joint) + 1
        return slice(int(self.tree.first_v[row]), int(self.tree.first_v[row]) + _rates(int(self.tree.kinds[row])))


def build(chain: SpatialChain) -> ChainModel:
    """Number the bodies and move their frames into their joints."""
    order = chain.order
    joints = [chain.joints[name] for name in order]
    bodies = [joint.body for joint in joints]
    row = {name: number for number, name in enumerate(["ground", *bodies])}
    count = len(row)
    kinds = np.array([FIXED, *(KINDS[joint.kind] for joint in joints)])
    first_q = np.cumsum([0, *(_coordinates(kind) for kind in kinds)])
    first_v = np.cumsum([0, *(_rates(kind) for kind in kinds)])

    # Of each body: the joint's place in the described frame, and the axes of the moved frame in it.
    places, axes = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    offset, turn = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    mass, lever, inertia = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    for number, joint in enumerate(joints, start=1):
        third = _turn_to(joint)
        places[number] = joint.on_body.position
        axes[number] = _rotation(joint.on_body) @ third
        parent = row[joint.parent]
        offset[number] = axes[parent].T @ (np.array(joint.on_parent.position) - places[parent])
        turn[number] = axes[parent].T @ _rotation(joint.on_parent) @ third
        body = chain.bodies[joint.body]
        mass[number] = body.mass
        lever[number] = axes[number].T @ (np.array(body.centre_of_mass) - places[number])
        inertia[number] = _about_joint(body, axes[number], lever[number])

    def moved(place: tuple[float, float, float], body: str) -> Array:
        moved: Array = axes[row[body]].T @ (np.array(place) - places[row[body]])
        return moved

    loads = list(chain.loads.values())
    damping = [value for joint in joints for value in [joint.damping] * FREEDOMS[joint.kind]]
    drive = [value for joint in joints for value in joint.load or [0.0] * FREEDOMS[joint.kind]]
    tree = Tree(
        np.array([0, *(row[joint.parent] for joint in joints)]),
        kinds,
        first_q[:-1].copy(),
        first_v[:-1].copy(),
        offset,
        turn.reshape(count, 9),
        mass,
        lever,
        np.ascontiguousarray(inertia[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]),
        np.array(damping, dtype=float),
        np.array(drive, dtype=float),
        np.array(chain.gravity, dtype=float),
        np.array([row[load.body] for load in loads], dtype=np.int64),
        np.array([moved(load.position, load.body) for load in loads], dtype=float).reshape(-1, 3),
        np.array([load.force for load in loads], dtype=float).reshape(-1, 3),
        np.array([load.torque for load in loads], dtype=float).reshape(-1, 3),
    )
    q0, v0 = _start(chain, order)
    points = chain.points.values()
    return ChainModel(
        tree,
        order,
        tuple(bodies),
        tuple(chain.points),
        q0,
        v0,
        np.array([row[place.body] for place in points], dtype=np.int64),
        np.array([moved(place.position, place.body) for place in points], dtype=float).reshape(-1, 3),
        np.ascontiguousarray(axes.transpose(0, 2, 1)),
    )


def room(tree: Tree) -> Room:
    """Room for one tree."""
    count = len(tree.mass)
    widths = (9, 3, 3, 3, 3, 3, 3, 3, 3, 6, 9, 6, 3, 3, 6, 9, 3)
    room = Room(*(np.zeros((count, width)) for width in widths))
    room.rotation[0] = np.eye(3).ravel()
    room.speed_rate[0] = -tree.gravity
    return room


def _coordinates(kind: int) -> int:
    return 4 if kind == SPHERICAL else _rates(kind)


def _rates(kind: int) -> int:
    return {FIXED: 0, REVOLUTE: 1, PRISMATIC: 1, SPHERICAL: 3}[kind]


def _rotation(placement: JointFrame) -> Array:
    matrix: Array = Rotation.from_rotvec(placement.rotation).as_matrix()
    return matrix


def _turn_to(joint: SpatialJoint) -> Array:
    """Axes, in the joint's frame, of a frame whose third axis is the joint's; the joint's own without one."""
    if joint.axis is None:
        return np.eye(3)
    # Scaled first: the squares of a tiny or a huge axis would be no numbers.
    third = np.array(joint.axis) / np.max(np.abs(joint.axis))
    third /= np.linalg.norm(third)
    if third[2] == 1.0:
        return np.eye(3)
    other = np.eye(3)[np.argmin(np.abs(third))]
    first = np.cross(other, third)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(third, first), third])


def _about_joint(body: SpatialBody, axes: Array, lever: Array) -> Array:
    """Inertia about the joint [kg m^2] in the moved frame, by Huygens and Steiner."""
    about_centre = axes.T @ np.array(body.inertia) @ axes
    inertia: Array = about_centre + body.mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    return (inertia + inertia.T) / 2


def _start(chain: SpatialChain, order: tuple[str, ...]) -> tuple[Array, Array]:
    q: list[float] = []
    v: list[float] = []
    for name in order:
        freedoms = FREEDOMS[chain.joints[name].kind]
        state = chain.initial.get(name)
        coordinate = (state.coordinate if state else None) or (0.0,) * freedoms
        if chain.joints[name].kind == "spherical":
            q += Rotation.from_rotvec(coordinate).as_quat(scalar_first=True).tolist()
        else:
            q += coordinate
        v += (state.rate if state else None) or (0.0,) * freedoms
    return np.array(q, dtype=float), np.array(v, dtype=float)
