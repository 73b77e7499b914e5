"""Constraints that are at most quadratic in the coordinates: C = sum of factor u w + c + f(p), one kernel for all.

Gears are the exception, C = sum of share * angle + c but for multiples of a period, as their teeth have no numbers. As
the vectors d of the angles are of unit length, C_q is linear in d all the same, (-d_y, d_x), and there is no bias; of
d3C/dt3 = d' x d'' + d x d''' the first term, the cube of the rate, counts once and not three times.

u and w are rows of the state: unknowns, or components of vectors that are affine in them. As differences of points
are formed before they are multiplied, the round-off of C does not grow with the distance from the origin. C_q, the
bias C_qq v v + C_tt and the third derivative of C follow from the same lists. The Jacobian is sparse: entry e is
the column `column[e]` of the constraint whose range in `entry` contains e.

A drive p(t), an angle or a length, enters by f = -p, -cos p, -sin p or -p^2, whose derivatives are exact: C(q, p) does
not depend on time otherwise, and is the geometry of the machine with the drive as one more coordinate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile import simd
from shoal.mechanics import functions
from shoal.mechanics.functions import Functions
from shoal.mechanics.numerics.tile import Array, Index, Tile

POWERS = 3
"""Constraints are measured in 1 (directions), m or m^2."""
OPEN = 1e-6
"""Largest violation of a constraint that may be believed, relative to the machine's size to its power of a length."""
LINEAR, SQUARE, COSINE, SINE = range(4)
"""How a drive enters."""
WAYS = {("neg",): LINEAR, ("square", "neg"): SQUARE, ("cos", "neg"): COSINE, ("sin", "neg"): SINE}
"""The same by the operations of `scene.function.Composed`."""


class Constraints(NamedTuple):
    """Product p of constraint k in start[k]:start[k+1] is factor[p] * z[left[p]] * z[right[p]]; left = -1 stands for 1.

    constant: c, (constraints, lanes). lengths: C is in m to that power. open: the size of C from which a joint counts
    as open, (constraints, lanes). drive: number of the function p of every constraint (-1: none); way: how it enters.
    Part r of the Jacobian adds coefficient[r] * z[source[r]] to the entry target[r]; source = -1 stands for 1.
    Angle r of constraint k in turned[k]:turned[k+1] is that of the vector in the rows rising[r] and rising[r] + 1, with
    the factor share[r]; period: of every constraint [rad].
    """

    size: int
    start: Index
    left: Index
    right: Index
    factor: Array
    constant: Array
    lengths: Index
    open: Array
    drive: Index
    way: Index
    entry: Index
    column: Index
    parts: int
    target: Index
    source: Index
    coefficient: Array
    turned: Index
    rising: Index
    share: Array
    period: Array


@njit(cache=True, error_model="numpy")
def by_drive(way: int, p: float, order: int) -> float:
    """Return the derivative of f by the drive p, of an order from 0 to 3."""
    if way == LINEAR:
        return -p if order == 0 else (-1.0 if order == 1 else 0.0)
    if way == SQUARE:
        return -p * p if order == 0 else (-2.0 * p if order == 1 else (-2.0 if order == 2 else 0.0))
    quarter = (order + (3 if way == SINE else 0)) % 4  # -sin p = -cos(p + 3 pi/2)
    sign = -1.0 if quarter == 0 or quarter == 3 else 1.0
    return sign * (math.cos(p) if quarter % 2 == 0 else math.sin(p))


