"""-dQ/dq of applied loads that turn with a body, of torques and of drives: blocks (rows, rows by which, values)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.mechanics import forces, plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index

Blocks = list[tuple[Index, Index, Array]]
Strengths = Callable[[Index], Array]
"""Functions of time by number, at one time."""


def in_plane(arrays: Arrays, z: Array, strengths: Strengths) -> Blocks:
    """Return the stiffness of follower forces."""
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
    return blocks


def in_space(arrays: Arrays, z: Array, strengths: Strengths) -> Blocks:
    """Return the stiffness of follower forces, and of torques on rigid bodies and nodes of rods, see `applied`."""
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


def driven(arrays: Arrays, z: Array, number: int, last: float) -> float:
    """Return the coordinate of a drive: the distance, the angle nearest to the last one, or that of a force element."""
    kind, (a, b, d) = _measured(arrays, z, number)
    if kind == forces.DISTANCE:
        return float(np.linalg.norm(b - a))
    if kind == forces.PLACE:
        return float((b - a) @ d / np.linalg.norm(d))
    change = float(plane.angle(b) - plane.angle(a)) - last
    return float(last + change - 2 * np.pi * np.rint(change / (2 * np.pi)))


def of_drives(arrays: Arrays, z: Array, drives: list[tuple[int, float]]) -> Blocks:
    """Return the stiffness of drives: forces [N] or torques [N m] times second derivatives of their coordinates."""
    blocks: Blocks = []
    for number, size in drives:
        kind, (a, b, d) = _measured(arrays, z, number)
        ends = arrays.forces.rows.reshape(-1, 3, len(a))[number]
        if kind == forces.ANGLE:
            for rows, sign in ((ends[0], -1.0), (ends[1], 1.0)):
                x, y = z[rows]
                turn = np.array([[2 * x * y, y * y - x * x], [y * y - x * x, -2 * x * y]]) / (x * x + y * y) ** 2
                blocks.append((rows, rows, -size * sign * turn))
            continue
        line = b - a if kind == forces.DISTANCE else d
        length = np.linalg.norm(line)
        n = line / length
        across = (np.eye(len(n)) - np.outer(n, n)) / length
        if kind == forces.DISTANCE:
            pairs = [(one, other, across if one == other else -across) for one in (0, 1) for other in (0, 1)]
        else:
            way = b - a
            off = (way - n * (way @ n)) / length**2
            bent = -(np.outer(off, n) + np.outer(n, off) + (way @ n) / length * across)
            pairs = [(0, 2, -across), (2, 0, -across), (1, 2, across), (2, 1, across), (2, 2, bent)]
        blocks += [(ends[one], ends[other], -size * block) for one, other, block in pairs]
    return blocks


def _measured(arrays: Arrays, z: Array, number: int) -> tuple[int, Array]:
    """The kind of a force element and its points or directions (a, b, d); see `forces.Forces`."""
    kind, side = int(arrays.forces.kind[number]), forces.side(arrays.forces)
    if kind == forces.ANGLE and side != 3 * plane.DIMENSIONS:
        raise NotImplementedError(
            "nobody says here what a drive about an axis in space does; state it as a torque does"
        )
    return kind, z[arrays.forces.rows[side * number : side * (number + 1)]].reshape(3, -1)
