"""Polygons: corners in the order in which the free side is on the right, counter-clockwise of a solid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
STRAIGHT = 1e-12
"""Sine of the turn at a corner that is none: some thousand times round-off."""


def cross(a: Array, b: Array) -> Array:
    """Return the vector product of vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def corners_of(points: Sequence[Sequence[float]]) -> Array:
    """Return the corners of a polygon, (corners, 2), without points on its edges."""
    found = np.array(points, dtype=float)
    before, after = found - np.roll(found, 1, axis=0), np.roll(found, -1, axis=0) - found
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray(found[(np.abs(cross(before, after)) > STRAIGHT * sizes) | (np.sum(before * after, axis=1) < 0.0)])


def check_polygon(points: Sequence[Sequence[float]]) -> None:
    """Raises ValueError where points are no corners of a polygon whose edges do not meet."""
    if len(points) < 3:
        raise ValueError(f"polygon: has at least three corners, found {len(points)}")
    begin = np.array(points, dtype=float)
    end = np.roll(begin, -1, axis=0)
    for twice in np.flatnonzero(np.all(begin == end, axis=1)):
        raise ValueError(f"polygon.{twice}: [{begin[twice, 0]:g}, {begin[twice, 1]:g}] is there twice in a row")
    for k, (one, other) in enumerate(zip(begin, end, strict=True)):
        for j in range(k + 1, len(begin)):
            way, its, off = other - one, end[j] - begin[j], begin[j] - one
            beside = j == k + 1 or (k == 0 and j == len(begin) - 1)
            turned, scale = cross(way, its), np.linalg.norm(way) * np.linalg.norm(its)
            if beside and abs(turned) <= STRAIGHT * scale and way @ its < 0.0:
                raise ValueError(f"polygon.{k if j > k + 1 else j}: the edges that meet there lie on each other")
            if beside or abs(turned) <= STRAIGHT * scale:
                continue
            share, other_share = cross(off, its) / turned, cross(off, way) / turned
            if -STRAIGHT <= share <= 1.0 + STRAIGHT and -STRAIGHT <= other_share <= 1.0 + STRAIGHT:
                raise ValueError(f"polygon: the edges that begin at corners {k} and {j} meet")
    if len(corners_of(points)) < 3:
        raise ValueError("polygon: its corners lie on one line")


def is_concave(corners: Array) -> npt.NDArray[np.bool_]:
    """Return at which corners the free side is less than half a turn wide, (corners,)."""
    return cross(corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners) < 0.0


def distance(corners: Array, point: Array) -> Array:
    """Return how far points (2, lanes) are from a polygon, negative on the side that is not free, (lanes,)."""
    nearest, inside = np.full(point.shape[1], np.inf), np.zeros(point.shape[1], dtype=bool)
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        way, off = other - one, point.T - one
        share = np.clip(off @ way / (way @ way), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(off - share[:, None] * way, axis=1))
        height = (point[1] - one[1]) * (other[1] - one[1])
        spans = (height >= 0.0) & (np.abs(point[1] - one[1]) < np.abs(other[1] - one[1]))
        inside ^= spans & (cross(np.broadcast_to(way, off.shape), off) * (other[1] - one[1]) > 0.0)
    around = np.sum(cross(corners, np.roll(corners, -1, axis=0)))
    return np.asarray(np.where(inside == (around > 0.0), -1.0, 1.0) * nearest)