@njit(cache=True, error_model="numpy")
def driven(constraints: Constraints, drives: Functions, k: int, t: float, order: int) -> float:
    """Return the derivative of f by time, of an order from 0 to 3, of constraint k."""
    number, way = constraints.drive[k], constraints.way[k]
    if number < 0:
        return 0.0
    if way == LINEAR:
        return -functions.evaluate(drives, number, t, order)  # type: ignore[no-any-return]
    p = functions.evaluate(drives, number, t, 0)
    if order == 0:
        return by_drive(way, p, 0)  # type: ignore[no-any-return]
    rate = functions.evaluate(drives, number, t, 1)
    if order == 1:
        return by_drive(way, p, 1) * rate  # type: ignore[no-any-return]
    change = functions.evaluate(drives, number, t, 2)
    if order == 2:
        return by_drive(way, p, 2) * rate**2 + by_drive(way, p, 1) * change  # type: ignore[no-any-return]
    jerk = functions.evaluate(drives, number, t, 3)
    return by_drive(way, p, 3) * rate**3 + 3.0 * by_drive(way, p, 2) * rate * change + by_drive(way, p, 1) * jerk  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def curvature(constraints: Constraints, drives: Functions, k: int, t: float, one: int, other: int) -> float:
    """Return C_pp of constraint k times two derivatives of the drive by time, of these orders."""
    number = constraints.drive[k]
    if number < 0:
        return 0.0
    bend = by_drive(constraints.way[k], functions.evaluate(drives, number, t, 0), 2)
    return bend * functions.evaluate(drives, number, t, one) * functions.evaluate(drives, number, t, other)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def third_derivative(
    tile: Tile, constraints: Constraints, drives: Functions, k: int, t: float, z: Array, zdot: Array, lane: int
) -> float:
    """Return a third of d3C/dt3 of constraint k in one lane, but for C_qq v a and what vanishes in singular positions.

    That are products of C_q, C_p and C_ppp, as C_ppp = -C_p or 0. The derived rows of z and zdot must be filled.
    """
    width, total = len(tile), curvature(constraints, drives, k, t, 1, 2)
    for r in range(constraints.turned[k], constraints.turned[k + 1]):
        x, y = constraints.rising[r] * width + lane, (constraints.rising[r] + 1) * width + lane
        total -= constraints.share[r * width + lane] * (z[x] * zdot[y] - z[y] * zdot[x]) ** 3 * (2.0 / 3.0)
    return total  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def residual(tile: Tile, constraints: Constraints, drives: Functions, t: float, z: Array, value: Array) -> None:
    """C(q, t); value: (constraints, lanes). The derived rows of z must be filled."""
    width = len(tile)
    for k in range(constraints.size):
        total = simd.load(tile, constraints.constant, k * width) + driven(constraints, drives, k, t, 0)
        for p in range(constraints.start[k], constraints.start[k + 1]):
            left, right = constraints.left[p] * width, constraints.right[p] * width
            product = simd.load(tile, constraints.factor, p * width) * simd.load(tile, z, right)
            total = total + (product * simd.load(tile, z, left) if left >= 0 else product)
        simd.store(value, k * width, total)
        if constraints.turned[k] < constraints.turned[k + 1]:
            _add_angles(width, constraints, k, z, value)


@njit(cache=True, error_model="numpy")
def _add_angles(width: int, constraints: Constraints, k: int, z: Array, value: Array) -> None:
    """The angles of constraint k, and its nearest multiple of the period taken off."""
    for lane in range(width):
        total = value[k * width + lane]
        for r in range(constraints.turned[k], constraints.turned[k + 1]):
            row = constraints.rising[r]
            angle = math.atan2(z[(row + 1) * width + lane], z[row * width + lane])
            total += constraints.share[r * width + lane] * angle
        period = constraints.period[k * width + lane]
        value[k * width + lane] = total - period * np.rint(total / period)


@njit(cache=True, error_model="numpy")
def rates(tile: Tile, constraints: Constraints, drives: Functions, t: float, out: Array) -> None:
    """C_t(t), so that C_q v = -C_t; out: (constraints, lanes)."""
    width = len(tile)
    for k in range(constraints.size):
        simd.store(out, k * width, simd.spread(tile, driven(constraints, drives, k, t, 1)))


@njit(cache=True, error_model="numpy")
def jacobian(tile: Tile, constraints: Constraints, z: Array, linear: float, out: Array) -> None:
    """The Jacobian with 1 replaced by `linear`; out: (entries, lanes). Of z and 1: C_q; of zdot and 0: dC_q/dt."""
    width = len(tile)
    for i in range(constraints.entry[constraints.size] * width):
        out[i] = 0.0
    for r in range(constraints.parts):
        target, source = constraints.target[r] * width, constraints.source[r] * width
        coefficient = simd.load(tile, constraints.coefficient, r * width)
        if source < 0:
            simd.add_to(out, target, linear * coefficient)
        else:
            simd.add_to(out, target, coefficient * simd.load(tile, z, source))


