"""The equations of motion as the paper states them, equations (1) to (10), with dense matrices.

The readable form of what `articulated` computes at linear cost; its tests compare the two. Vectors are in
the axes of the fixed frame, and the connected frame of a body has its origin in the joint to its parent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from shoal.engines.tree.tree import PRISMATIC, RATES, REVOLUTE, SPHERICAL, Array, Tree


@dataclass(frozen=True)
class Equations:
    """M qddot + C qdot = F at one state, equation (10), and what they are made of, for n bodies and f rates.

    M: (f, f); C: (f, f); F: (f,)
    H, H_dot: S = H qdot and its derivative, equation (3), (6 n, f)
    S: [omega; v] of every body [rad/s, m/s], equation (1), (6 n,)
    """

    M: Array
    C: Array
    F: Array
    H: Array
    H_dot: Array
    S: Array


def equations(tree: Tree, q: Array, v: Array) -> Equations:
    """The equations of motion at coordinates q and rates v."""
    n = len(tree.mass) - 1
    H, H_dot = np.zeros((n + 1, 6, len(v))), np.zeros((n + 1, 6, len(v)))
    S = np.zeros((n + 1, 6))
    turns = np.tile(np.eye(3), (n + 1, 1, 1))
    for j in range(1, n + 1):
        i = tree.parents[j]
        own = slice(tree.first_v[j], tree.first_v[j] + RATES[tree.kinds[j]])
        turns[j], arm, D = _joint(tree, j, turns[i], q)
        T = np.block([[np.eye(3), np.zeros((3, 3))], [-tilde(arm), np.eye(3)]])
        S[j] = T @ S[i] + D @ v[own]  # (2)
        # The arm turns with the parent and grows with a slide; D turns with the parent.
        omega, slide = S[i, :3], (D @ v[own])[3:]
        T_dot = np.zeros((6, 6))
        T_dot[3:, :3] = -tilde(np.cross(omega, arm) + slide)
        D_dot = np.concatenate([np.cross(omega, D[:3], axisb=0, axisc=0), np.cross(omega, D[3:], axisb=0, axisc=0)])
        if tree.kinds[j] == SPHERICAL:
            # Its axes turn with the body itself, which changes nothing in D_dot qdot.
            D_dot[:3] = np.cross(S[j, :3], D[:3], axisb=0, axisc=0)
        H[j], H_dot[j] = T @ H[i], T @ H_dot[i] + T_dot @ H[i]  # (3)
        H[j][:, own] += D
        H_dot[j][:, own] += D_dot

    M, C = np.zeros((len(v), len(v))), np.zeros((len(v), len(v)))
    F: Array = -tree.damping * v
    for j in range(1, n + 1):
        lever = turns[j] @ tree.lever[j]
        R, omega = _inertia(tree, j, turns[j], lever), S[j, :3]
        W = np.kron(np.eye(2), tilde(omega))
        E = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        weight = tree.mass[j] * tree.gravity
        Q = np.concatenate([np.cross(lever, weight), weight])
        for load in np.flatnonzero(tree.load_body == j):
            force, place = tree.load_force[load], turns[j] @ tree.load_place[load]
            Q += np.concatenate([tree.load_torque[load] + np.cross(place, force), force])
        M += H[j].T @ R @ H[j]  # (8)
        C += H[j].T @ (R @ H_dot[j] + W @ R @ E @ H[j])
        F += H[j].T @ Q
    return Equations(M, C, F, H[1:].reshape(6 * n, -1), H_dot[1:].reshape(6 * n, -1), S[1:].ravel())


def accelerations(tree: Tree, q: Array, v: Array) -> Array:
    """qddot = M^-1 (F - C qdot), at cubic cost."""
    e = equations(tree, q, v)
    return np.asarray(np.linalg.solve(e.M, e.F - e.C @ v), dtype=np.float64)


def tilde(a: Array) -> Array:
    """The matrix that multiplies b to a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _joint(tree: Tree, j: int, carrier: Array, q: Array) -> tuple[Array, Array, Array]:
    """Axes of body j, its origin from that of its parent [m], and D_j; carrier: axes of the parent."""
    arm = carrier @ tree.offset[j]
    turn = carrier @ tree.turn[j].reshape(3, 3)
    first = tree.first_q[j]
    if tree.kinds[j] == REVOLUTE:
        turn = turn @ Rotation.from_rotvec([0.0, 0.0, q[first]]).as_matrix()
        return turn, arm, np.concatenate([turn[:, 2:], np.zeros((3, 1))])
    if tree.kinds[j] == PRISMATIC:
        return turn, arm + q[first] * turn[:, 2], np.concatenate([np.zeros((3, 1)), turn[:, 2:]])
    if tree.kinds[j] == SPHERICAL:
        turn = turn @ Rotation.from_quat(q[first : first + 4], scalar_first=True).as_matrix()
        return turn, arm, np.concatenate([turn, np.zeros((3, 3))])
    return turn, arm, np.zeros((6, 0))


def _inertia(tree: Tree, j: int, turn: Array, lever: Array) -> Array:
    """R of one body: the integral of (5) over its volume, about its origin."""
    xx, xy, xz, yy, yz, zz = tree.inertia[j]
    about_origin = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    moment = tree.mass[j] * tilde(lever)
    return np.block([[about_origin, moment], [moment.T, tree.mass[j] * np.eye(3)]])
