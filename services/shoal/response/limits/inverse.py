"""Inverse FORM: the least margin at a given distance from the origin of the standard normal space.

Der Kiureghian, Zhang and Li, Inverse reliability problem, Journal of Engineering Mechanics 120, 1994; the performance
measure of Tu, Choi and Park, A new study on reliability-based design optimization, Journal of Mechanical Design 121,
1999. A limit that no values pass has no design point, but it has such a place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.response.limits.form import ITERATIONS, SHARES, STRAIGHT, gradients, meet
from shoal.response.limits.margins import Margins, least
from shoal.trajectory import Array

STARTS = 6
"""Searches, beside the one that begins along the slope at the origin."""


@dataclass(frozen=True)
class Nearest:
    """Most probable point at a given reliability index: the least margin there; for a negative index the largest.

    place: in the standard normal space, (parameters,); normal: the unit vector of steepest descent of the margin there,
    0 where nothing changes it; slope: by how much it falls per standard deviation; margin: there; instant: that
    decides, its index
    """

    place: Array
    normal: Array
    slope: float
    margin: float
    instant: int


def nearest(margins: Margins, distance: float, seed: int) -> Nearest:
    """distance [standard deviations]. The margin is infinite if all runs fail. Raises InputError, TooManyRunsError."""
    origin = np.zeros((1, len(margins.inputs)))
    directions = np.random.default_rng(seed).standard_normal((STARTS, len(margins.inputs)))
    directions = np.concatenate([-gradients(margins, origin, margins(origin)), directions])
    directions = directions[np.any(directions, axis=1)]
    side = -1.0 if distance < 0 else 1.0
    u = _at(abs(distance), side * directions)
    rows = margins(u)
    g = least(rows)
    active = np.isfinite(g)
    for _ in range(ITERATIONS):
        moving = np.flatnonzero(active)
        if not moving.size:
            break
        wanted = distance * _normals(gradients(margins, u[moving], rows[moving]))
        away = np.linalg.norm(wanted - u[moving], axis=1) > STRAIGHT * max(1.0, abs(distance))
        active[moving] = away & np.any(wanted, axis=1)
        moving, wanted = moving[active[moving]], wanted[active[moving]]
        if not moving.size:
            break
        tried = _at(abs(distance), u[moving, None] + np.array(SHARES)[:, None] * (wanted - u[moving])[:, None])
        found = margins(tried.reshape(-1, u.shape[1])).reshape(*tried.shape[:2], -1)
        value = least(found.reshape(-1, found.shape[2])).reshape(tried.shape[:2])
        best = np.where(np.isfinite(value), side * value, np.inf).argmin(axis=1)
        each = np.arange(len(moving))
        better = side * value[each, best] < side * g[moving]
        active[moving[~better]] = False
        moving, each, best = moving[better], each[better], best[better]
        u[moving], g[moving], rows[moving] = tried[each, best], value[each, best], found[each, best]
        meet(u, active)
    k = int(np.where(np.isfinite(g), side * g, np.inf).argmin())
    slope = gradients(margins, u[k : k + 1], rows[k : k + 1])
    return Nearest(u[k], _normals(slope)[0], float(np.linalg.norm(slope)), float(g[k]), int(rows[k].argmin()))


def _at(distance: float, directions: Array) -> Array:
    size = np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.asarray(distance * directions / np.maximum(size, 1e-300))


def _normals(slopes: Array) -> Array:
    size = np.linalg.norm(slopes, axis=1, keepdims=True)
    return np.asarray(np.divide(-slopes, size, out=np.zeros_like(slopes), where=size > 0))
