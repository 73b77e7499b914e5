"""Outlines of cams: the radius over the angle in the body, a periodic cubic spline, in segments between its knots.

With r(a) the radius, C = r u(a) the outline, u and v the unit vectors along the radius and across it, the place c of
what touches is nearest to C(a) where f(a) = (c - C).C' = 0. There it is (c - C).n away, n along r u - r' v. A body of
some radius follows the parallel curve at that distance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from shoal.mechanics.numerics.tile import Array

if TYPE_CHECKING:
    from shoal.scene.contacts import Cam

BEGIN, SPAN, RADIUS, KNOT = 0, 1, 2, 6
"""Numbers of a segment: the angle at which it begins and how far it goes [rad], four coefficients of the radius by the
angle from there, the highest last [m/rad^k], and where it begins, two coordinates [m]."""
MOST = 30
"""Steps of Newton's method; five are usual."""
CLOSE = 1e-15
"""Step [rad] below which it has ended."""
SAMPLES = 16
"""Of every segment, where the start and the hollows of an outline are looked at."""


@njit(cache=True, error_model="numpy", forceinline=True)
def _radius(numbers, at, angle):  # type: ignore[no-untyped-def]
    """Return the radius of a segment at an angle, and two derivatives."""
    s = angle - numbers[at + BEGIN]
    a, b, c, d = numbers[at + RADIUS], numbers[at + RADIUS + 1], numbers[at + RADIUS + 2], numbers[at + RADIUS + 3]
    return a + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * s * d), 2.0 * c + 6.0 * s * d


@njit(cache=True, error_model="numpy", forceinline=True)
def _miss(numbers, at, angle, x, y):  # type: ignore[no-untyped-def]
    """Return f and its derivative at an angle, for a place in the axes of the body."""
    r, slope, bend = _radius(numbers, at, angle)
    cosine, sine = np.cos(angle), np.sin(angle)
    along, across = x * cosine + y * sine - r, y * cosine - x * sine
    return along * slope + across * r, along * (bend - r) + 2.0 * across * slope - slope * slope - r * r


@njit(cache=True, error_model="numpy")
def nearest(numbers: Array, first: int, count: int, size: int, x: float, y: float) -> int:
    """Return the segment, of so many from `first` on with `size` numbers each, that is nearest to a place."""
    found, least = 0, np.inf
    for k in range(count):
        at = size * (first + k) + KNOT
        square = (x - numbers[at]) ** 2 + (y - numbers[at + 1]) ** 2
        if square < least:
            found, least = k, square
    at = size * (first + found)
    ahead = _miss(numbers, at, numbers[at + BEGIN], x, y)[0] > 0.0
    return found if ahead else (found - 1 + count) % count


@njit(cache=True, error_model="numpy")
def touch(numbers, at, x, y):  # type: ignore[no-untyped-def]
    """Return the same as `profiles.touch` of a segment, which may be longer than it is."""
    begin, span = numbers[at + BEGIN], numbers[at + SPAN]
    middle = begin + 0.5 * span
    turn = np.arctan2(y.real, x.real) - middle
    turn -= 2.0 * np.pi * np.rint(turn / (2.0 * np.pi))
    angle = middle + min(max(turn, -span), span)
    for _ in range(MOST):
        miss, slope = _miss(numbers, at, angle, x.real, y.real)
        step = min(max(-miss / slope, -span), span)
        angle += step
        if abs(step) < CLOSE:
            break
    # One more step gives the derivative by the place.
    miss, slope = _miss(numbers, at, complex(angle, 0.0), x, y)
    turned = angle - miss / slope
    r, by_turn, _ = _radius(numbers, at, turned)
    cosine, sine = np.cos(turned), np.sin(turned)
    nx, ny = r * cosine + by_turn * sine, r * sine - by_turn * cosine
    size = np.sqrt(nx * nx + ny * ny)
    nx, ny = nx / size, ny / size
    away = (x - r * cosine) * nx + (y - r * sine) * ny
    forwards = turned.imag >= 0.0
    left = (begin + span - turned.real if forwards else turned.real - begin) * size.real
    return away, nx, ny, left, (1.0 if forwards else -1.0)


def segments(cam: Cam, size: int) -> Array:
    """Return the numbers of the segments of an outline, (segments, size)."""
    # Importing scipy takes longer than reading a scene.
    from scipy.interpolate import CubicSpline

    angles, radii = np.array([*cam.table, (cam.table[0][0] + cam.period, cam.table[0][1])]).T
    spline = CubicSpline(angles, radii, bc_type="periodic")
    lobes = cam.lobes
    found = np.zeros((lobes * (len(angles) - 1), size))
    found[:, BEGIN] = np.concatenate([angles[:-1] + k * cam.period for k in range(lobes)])
    found[:, SPAN] = np.tile(np.diff(angles), lobes)
    found[:, RADIUS : RADIUS + 4] = np.tile(spline.c[::-1].T, (lobes, 1))
    found[:, KNOT] = found[:, RADIUS] * np.cos(found[:, BEGIN])
    found[:, KNOT + 1] = found[:, RADIUS] * np.sin(found[:, BEGIN])
    return found


def _at(numbers: Array, angle: Array) -> tuple[Array, Array, Array]:
    """Return radius and two derivatives of an outline at angles."""
    turn = np.mod(angle - numbers[0, BEGIN], 2.0 * np.pi) + numbers[0, BEGIN]
    k = np.searchsorted(numbers[:, BEGIN], turn, side="right") - 1
    s = turn - numbers[k, BEGIN]
    a, b, c, d = numbers[k, RADIUS : RADIUS + 4].T
    return a + s * (b + s * (c + s * d)), b + s * (2 * c + 3 * s * d), 2 * c + 6 * s * d


def samples(numbers: Array) -> Array:
    """Return angles at which an outline is looked at [rad]."""
    return np.ravel(numbers[:, [BEGIN]] + np.linspace(0.0, 1.0, SAMPLES, endpoint=False) * numbers[:, [SPAN]])


def points(numbers: Array) -> Array:
    """Return samples of an outline [m], (points, 2)."""
    angle = samples(numbers)
    return np.asarray(_at(numbers, angle)[0][:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def least_radii(numbers: Array) -> tuple[float, float]:
    """Return the least radius of an outline, and the least radius of curvature of its hollows, or infinity [m]."""
    r, slope, bend = _at(numbers, samples(numbers))
    square = r * r + slope * slope
    deepest = -float(np.min((square + slope * slope - r * bend) / square**1.5))
    return float(np.min(r)), 1.0 / deepest if deepest > 0.0 else math.inf


def distance(numbers: Array, place: Array) -> Array:
    """Return how far places (2, lanes) are outside an outline [m], (lanes,)."""
    nearest_one = np.argmin(np.linalg.norm(points(numbers)[:, :, None] - place, axis=1), axis=0)
    angle, (x, y) = samples(numbers)[nearest_one], place
    for _ in range(MOST):
        r, slope, bend = _at(numbers, angle)
        along, across = x * np.cos(angle) + y * np.sin(angle) - r, y * np.cos(angle) - x * np.sin(angle)
        miss = along * slope + across * r
        angle = angle - miss / (along * (bend - r) + 2 * across * slope - slope * slope - r * r)
    r, slope, _ = _at(numbers, angle)
    along, across = x * np.cos(angle) + y * np.sin(angle) - r, y * np.cos(angle) - x * np.sin(angle)
    return np.asarray((along * r - across * slope) / np.hypot(r, slope))