@njit(cache=True, error_model="numpy")
def pace(tile: Tile, constraints: Constraints, weights: Array, v: Array, lane: int) -> float:
    """Return the sum of the sizes of the entries of weights' dC_q/dt at a rate v of one lane; weights: an array.

    Velocities whose differences vanish, as those of a platform that does not turn, leave round-off of this size times
    eps, which says nothing.
    """
    width, total, r = len(tile), 0.0, 0
    for k in range(constraints.size):
        fastest = 0.0
        for e in range(constraints.entry[k], constraints.entry[k + 1]):
            fastest = max(fastest, abs(v[constraints.column[e] * width + lane]))
        while r < constraints.parts and constraints.target[r] < constraints.entry[k + 1]:
            if constraints.source[r] >= 0:
                total += abs(weights[k] * constraints.coefficient[r * width + lane]) * fastest
            r += 1
    return total


@njit(cache=True, error_model="numpy")
def bias(tile: Tile, constraints: Constraints, drives: Functions, t: float, zdot: Array, out: Array) -> None:
    """eta = C_qq v v + C_tt, so that C_q a = -eta; out: (constraints, lanes). Derived rows of zdot must be filled."""
    width = len(tile)
    for k in range(constraints.size):
        total = simd.spread(tile, driven(constraints, drives, k, t, 2))
        for p in range(constraints.start[k], constraints.start[k + 1]):
            left, right = constraints.left[p] * width, constraints.right[p] * width
            if left >= 0:
                doubled = 2.0 * simd.load(tile, constraints.factor, p * width)
                total = total + doubled * simd.load(tile, zdot, left) * simd.load(tile, zdot, right)
        simd.store(out, k * width, total)


@njit(cache=True, error_model="numpy")
def add_power(
    tile: Tile, constraints: Constraints, drives: Functions, t: float, multiplier: Array, power: Array
) -> None:
    """Subtract the power [W] that driven constraints supply, lambda C_t, from power (lanes,)."""
    width = len(tile)
    for k in range(constraints.size):
        if constraints.drive[k] >= 0:
            rate = driven(constraints, drives, k, t, 1)
            for lane in range(width):
                power[lane] -= multiplier[k * width + lane] * rate


@njit(cache=True, error_model="numpy")
def add_product(tile: Tile, constraints: Constraints, matrix: Array, x: Array, out: Array) -> None:
    """out += C_q x for the entries of a Jacobian; out: (constraints, lanes)."""
    width = len(tile)
    for k in range(constraints.size):
        total = simd.load(tile, out, k * width)
        for e in range(constraints.entry[k], constraints.entry[k + 1]):
            total = total + simd.load(tile, matrix, e * width) * simd.load(tile, x, constraints.column[e] * width)
        simd.store(out, k * width, total)


@njit(cache=True, error_model="numpy")
def subtract_transposed(tile: Tile, constraints: Constraints, matrix: Array, multiplier: Array, out: Array) -> None:
    """out -= C_q' multiplier; out: (unknowns, lanes)."""
    width = len(tile)
    for k in range(constraints.size):
        force = simd.load(tile, multiplier, k * width)
        for e in range(constraints.entry[k], constraints.entry[k + 1]):
            simd.add_to(out, constraints.column[e] * width, -force * simd.load(tile, matrix, e * width))


@njit(cache=True, error_model="numpy")
def drift(
    tile: Tile, constraints: Constraints, drives: Functions, t: float, z: Array, gap: Array, worst: Array
) -> None:
    """Raise worst (POWERS, lanes) to the largest |C(q, t)| of each power of a length.

    gap is work space, (constraints, lanes).
    """
    width = len(tile)
    residual(tile, constraints, drives, t, z, gap)
    for k in range(constraints.size):
        row = constraints.lengths[k] * width
        for lane in range(width):
            worst[row + lane] = max(worst[row + lane], abs(gap[k * width + lane]))
