"""Springs, dampers, friction and motors: a scalar measure g(z) and a law F(g, g', t), acting as F dg/dz.

With x = g - g0 the law is F = -[k x + k3 x^3 + table(x)] - [c g' + F_c tanh(g'/v_s)] + amplitude drive(t):
elastic, dissipated and supplied. The tanh smooths Coulomb's law (Andersson, Soederberg, Bjoerklund 2007).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.functions import Functions, evaluate, excess
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import add_product, clear, copy, pointer

DISTANCE, ANGLE, PLACE = 0, 1, 2
"""Measures: |b - a| [m] of two points; the angle [rad] from direction a to direction b, over any number of
turns; where point b lies relative to point a along direction d, (b - a).d/|d| [m]."""

ROWS = 6
STIFFNESS, CUBIC, DAMPING, NATURAL, COULOMB, SPEED, AMPLITUDE = range(7)
LAW = 7

# Rows of the work space: coordinates of a, b, d; gradient of g in them; g or x; g'; the elastic force.
_GRADIENT, VALUE, _RATE, _ELASTIC = 6, 12, 13, 14
_TURN = 2.0 * np.pi


class Forces(NamedTuple):
    """Force elements of one tile.

    kind: DISTANCE, ANGLE or PLACE. rows: six an element, (a, b, d) with x and y; where d is not used, any valid
    rows. Directions need not be unit vectors. table: function of x, the elastic force [N or N m], and energy, its
    antiderivative; drive: function of time; -1 for none. law: (7 * elements, lanes), seven rows an element:
    stiffness k, cubic k3, damping c, natural value g0, Coulomb limit F_c, Coulomb speed v_s (matters and must
    be positive where F_c is not 0), amplitude of the drive.
    """

    size: int
    kind: Index
    rows: Index
    table: Index
    energy: Index
    drive: Index
    law: Array


@njit(cache=True, error_model="numpy")
def raw(forces: Forces) -> Forces:
    """The same elements with pointers in place of arrays."""
    return Forces(
        forces.size,
        pointer(forces.kind),
        pointer(forces.rows),
        pointer(forces.table),
        pointer(forces.energy),
        pointer(forces.drive),
        pointer(forces.law),
    )


def initial_memory(tile: Tile, forces: Forces, z: Array, intended: Array) -> Array:
    """The memory with which a motion begins, flat (elements, lanes).

    z: flat coordinates, derived rows filled; intended: angles [rad], flat (elements, lanes), from which the whole
    turns are taken (the rest follows from z), so that a spring can be wound up at the start.
    """
    rows, at = forces.rows.reshape(-1, ROWS), z.reshape(-1, len(tile))
    first, second = (at[rows[:, k]] + 1j * at[rows[:, k + 1]] for k in (0, 2))
    angle = np.angle(second * np.conj(first))
    memory = angle + _TURN * np.rint((intended.reshape(angle.shape) - angle) / _TURN)
    return np.where(forces.kind[:, None] == ANGLE, memory, 0.0).ravel()


@njit(cache=True, error_model="numpy", inline="always")
def _angle(ax, ay, bx, by, last):  # type: ignore[no-untyped-def]
    """The angle from a to b that is nearest to the last one."""
    change = np.arctan2(ax * by - ay * bx, ax * bx + ay * by) - last
    return last + (change - _TURN * np.floor(change / _TURN + 0.5))


@njit(cache=True, error_model="numpy")
def remember(tile: Tile, forces: Forces, z: Array, memory: Array) -> None:
    """Follow the angles after a step of less than half a turn; memory: (elements, lanes). Pointers."""
    width = len(tile)
    for number in range(forces.size):
        if forces.kind[number] == ANGLE:
            ax, ay = forces.rows[ROWS * number] * width, forces.rows[ROWS * number + 1] * width
            bx, by = forces.rows[ROWS * number + 2] * width, forces.rows[ROWS * number + 3] * width
            for lane in range(width):
                slot = number * width + lane
                memory[slot] = _angle(z[ax + lane], z[ay + lane], z[bx + lane], z[by + lane], memory[slot])


@njit(cache=True, error_model="numpy")
def _gradient(tile: Tile, forces: Forces, number: int, z: Array, w: Array) -> None:
    """Coordinates, dg/dz and, but for the turns of an angle, g of an element into w."""
    width = len(tile)
    kind = forces.kind[number]
    for k in range(ROWS):
        copy(tile, w, k, z, forces.rows[ROWS * number + k])
        clear(tile, w, _GRADIENT + k)
    for lane in range(width):
        ax, ay, bx, by = w[lane], w[width + lane], w[2 * width + lane], w[3 * width + lane]
        dx, dy = w[4 * width + lane], w[5 * width + lane]
        out = _GRADIENT * width + lane
        ux, uy = bx - ax, by - ay
        if kind == DISTANCE:
            value = np.sqrt(ux * ux + uy * uy)
            inverse = 1.0 / value if value > 0.0 else 0.0
            nx, ny = ux * inverse, uy * inverse
            w[out], w[out + width], w[out + 2 * width], w[out + 3 * width] = -nx, -ny, nx, ny
        elif kind == ANGLE:
            value = 0.0
            a, b = 1.0 / (ax * ax + ay * ay), 1.0 / (bx * bx + by * by)
            w[out], w[out + width], w[out + 2 * width], w[out + 3 * width] = ay * a, -ax * a, -by * b, bx * b
        else:
            inverse = 1.0 / np.sqrt(dx * dx + dy * dy)
            nx, ny = dx * inverse, dy * inverse
            value = ux * nx + uy * ny
            w[out], w[out + width], w[out + 2 * width], w[out + 3 * width] = -nx, -ny, nx, ny
            w[out + 4 * width], w[out + 5 * width] = (ux - value * nx) * inverse, (uy - value * ny) * inverse
        w[VALUE * width + lane] = value


@njit(cache=True, error_model="numpy")
def measure(tile: Tile, forces: Forces, number: int, z: Array, memory: Array, w: Array) -> None:
    """As `_gradient`, with x = g - g0 in place of g."""
    width = len(tile)
    _gradient(tile, forces, number, z, w)
    natural = (LAW * number + NATURAL) * width
    for lane in range(width):
        value = w[VALUE * width + lane]
        if forces.kind[number] == ANGLE:
            last = memory[number * width + lane]
            value = _angle(w[lane], w[width + lane], w[2 * width + lane], w[3 * width + lane], last)
        w[VALUE * width + lane] = value - forces.law[natural + lane]


@njit(cache=True, error_model="numpy")
def _rate(tile: Tile, forces: Forces, number: int, zdot: Array, w: Array) -> None:
    """g' from the gradient in w."""
    clear(tile, w, _RATE)
    for k in range(ROWS):
        add_product(tile, w, _RATE, w, _GRADIENT + k, zdot, forces.rows[ROWS * number + k])


