"""The numbers of a spatial tree as the kernels see them, and the room in which they work.

Row 0 is the ground, body rows follow so that a parent stands before its children. A body's frame is moved
to its joint: origin in the joint, axes those of the joint, turned such that the third is the joint's axis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

FIXED, REVOLUTE, PRISMATIC, SPHERICAL = range(4)
"""Kinds of joints. The coordinates of a spherical one are a unit quaternion, scalar first."""
COORDINATES, RATES = (0, 1, 1, 4), (0, 1, 1, 3)
"""Coordinates and rates of each kind."""


class Tree(NamedTuple):
    """Constant data of a tree; `bodies` rows count the ground as the first.

    parents, kinds, first_q, first_v: row of the parent, kind of joint, its first coordinate and rate, (bodies,)
    offset: joint in the parent's frame [m], (bodies, 3); turn: axes at coordinate zero in it, (bodies, 9)
    mass: [kg], (bodies,); lever: centre of mass [m], (bodies, 3); inertia: about the joint [kg m^2], (bodies, 6)
    damping: torque or force over rate, (rates,); zero for spherical joints
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


def room(tree: Tree) -> Room:
    """Room for one tree."""
    count = len(tree.mass)
    widths = (9, 3, 3, 3, 3, 3, 3, 3, 3, 6, 9, 6, 3, 3, 6, 9, 3)
    room = Room(*(np.zeros((count, width)) for width in widths))
    room.rotation[0] = np.eye(3).ravel()
    room.speed_rate[0] = -tree.gravity
    return room
