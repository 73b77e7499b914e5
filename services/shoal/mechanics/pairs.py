"""Pairs of surfaces: gap, normal, slip and their derivatives, from the places and attitudes of both bodies.

With x from the second place to the first, n the normal from the second surface to the first and r the radius of the
first, the surfaces touch at x - r e, e = n of a sphere and of a disc the part of n across its axle. Their rate along a
direction u is u.(v + w x arm) of the first less that of the second: of the normal that is the rate of the gap, of a
tangent the slip. What the accelerations do not cause of its derivative by time is found with complex numbers: of a
function of z + i h z', h -> 0, the imaginary part is h times the rate (Squire and Trapp 1998).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import profiles
from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.profiles import Profiles

FLAT, ROUND, HOLE, PROFILE = 0, 1, 2, 3
"""Shapes of the second surface: a line or plane, a circle or sphere (or a point), a hole, an outline of features."""
_STEP = 1e-100
MOST_ROWS = 30
ROOM = 3 * (MOST_ROWS + 2) + 10
"""Numbers that `describe` leaves of one pair in one lane."""


class Pairs(NamedTuple):
    """Pairs of surfaces of one tile.

    dimensions: d, of vectors. shape: of the second surface. disc: whether the first is a disc in space. turns: whether
    the bodies of the first and the second have an attitude, two a pair. rows: of each pair the place of the first and
    its directors (one in the plane, three in space), the same of the second, the normal of a flat surface and the axle
    of a disc; any valid rows where there are none. radius: of the first, and reach: the second's radius or zero [m],
    both (pairs, lanes). profiles: outlines, by pair.
    """

    dimensions: int
    size: int
    shape: Index
    disc: Index
    turns: Index
    rows: Index
    radius: Array
    reach: Array
    profiles: Profiles


@njit(cache=True, forceinline=True)
def side_rows(d: int) -> int:
    """Rows of one side: place and directors."""
    return 4 if d == 2 else 12


@njit(cache=True, forceinline=True)
def pair_rows(d: int) -> int:
    """Rows of one pair."""
    return 2 * side_rows(d) + 2 * d  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def _vector(z, zdot, rows, first, d, width, lane):  # type: ignore[no-untyped-def]
    """Return a vector of a state as complex numbers; in the plane with a third component of zero."""
    a, b = rows[first] * width + lane, rows[first + 1] * width + lane
    third = 0j
    if d == 3:
        c = rows[first + 2] * width + lane
        third = complex(z[c], _STEP * zdot[c])
    return complex(z[a], _STEP * zdot[a]), complex(z[b], _STEP * zdot[b]), third


@njit(cache=True, error_model="numpy", forceinline=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy", forceinline=True)
def _along(a, s, b):  # type: ignore[no-untyped-def]
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def _times(s, a):  # type: ignore[no-untyped-def]
    return s * a[0], s * a[1], s * a[2]


@njit(cache=True, error_model="numpy")
def _tangents(d, n):  # type: ignore[no-untyped-def]
    """Return two unit vectors across a normal; in the plane the normal turned by -90 degrees, and the axis."""
    if d == 2:
        return (n[1], -n[0], 0j), (0j, 0j, 1.0 + 0j)
    x, y, z = abs(n[0].real), abs(n[1].real), abs(n[2].real)
    axis = (1.0 + 0j, 0j, 0j)
    if y <= x and y <= z:
        axis = (0j, 1.0 + 0j, 0j)
    elif z <= x and z <= y:
        axis = (0j, 0j, 1.0 + 0j)
    across = _cross(axis, n)
    size = np.sqrt(_dot(across, across))
    if size.real > 0.0:
        across = _times(1.0 / size, across)
    return across, _cross(n, across)


@njit(cache=True, error_model="numpy")
def _write(z, zdot, p, first, d, width, lane, sign, turns, u, arm, out, at):  # type: ignore[no-untyped-def]
    """Write the gradient of the rate of a side along u in the rates of its rows; return rate + i h bias."""
    total = 0j
    for k in range(d):
        value = sign * u[k]
        out[at + k] = value.real
        total += value * zdot[p.rows[first + k] * width + lane]
    moment = _cross(arm, u)
    for number in range(1 if d == 2 else 3):
        row = first + d * (number + 1)
        e = _vector(z, zdot, p.rows, row, d, width, lane)
        # w = e x e' / e.e in the plane, 1/2 sum e x e' in space.
        change = _cross(moment, e)
        factor = complex(0.5 * sign if turns else 0.0, 0.0)
        if turns and d == 2:
            factor = sign / _dot(e, e)
        for k in range(d):
            value = factor * change[k]
            out[at + d * (number + 1) + k] = value.real
            total += value * zdot[p.rows[row + k] * width + lane]
    return total


@njit(cache=True, error_model="numpy", forceinline=True)
def _axis(z, zdot, p, number, width, lane):  # type: ignore[no-untyped-def]
    """Return the x axis of the second body in the plane as a unit vector."""
    if p.turns[2 * number + 1] == 0:
        return (1.0 + 0j, 0j, 0j)
    e = _vector(z, zdot, p.rows, pair_rows(2) * number + side_rows(2) + 2, 2, width, lane)
    return _times(1.0 / np.sqrt(_dot(e, e)), e)


@njit(cache=True, error_model="numpy")
def nearest_feature(p: Pairs, number: int, width: int, lane: int, z: Array, zdot: Array, other: int) -> int:
    """Return the feature of the second outline nearest to the first; other: see `profiles.nearest`. Pointers."""
    first = pair_rows(2) * number
    one = _vector(z, zdot, p.rows, first, 2, width, lane)
    x = _along(one, -1.0, _vector(z, zdot, p.rows, first + side_rows(2), 2, width, lane))
    e = _axis(z, zdot, p, number, width, lane)
    along, across = x[0] * e[0] + x[1] * e[1], x[1] * e[0] - x[0] * e[1]
    return profiles.nearest(p.profiles, number, along.real, across.real, other)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def describe(
    p: Pairs,
    number: int,
    width: int,
    lane: int,
    directions: int,
    z: Array,
    zdot: Array,
    feature: int,
    kept: bool,
    out: Array,
) -> tuple[float, float]:
    """Describe a pair in one lane; derived rows of z and zdot must be filled. Pointers.

    feature: of an outline, and whether it is kept. Returns the way left to its end, see `profiles.touch`, else 0.
    out: the gap [m] and, in three by three numbers, normal and tangents; then for each direction, the normal first, the
    gradient of the rate in the rates of the pair's rows, the rate [m/s] and its bias [m/s^2].
    """
    d = p.dimensions
    first, half, rows = pair_rows(d) * number, side_rows(d), pair_rows(d)
    one = _vector(z, zdot, p.rows, first, d, width, lane)
    other = _vector(z, zdot, p.rows, first + half, d, width, lane)
    x = _along(one, -1.0, other)
    radius, reach = p.radius[number * width + lane], p.reach[number * width + lane]
    left, way = 0.0, 0.0
    if p.shape[number] == PROFILE:
        e = _axis(z, zdot, p, number, width, lane)
        along, across = x[0] * e[0] + x[1] * e[1], x[1] * e[0] - x[0] * e[1]
        away, nx, ny, left, way = profiles.touch(p.profiles, number, feature, kept, along, across)
        gap, n = away.real - radius, (nx * e[0] - ny * e[1], nx * e[1] + ny * e[0], 0j)
    elif p.shape[number] == FLAT:
        n = _vector(z, zdot, p.rows, first + 2 * half, d, width, lane)
        n = _times(1.0 / np.sqrt(_dot(n, n)), n)
        gap = _dot(x, n).real - radius
    else:
        size = np.sqrt(_dot(x, x))
        gap = size.real - radius - reach
        n = (0j, 0j, 0j)
        if size.real > 0.0:  # complex numbers cannot be divided by zero
            n = _times(1.0 / size, x)
        if p.shape[number] == HOLE:
            gap, n = reach - radius - size.real, _times(-1.0 + 0j, n)
    tangents = _tangents(d, n)
    out[0] = gap
    for k in range(3):
        out[1 + k], out[4 + k], out[7 + k] = n[k].real, tangents[0][k].real, tangents[1][k].real
    towards = n
    if p.disc[number] > 0:
        axle = _vector(z, zdot, p.rows, first + 2 * half + d, d, width, lane)
        axle = _times(1.0 / np.sqrt(_dot(axle, axle)), axle)
        towards = _along(n, -_dot(n, axle), axle)
        size = np.sqrt(_dot(towards, towards))
        if size.real > 0.0:
            towards = _times(1.0 / size, towards)
        gap += radius * (1.0 - size.real)
        out[0] = gap
    arm = _times(complex(-radius, 0.0), towards)
    far = _along(x, complex(-radius, 0.0), towards)
    for k in range(directions):
        u = n if k == 0 else (tangents[0] if k == 1 else tangents[1])
        at = 10 + k * (rows + 2)
        total = _write(z, zdot, p, first, d, width, lane, 1.0, p.turns[2 * number] > 0, u, arm, out, at)
        total += _write(
            z, zdot, p, first + half, d, width, lane, -1.0, p.turns[2 * number + 1] > 0, u, far, out, at + half
        )
        for row in range(2 * d):
            out[at + 2 * half + row] = 0.0
        out[at + rows], out[at + rows + 1] = total.real, total.imag / _STEP
    return left, way