@njit(cache=True, error_model="numpy", inline="always")
def _friction(limit, speed, rate):  # type: ignore[no-untyped-def]
    """Smoothed Coulomb force and its slope in the rate."""
    if limit == 0.0:
        return 0.0, 0.0
    level = np.tanh(rate / speed)
    return limit * level, limit / speed * (1.0 - level * level)


@njit(cache=True, error_model="numpy")
def add_force(
    tile: Tile,
    forces: Forces,
    functions: Functions,
    t: float,
    z: Array,
    zdot: Array,
    memory: Array,
    f: Array,
    w: Array,
    power: Array,
    moving: bool,
) -> None:
    """Add F dg/dz to f (rows, lanes), and dissipated minus supplied power [W] to power (lanes,).

    memory: (elements, lanes); w: work space of 15 rows; moving: whether damping, friction and drives count, or the
    elastic part alone. A distance of zero has no direction and exerts no force. Pointers.
    """
    width = len(tile)
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        drive = 0.0
        if moving:
            _rate(tile, forces, number, zdot, w)
            drive = evaluate(functions, forces.drive[number], t, 0)
        else:
            for lane in range(width):
                w[_RATE * width + lane] = 0.0
        law = LAW * number * width
        for lane in range(width):
            x, rate = w[VALUE * width + lane], w[_RATE * width + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            elastic = (k + k3 * x * x) * x + evaluate(functions, forces.table[number], x, 0)
            limit, speed = forces.law[law + COULOMB * width + lane], forces.law[law + SPEED * width + lane]
            resisting = forces.law[law + DAMPING * width + lane] * rate + _friction(limit, speed, rate)[0]
            resisting -= forces.law[law + AMPLITUDE * width + lane] * drive
            power[lane] += resisting * rate
            w[_ELASTIC * width + lane] = -elastic - resisting
        for k in range(ROWS):
            add_product(tile, f, forces.rows[ROWS * number + k], w, _ELASTIC, w, _GRADIENT + k)


@njit(cache=True, error_model="numpy")
def add_energy(
    tile: Tile, forces: Forces, functions: Functions, z: Array, memory: Array, w: Array, energy: Array, row: int
) -> None:
    """Add the elastic energy [J] to a row of energy; w: work space of 15 rows. Pointers."""
    width = len(tile)
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        law = LAW * number * width
        table = forces.table[number]
        for lane in range(width):
            x = w[VALUE * width + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            stored = evaluate(functions, forces.energy[number], x, 0)
            # Beyond its range the table's force holds, so that the energy grows with the way.
            stored += evaluate(functions, table, x, 0) * excess(functions, table, x)
            energy[row * width + lane] += (0.5 * k + 0.25 * k3 * x * x) * x * x + stored


@njit(cache=True, error_model="numpy", inline="always")
def _add_block(out, base, width, i, j, scale, xx, xy, yx, yy):  # type: ignore[no-untyped-def]
    """Add scale * [[xx, xy], [yx, yy]] at pairs (i, j) of the 6 x 6 block that begins at out[base]."""
    corner = base + (2 * ROWS * i + 2 * j) * width
    out[corner] += scale * xx
    out[corner + width] += scale * xy
    out[corner + ROWS * width] += scale * yx
    out[corner + (ROWS + 1) * width] += scale * yy


@njit(cache=True, error_model="numpy")
def tangent(
    tile: Tile,
    forces: Forces,
    functions: Functions,
    z: Array,
    memory: Array,
    w: Array,
    out: Array,
    first: int,
) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (elements * 36, lanes), 6 x 6 blocks.

    A block refers to the six places of the element's row list, also where rows repeat; it is not positive
    definite in general. w: work space of 15 rows. Pointers.
    """
    width = len(tile)
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        kind, table = forces.kind[number], forces.table[number]
        law = LAW * number * width
        start = (first + ROWS * ROWS * number) * width
        for lane in range(width):
            x = w[VALUE * width + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            elastic = (k + k3 * x * x) * x + evaluate(functions, table, x, 0)
            slope = k + 3.0 * k3 * x * x + evaluate(functions, table, x, 1)
            base = start + lane
            for i in range(ROWS):
                for j in range(ROWS):
                    product = w[(_GRADIENT + i) * width + lane] * w[(_GRADIENT + j) * width + lane]
                    out[base + (ROWS * i + j) * width] = slope * product
            ax, ay, bx, by = w[lane], w[width + lane], w[2 * width + lane], w[3 * width + lane]
            nx, ny = w[(_GRADIENT + 2) * width + lane], w[(_GRADIENT + 3) * width + lane]
            if kind == DISTANCE:
                # (I - nn')/|u|; at |u| = 0 the limit for a spring that is relaxed there, d2U = F' I.
                distance = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
                scale = elastic / distance if distance > 0.0 else (slope if elastic == 0.0 else 0.0)
                xx, xy, yy = scale * (1.0 - nx * nx), -scale * nx * ny, scale * (1.0 - ny * ny)
                for i in range(2):
                    for j in range(2):
                        _add_block(out, base, width, i, j, 1.0 if i == j else -1.0, xx, xy, xy, yy)
            elif kind == ANGLE:
                # Of atan2(y, x): xy/r^4 [[2, .], [., -2]] and (y^2 - x^2)/r^4 off the diagonal.
                square = ax * ax + ay * ay
                xx, xy = 2.0 * ax * ay / (square * square), (ay * ay - ax * ax) / (square * square)
                _add_block(out, base, width, 0, 0, -elastic, xx, xy, xy, -xx)
                square = bx * bx + by * by
                xx, xy = 2.0 * bx * by / (square * square), (by * by - bx * bx) / (square * square)
                _add_block(out, base, width, 1, 1, elastic, xx, xy, xy, -xx)
            else:
                # With n = d/|d|, s the normal on it, b - a = g n + h s: tangent and d-d parts of the Hessian.
                inverse = 1.0 / np.sqrt(w[4 * width + lane] ** 2 + w[5 * width + lane] ** 2)
                sx, sy = -ny, nx
                along = (bx - ax) * nx + (by - ay) * ny
                across = (bx - ax) * sx + (by - ay) * sy
                xx, xy, yy = sx * sx * inverse, sx * sy * inverse, sy * sy * inverse
                for i in range(2):
                    sign = elastic if i == 1 else -elastic
                    _add_block(out, base, width, i, 2, sign, xx, xy, xy, yy)
                    _add_block(out, base, width, 2, i, sign, xx, xy, xy, yy)
                xx = -(2.0 * across * nx * sx + along * sx * sx) * inverse * inverse
                xy = -(across * (nx * sy + ny * sx) + along * sx * sy) * inverse * inverse
                yy = -(2.0 * across * ny * sy + along * sy * sy) * inverse * inverse
                _add_block(out, base, width, 2, 2, elastic, xx, xy, xy, yy)


@njit(cache=True, error_model="numpy")
def damping(tile: Tile, forces: Forces, z: Array, zdot: Array, w: Array, out: Array, first: int) -> None:
    """Damping -dF/dzdot, [c + F_c/v_s sech^2(g'/v_s)] dg/dz dg/dz', in 6 x 6 blocks as in `tangent`. Pointers."""
    width = len(tile)
    for number in range(forces.size):
        _gradient(tile, forces, number, z, w)
        _rate(tile, forces, number, zdot, w)
        law = LAW * number * width
        start = (first + ROWS * ROWS * number) * width
        for lane in range(width):
            limit, speed = forces.law[law + COULOMB * width + lane], forces.law[law + SPEED * width + lane]
            slope = _friction(limit, speed, w[_RATE * width + lane])[1]
            slope += forces.law[law + DAMPING * width + lane]
            for i in range(ROWS):
                for j in range(ROWS):
                    product = w[(_GRADIENT + i) * width + lane] * w[(_GRADIENT + j) * width + lane]
                    out[start + (ROWS * i + j) * width + lane] = slope * product
