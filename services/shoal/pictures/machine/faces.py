"""Solid symbols of machines in space as flat faces, counter-clockwise seen from outside, and lines about them."""

from __future__ import annotations

import numpy as np

from shoal.pictures.machine.shapes import joined
from shoal.trajectory import Array

_AROUND = 10


def basis(axis: Array) -> Array:
    """Return unit vectors as rows whose third is along an axis, right-handed, (3, 3)."""
    third = axis / np.linalg.norm(axis)
    helper = np.eye(3)[int(np.argmin(np.abs(third)))]
    first = np.cross(helper, third)
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third])


def about(lines: Array, axis: Array) -> Array:
    """Return lines whose third coordinate points along an axis, (points, 3)."""
    return np.asarray(lines @ basis(axis))


def flat(lines: Array, height: float = 0.0) -> Array:
    """Return lines of the plane at a height above it, (points, 3)."""
    return np.column_stack([lines, np.where(np.isnan(lines[:, 0]), np.nan, height)])


def prism(ring: Array, low: float, high: float) -> Array:
    """Return the faces of a prism along the third coordinate; ring: its section, counter-clockwise, (corners, 2)."""
    lower, upper = flat(ring, low), flat(ring, high)
    after = np.roll(np.arange(len(ring)), -1)
    sides = [np.stack([lower[k], lower[n], upper[n], upper[k], lower[k]]) for k, n in enumerate(after)]
    return joined(*sides, np.concatenate([lower[::-1], lower[-1:]]), np.concatenate([upper, upper[:1]]))


def cylinder(radius: float, low: float, high: float, count: int = _AROUND) -> Array:
    """Return the faces of a cylinder along the third coordinate."""
    angle = 2 * np.pi * np.arange(count) / count
    return prism(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), low, high)


def block(sides: tuple[float, float, float]) -> Array:
    """Return the faces of a cuboid about the origin."""
    a, b, c = (0.5 * side for side in sides)
    return prism(np.array([(a, b), (-a, b), (-a, -b), (a, -b)]), -c, c)


def ball(radius: float) -> Array:
    """Return the faces of a ball about the origin, of ten meridians and six bands."""
    meridian = 2 * np.pi * np.arange(_AROUND + 1) / _AROUND
    height = np.linspace(-np.pi / 2, np.pi / 2, 7)
    places = radius * np.stack(
        [
            np.cos(height)[:, None] * np.cos(meridian),
            np.cos(height)[:, None] * np.sin(meridian),
            np.sin(height)[:, None] * np.ones(_AROUND + 1),
        ],
        axis=2,
    )
    faces = [places[[k, k, k + 1, k + 1, k], [n, n + 1, n + 1, n, n]] for k in range(6) for n in range(_AROUND)]
    return joined(*faces)


def pyramid(u: float) -> tuple[Array, Array]:
    """Return the faces of a foot whose tip is the origin, and the ground under it, along the negative third axis."""
    a, h = 1.1 * u, 2.0 * u
    base = np.array([(a, a, -h), (-a, a, -h), (-a, -a, -h), (a, -a, -h)])
    tip = np.zeros(3)
    sides = [np.stack([base[k], base[(k + 1) % 4], tip, base[k]]) for k in range(4)]
    return joined(*sides, np.concatenate([base[::-1], base[-1:]])), plate(1.7 * u, -h, u)


def plate(half: float, height: float, u: float) -> Array:
    """Return the edge of a square across the third axis with the strokes that mark the ground on it."""
    edge = half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)])
    strokes = []
    for shift in np.arange(-2 * half + 0.4 * u, 2 * half, 0.9 * u):
        low, high = max(-half, shift - half), min(half, shift + half)
        strokes.append(np.array([(low, low - shift), (high, high - shift)]))
    return flat(joined(edge, *strokes), height)
