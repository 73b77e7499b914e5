"""First-order reliability method (FORM), and its inverse, in the standard normal space.

Design points are the places of the limit nearest to the origin: Hasofer and Lind 1974, Rackwitz and Fiessler 1978, with
the line search of Zhang and Der Kiureghian, Two improved algorithms for reliability analysis, 1995. All starts go side
by side. Over time the limit is that of a series system: the instant that decides is determined at every place.

Inverse FORM finds the least margin at a given distance from the origin: Der Kiureghian, Zhang and Li, Inverse
reliability problem, Journal of Engineering Mechanics 120, 1994; the performance measure of Tu, Choi and Park, A new
study on reliability-based design optimization, Journal of Mechanical Design 121, 1999. A limit that no values exceed
has no design point, but it has such a place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from shoal.response.inputs import BoolArray
from shoal.response.limits.margins import FAR, Margins, least
from shoal.response.runs import TooManyRunsError
from shoal.trajectory import Array

STEP = 0.01
"""Step of central differences [standard deviations]."""
ITERATIONS = 30
"""Steps of a search, at most."""
SHARES = 1.0, 0.5, 0.25, 0.1, 0.03
"""Of a step; all are tried. Where the limit is more curved than the sphere, whole steps go to and fro for ever."""
ON, STRAIGHT = 1e-4, 1e-3
"""A design point lies on the limit within this distance and straight above its origin within that one."""
NEAR = 0.1
"""Distance from the limit beyond which a search has failed."""
APART = 0.3
"""Distance below which two design points are one."""
NEGLIGIBLE = 1e-4
"""A design point with less than this share of the density of the nearest one does not count."""


@dataclass(frozen=True)
class DesignPoint:
    """Design point: the locally most probable point of the failure domain.

    place: in the standard normal space, (parameters,); normal: the unit vector of steepest descent of the margin there;
    slope: by how much the margin falls per standard deviation; beta: distance [standard deviations], negative if the
    origin is beyond the limit; instant: that decides, its index; converged: to the accuracy that is asked for
    """

    place: Array
    normal: Array
    slope: float
    beta: float
    instant: int
    converged: bool

    @property
    def probability(self) -> float:
        """First-order estimate: the probability of the half space beyond the tangent."""
        return float(special.ndtr(-self.beta))


def design_points(margins: Margins, starts: Array) -> list[DesignPoint]:
    """Search design points from these starts, (starts, parameters); the nearest first, each once. Raises InputError."""
    u = starts.copy()
    rows = margins(u)
    g = least(rows)
    slopes = np.zeros_like(u)
    straight = np.zeros(len(u), dtype=bool)
    active = np.isfinite(g)
    try:
        for _ in range(ITERATIONS):
            moving = np.flatnonzero(active & ~straight)
            if not moving.size:
                break
            slopes[moving] = gradients(margins, u[moving], rows[moving])
            size = np.linalg.norm(slopes[moving], axis=1)
            # Where nothing changes the margin there is nowhere to go.
            active[moving[~(size > 0)]] = False
            moving = moving[size > 0]
            straight[moving] = _converged(u[moving], g[moving], slopes[moving])
            moving = moving[~straight[moving]]
            if moving.size:
                u[moving], g[moving], rows[moving] = _step(margins, u[moving], g[moving], slopes[moving])
                active &= np.isfinite(g)
            meet(u, active)
    except TooManyRunsError:
        pass
    near = active & np.any(slopes, axis=1) & (g <= NEAR * np.linalg.norm(slopes, axis=1))
    return distinct([_point(u[k], slopes[k], rows[k], bool(straight[k])) for k in np.flatnonzero(near)])


def gradients(margins: Margins, u: Array, rows: Array) -> Array:
    """Return gradients of the deciding margin by central differences, (places, parameters); 0 where a run failed."""
    count, parameters = u.shape
    away = STEP * np.eye(parameters)
    beside = np.concatenate([u[:, None] + away, u[:, None] - away], axis=1)
    found = margins(beside.reshape(-1, parameters)).reshape(count, 2, parameters, -1)
    instant = rows.argmin(axis=1)
    at = np.take_along_axis(found, instant[:, None, None, None], axis=3)[..., 0]
    return np.nan_to_num((at[:, 0] - at[:, 1]) / (2 * STEP))


def _converged(u: Array, g: Array, slope: Array) -> BoolArray:
    size = np.linalg.norm(slope, axis=1)
    normal = -slope / size[:, None]
    along = np.sum(u * normal, axis=1)
    aside = np.linalg.norm(u - along[:, None] * normal, axis=1)
    return np.asarray((np.abs(g) <= ON * size) & (aside <= STRAIGHT * np.maximum(1.0, np.abs(along))))


def _step(margins: Margins, u: Array, g: Array, slope: Array) -> tuple[Array, Array, Array]:
    """Step towards the nearest place of the tangent, as far as the merit |u|^2 / 2 + c |g| is least."""
    square = np.sum(slope**2, axis=1)
    wanted = ((np.sum(slope * u, axis=1) - g) / square)[:, None] * slope
    far = np.linalg.norm(wanted, axis=1)
    wanted *= np.minimum(1.0, FAR / np.maximum(far, 1e-300))[:, None]
    penalty = 2 * np.maximum(np.linalg.norm(u, axis=1), np.linalg.norm(wanted, axis=1)) / np.sqrt(square) + 1e-12
    tried = u[:, None] + np.array(SHARES)[:, None] * (wanted - u)[:, None]
    found = margins(tried.reshape(-1, u.shape[1])).reshape(*tried.shape[:2], -1)
    value = least(found.reshape(-1, found.shape[2])).reshape(tried.shape[:2])
    best = np.argmin(0.5 * np.sum(tried**2, axis=2) + penalty[:, None] * np.abs(value), axis=1)
    each = np.arange(len(u))
    return tried[each, best], value[each, best], found[each, best]


def meet(u: Array, active: BoolArray) -> None:
    """Searches that come together go on as one."""
    going = np.flatnonzero(active)
    for k, one in enumerate(going):
        beside = np.linalg.norm(u[going[:k]] - u[one], axis=1) < APART
        active[one] = not np.any(beside & active[going[:k]])


def _point(u: Array, slope: Array, row: Array, converged: bool) -> DesignPoint:
    size = float(np.linalg.norm(slope))
    normal = -slope / size
    return DesignPoint(u.copy(), normal, size, float(u @ normal), int(row.argmin()), converged)


def distinct(found: list[DesignPoint]) -> list[DesignPoint]:
    """Return each design point once: the converged ones that matter, the nearest first; else the others."""
    chosen: list[DesignPoint] = []
    wanted = [point for point in found if point.converged] or found
    for point in sorted(wanted, key=lambda point: abs(point.beta)):
        nearest = chosen[0] if chosen else point
        matters = 0.5 * (point.beta**2 - nearest.beta**2) < -math.log(NEGLIGIBLE)
        if matters and all(np.linalg.norm(point.place - other.place) > APART for other in chosen):
            chosen.append(point)
    return chosen


STARTS = 6
"""Searches from random directions, beside the one from the origin or along the slope there."""


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
