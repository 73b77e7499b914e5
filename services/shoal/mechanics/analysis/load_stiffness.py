"""-dQ/dq of applied loads that turn with a body, and of torques: blocks (rows, rows by which, values)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.mechanics import forces
from shoal.mechanics import rotation as turns
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index

Blocks = list[tuple[Index, Index, Array]]
Strengths = Callable[[Index], Array]
"""Functions of time by number, at one time."""


def in_plane(arrays: Arrays, z: Array, strengths: Strengths, torques: list[tuple[int, float]]) -> Blocks:
    """Of forces that follow, and of motors: (force element, torque [N m])."""
    applied, blocks = arrays.applied, []
    strength = strengths(applied.following_function)
    for k in range(applied.following):
        rows = applied.rows[4 * k : 4 * k + 4]
        dx, dy = z[rows[2:]]
        size = np.hypot(dx, dy)
        fx, fy = applied.factor[2 * k : 2 * k + 2] * strength[k]
        # d/dd of R d/|d| with R = [[fx, -fy], [fy, fx]]: R (I - n n')/|d|
        normal = np.array([[dy * dy, -dx * dy], [-dx * dy, dx * dx]]) / size**3
        blocks.append((rows[:2], rows[2:], -np.array([[fx, -fy], [fy, fx]]) @ normal))
    pairs = arrays.forces.rows.reshape(-1, forces.side(arrays.forces))
    for k, torque in torques:
        for rows, sign in ((pairs[k, :2], -1.0), (pairs[k, 2:4], 1.0)):
            x, y = z[rows]
            square = (x * x + y * y) ** 2
            # The second derivatives of atan2(y, x).
            turn = np.array([[2 * x * y, y * y - x * x], [y * y - x * x, -2 * x * y]]) / square
            blocks.append((rows, rows, -torque * sign * turn))
    return blocks


def in_space(arrays: Arrays, z: Array, strengths: Strengths) -> Blocks:
    """Of forces that follow, and of torques on rigid bodies and on nodes of rods, as `applied` states them."""
    applied = arrays.applied
    blocks: Blocks = []
    strength = strengths(applied.following_function)
    for k in range(applied.following):
        rows = applied.rows[12 * k : 12 * k + 12]
        for j in range(3):
            size = strength[k] * applied.factor[3 * k + j]
            blocks.append((rows[:3], rows[3 + 3 * j : 6 + 3 * j], -size * np.eye(3)))
    strength = 0.5 * applied.share * strengths(applied.turning_function)
    for k in range(applied.turning):
        rows = applied.turned[12 * k : 12 * k + 12]
        for j in range(1, 4):
            here = rows[3 * j : 3 * j + 3]
            blocks.append((here, here, -strength[k] * turns.skew(z[rows[:3]])))
            blocks.append((here, rows[:3], strength[k] * turns.skew(z[here])))
    strength = applied.share * strengths(applied.twisting_function)
    for k in range(applied.twisting):
        rows = applied.twisted[9 * k : 9 * k + 9].reshape(3, 3)
        n, s, d = z[rows]
        square, along = s @ s, n @ s
        across, normal = np.cross(n, s), np.cross(s, d)
        parts = (
            (1, 1, turns.skew(n) - 2.0 * np.outer(across, s) / square),
            (1, 0, -turns.skew(s)),
            (2, 2, along * turns.skew(s)),
            (2, 1, np.outer(normal, n) - along * turns.skew(d) - 2.0 * along * np.outer(normal, s) / square),
            (2, 0, np.outer(normal, s)),
        )
        blocks += [(rows[to], rows[by], -strength[k] / square * block) for to, by, block in parts]
    return blocks
