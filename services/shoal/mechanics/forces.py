"""Springs, dampers, friction and motors: a scalar measure g(z) and a law F(g, g', t), acting as F dg/dz.

With x = g - g0 the law is F = -[k x + k3 x^3 + table(x)] - [(c + c2 |g'|) g' + F_c tanh(g'/v_s)] + amplitude drive(t):
elastic, dissipated and supplied. The tanh smooths Coulomb's law (Andersson, Soederberg, Bjoerklund 2007).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.vector import add_product, clear, copy
from shoal.mechanics import plane
from shoal.mechanics.functions import Functions, evaluate, excess
from shoal.mechanics.numerics.tile import Array, Index, Tile

DISTANCE, ANGLE, PLACE = 0, 1, 2
"""Measures: |b - a| [m] of two points; the angle [rad] of the plane from direction a to direction b, over any number of
turns (in space: about an axis at right angles to both, d being a turned about it by 90 degrees); where point b lies
relative to point a along direction d, (b - a).d/|d| [m]."""

STIFFNESS, CUBIC, DAMPING, NATURAL, COULOMB, SPEED, AMPLITUDE, DRAG = range(8)
LAW = 8

_TURN = 2.0 * np.pi


class Forces(NamedTuple):
    """Force elements of one tile.

    dimensions: of vectors, here d. kind: DISTANCE, ANGLE or PLACE. rows: 3 d an element, of (a, b, d);
    where d is not used, any valid rows. Directions need not be unit vectors. table: function of x, the elastic force
    [N or N m], and energy, its antiderivative; drive: function of time; -1 for none. law: (8 * elements, lanes), eight
    rows an element: stiffness k, cubic k3, damping c, natural value g0, Coulomb limit F_c, Coulomb speed v_s (matters
    and must be positive where F_c is not 0), amplitude of the drive, drag c2.
    """

    dimensions: int
    size: int
    kind: Index
    rows: Index
    table: Index
    energy: Index
    drive: Index
    law: Array


# Rows of the work space: coordinates of a, b, d; gradient of g in them; g or x; g'; the elastic force.


@njit(cache=True, forceinline=True)
def side(forces: Forces) -> int:
    """Rows of one element, 3 d."""
    return 3 * forces.dimensions


@njit(cache=True, forceinline=True)
def value_row(forces: Forces) -> int:
    """Return the row of x of `measure`; g' and the elastic force follow it."""
    rows: int = 2 * side(forces)
    return rows


def initial_memory(tile: Tile, forces: Forces, z: Array, intended: Array) -> Array:
    """The memory with which a motion begins, flat (elements, lanes).

    z: flat coordinates, derived rows filled; intended: angles [rad], flat (elements, lanes), from which the whole
    turns are taken (the rest follows from z), so that a spring can be wound up at the start.
    """
    d = forces.dimensions
    rows, at = forces.rows.reshape(-1, 3 * d), z.reshape(-1, len(tile))
    first, second = (np.stack([at[rows[:, k]], at[rows[:, k + 1]]]) for k in (0, d))
    if d == plane.DIMENSIONS:
        angle = np.asarray(plane.angle(second) - plane.angle(first))
    else:
        ahead = at[rows[:, 2 * d : 3 * d]]
        first, second = (at[rows[:, k : k + d]] for k in (0, d))
        angle = np.arctan2(np.sum(ahead * second, axis=1), np.sum(first * second, axis=1))
    angle -= _TURN * np.rint(angle / _TURN)
    memory = angle + _TURN * np.rint((intended.reshape(angle.shape) - angle) / _TURN)
    return np.where(forces.kind[:, None] == ANGLE, memory, 0.0).ravel()


@njit(cache=True, error_model="numpy", forceinline=True)
def _angle(ax, ay, bx, by, last):  # type: ignore[no-untyped-def]
    """The angle from a to b that is nearest to the last one."""
    change = np.arctan2(ax * by - ay * bx, ax * bx + ay * by) - last
    return last + (change - _TURN * np.floor(change / _TURN + 0.5))


@njit(cache=True, error_model="numpy", forceinline=True)
def _turned(width: int, lane: int, w: Array) -> tuple[float, float]:
    """In space, with a, b and d in w: b.a and b.d, which are r cos and r sin of the angle."""
    x, y = 0.0, 0.0
    for k in range(3):
        b = w[(3 + k) * width + lane]
        x += b * w[k * width + lane]
        y += b * w[(6 + k) * width + lane]
    return x, y


@njit(cache=True, error_model="numpy", forceinline=True)
def _gradient_of_turn(width: int, lane: int, w: Array) -> None:
    """In space: the gradient (x dy - y dx)/r^2 of the angle, into w."""
    x, y = _turned(width, lane, w)
    square = x * x + y * y
    for k in range(3):
        a, b, ahead = w[k * width + lane], w[(3 + k) * width + lane], w[(6 + k) * width + lane]
        w[(9 + k) * width + lane] = -y * b / square
        w[(12 + k) * width + lane] = (x * ahead - y * a) / square
        w[(15 + k) * width + lane] = x * b / square


@njit(cache=True, error_model="numpy")
def _bend_turn(width: int, lane: int, elastic: float, w: Array, out: Array, base: int) -> None:
    """In space: add F times the second derivatives of an angle to a block.

    With x = a.b, y = d.b and g = atan2(y, x): g_xx = -g_yy = 2xy/r^4, g_xy = (y^2 - x^2)/r^4, times the derivatives of
    x and y, and g_x, g_y where a or d meets b.
    """
    x, y = _turned(width, lane, w)
    square = x * x + y * y
    xx, xy = 2.0 * x * y / (square * square), (y * y - x * x) / (square * square)
    for i in range(9):
        for j in range(9):
            # x depends on a by b and on b by a; y on b by d and on d by b.
            xi = w[(3 + i) * width + lane] if i < 3 else w[(i - 3) * width + lane] if i < 6 else 0.0
            xj = w[(3 + j) * width + lane] if j < 3 else w[(j - 3) * width + lane] if j < 6 else 0.0
            yi = 0.0 if i < 3 else w[(i + 3) * width + lane] if i < 6 else w[(i - 3) * width + lane]
            yj = 0.0 if j < 3 else w[(j + 3) * width + lane] if j < 6 else w[(j - 3) * width + lane]
            value = xx * (xi * xj - yi * yj) + xy * (xi * yj + yi * xj)
            if abs(i - j) == 3:
                value += (-y if min(i, j) < 3 else x) / square
            out[base + (9 * i + j) * width] += elastic * value


@njit(cache=True, error_model="numpy")
def remember(tile: Tile, forces: Forces, z: Array, memory: Array) -> None:
    """Follow the angles after a step of less than half a turn; memory: (elements, lanes). Pointers."""
    width, d = len(tile), forces.dimensions
    for number in range(forces.size):
        if forces.kind[number] == ANGLE and d == 3:
            first = 9 * number
            for lane in range(width):
                slot, x, y = number * width + lane, 0.0, 0.0
                for k in range(3):
                    b = z[forces.rows[first + 3 + k] * width + lane]
                    x += b * z[forces.rows[first + k] * width + lane]
                    y += b * z[forces.rows[first + 6 + k] * width + lane]
                memory[slot] = _angle(1.0, 0.0, x, y, memory[slot])
        elif forces.kind[number] == ANGLE:
            first = side(forces) * number
            ax, ay = forces.rows[first] * width, forces.rows[first + 1] * width
            bx, by = forces.rows[first + d] * width, forces.rows[first + d + 1] * width
            for lane in range(width):
                slot = number * width + lane
                memory[slot] = _angle(z[ax + lane], z[ay + lane], z[bx + lane], z[by + lane], memory[slot])


@njit(cache=True, error_model="numpy")
def gradient(tile: Tile, forces: Forces, number: int, z: Array, w: Array) -> None:
    """Coordinates, dg/dz and, but for the turns of an angle, g of an element into w."""
    width, d, rows = len(tile), forces.dimensions, side(forces)
    kind = forces.kind[number]
    for k in range(rows):
        copy(tile, w, k, z, forces.rows[rows * number + k])
        clear(tile, w, rows + k)
    for lane in range(width):
        out, value = rows * width + lane, 0.0
        if kind == ANGLE and d == 3:
            _gradient_of_turn(width, lane, w)
        elif kind == ANGLE:
            ax, ay, bx, by = w[lane], w[width + lane], w[d * width + lane], w[(d + 1) * width + lane]
            a, b = 1.0 / (ax * ax + ay * ay), 1.0 / (bx * bx + by * by)
            w[out], w[out + width] = ay * a, -ax * a
            w[out + d * width], w[out + (d + 1) * width] = -by * b, bx * b
        else:
            # n is along b - a, or along d.
            square = 0.0
            for k in range(d):
                n = w[(2 * d + k) * width + lane] if kind == PLACE else w[(d + k) * width + lane] - w[k * width + lane]
                w[out + (d + k) * width] = n
                square += n * n
            size = np.sqrt(square)
            inverse = 1.0 / size if size > 0.0 else 0.0
            for k in range(d):
                n = w[out + (d + k) * width] * inverse
                w[out + k * width], w[out + (d + k) * width] = -n, n
                value += (w[(d + k) * width + lane] - w[k * width + lane]) * n
            if kind == DISTANCE:
                value = size
            else:
                for k in range(d):
                    across = w[(d + k) * width + lane] - w[k * width + lane] - value * w[out + (d + k) * width]
                    w[out + (2 * d + k) * width] = across * inverse
        w[value_row(forces) * width + lane] = value


@njit(cache=True, error_model="numpy")
def measure(tile: Tile, forces: Forces, number: int, z: Array, memory: Array, w: Array) -> None:
    """Compute `gradient` with x = g - g0 in place of g."""
    width, d = len(tile), forces.dimensions
    gradient(tile, forces, number, z, w)
    natural, row = (LAW * number + NATURAL) * width, value_row(forces) * width
    for lane in range(width):
        value = w[row + lane]
        if forces.kind[number] == ANGLE:
            last = memory[number * width + lane]
            if d == 3:
                x, y = _turned(width, lane, w)
                value = _angle(1.0, 0.0, x, y, last)
            else:
                value = _angle(w[lane], w[width + lane], w[d * width + lane], w[(d + 1) * width + lane], last)
        w[row + lane] = value - forces.law[natural + lane]


@njit(cache=True, error_model="numpy")
def slip(tile: Tile, forces: Forces, number: int, zdot: Array, w: Array) -> None:
    """g' from the gradient in w."""
    rows, rate = side(forces), value_row(forces) + 1
    clear(tile, w, rate)
    for k in range(rows):
        add_product(tile, w, rate, w, rows + k, zdot, forces.rows[rows * number + k])


@njit(cache=True, error_model="numpy", forceinline=True)
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

    memory: (elements, lanes); w: work space of 6 d + 3 rows; moving: whether damping, friction and drives count, or the
    elastic part alone. A distance of zero has no direction and exerts no force. Pointers.
    """
    width, rows, value = len(tile), side(forces), value_row(forces)
    at, rating, elastically = value * width, (value + 1) * width, (value + 2) * width
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        drive = 0.0
        if moving:
            slip(tile, forces, number, zdot, w)
            drive = evaluate(functions, forces.drive[number], t, 0)
        else:
            for lane in range(width):
                w[rating + lane] = 0.0
        law = LAW * number * width
        for lane in range(width):
            x, rate = w[at + lane], w[rating + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            elastic = (k + k3 * x * x) * x + evaluate(functions, forces.table[number], x, 0)
            limit, speed = forces.law[law + COULOMB * width + lane], forces.law[law + SPEED * width + lane]
            viscous = forces.law[law + DAMPING * width + lane] + forces.law[law + DRAG * width + lane] * abs(rate)
            resisting = viscous * rate + _friction(limit, speed, rate)[0]
            resisting -= forces.law[law + AMPLITUDE * width + lane] * drive
            power[lane] += resisting * rate
            w[elastically + lane] = -elastic - resisting
        for k in range(rows):
            add_product(tile, f, forces.rows[rows * number + k], w, value + 2, w, rows + k)


@njit(cache=True, error_model="numpy")
def add_energy(
    tile: Tile, forces: Forces, functions: Functions, z: Array, memory: Array, w: Array, energy: Array, row: int
) -> None:
    """Add the elastic energy [J] to a row of energy; w: work space of 6 d + 3 rows. Pointers."""
    width = len(tile)
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        law = LAW * number * width
        table = forces.table[number]
        for lane in range(width):
            x = w[value_row(forces) * width + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            stored = evaluate(functions, forces.energy[number], x, 0)
            # Beyond its range the table's force holds, so that the energy grows with the way.
            stored += evaluate(functions, table, x, 0) * excess(functions, table, x)
            energy[row * width + lane] += (0.5 * k + 0.25 * k3 * x * x) * x * x + stored


@njit(cache=True, error_model="numpy")
def tangent(
    tile: Tile, forces: Forces, functions: Functions, z: Array, memory: Array, w: Array, out: Array, first: int
) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (elements * side^2, lanes), square blocks.

    A block refers to the places of the element's row list, also where rows repeat; it is not positive definite in
    general. w: work space of 6 d + 3 rows. Pointers.
    """
    width, d, rows = len(tile), forces.dimensions, side(forces)
    for number in range(forces.size):
        measure(tile, forces, number, z, memory, w)
        kind, table = forces.kind[number], forces.table[number]
        law = LAW * number * width
        start = (first + rows * rows * number) * width
        for lane in range(width):
            x = w[value_row(forces) * width + lane]
            k, k3 = forces.law[law + STIFFNESS * width + lane], forces.law[law + CUBIC * width + lane]
            elastic = (k + k3 * x * x) * x + evaluate(functions, table, x, 0)
            slope = k + 3.0 * k3 * x * x + evaluate(functions, table, x, 1)
            base = start + lane
            for i in range(rows):
                for j in range(rows):
                    product = w[(rows + i) * width + lane] * w[(rows + j) * width + lane]
                    out[base + (rows * i + j) * width] = slope * product
            if kind == ANGLE and d == 3:
                _bend_turn(width, lane, elastic, w, out, base)
            elif kind == ANGLE:
                # Of atan2(y, x): xy/r^4 [[2, .], [., -2]] and (y^2 - x^2)/r^4 off the diagonal.
                for end in range(2):
                    vx, vy = w[end * d * width + lane], w[(end * d + 1) * width + lane]
                    square = vx * vx + vy * vy
                    scale = (elastic if end == 1 else -elastic) / (square * square)
                    corner = base + (rows + 1) * end * d * width
                    out[corner] += 2.0 * scale * vx * vy
                    out[corner + width] += scale * (vy * vy - vx * vx)
                    out[corner + rows * width] += scale * (vy * vy - vx * vx)
                    out[corner + (rows + 1) * width] -= 2.0 * scale * vx * vy
            else:
                _bend(width, d, lane, kind, elastic, slope, w, out, base)


@njit(cache=True, error_model="numpy")
def _bend(
    width: int, d: int, lane: int, kind: int, elastic: float, slope: float, w: Array, out: Array, base: int
) -> None:
    """Add F times the second derivatives of a distance, or of a place along a direction, to a block.

    With n the unit vector and P = 1 - n n': of a distance P/|u|, at |u| = 0 the limit for a spring that is relaxed
    there, F' 1. Of a place g = u.n, n = d/|d|: P/|d| between the points and d, -(r n' + n r' + g P)/|d|^2 in d, with
    r = u - g n.
    """
    rows = 3 * d
    n = (rows + d) * width + lane
    size, along = 0.0, 0.0
    for k in range(d):
        u = w[(d + k) * width + lane] - w[k * width + lane]
        part = w[(2 * d + k) * width + lane] if kind == PLACE else u
        size += part * part
        along += u * w[n + k * width]
    size = np.sqrt(size)
    relaxed = slope if elastic == 0.0 else 0.0
    inverse = 1.0 / size if size > 0.0 else 0.0
    for i in range(d):
        for j in range(d):
            same = 1.0 if i == j else 0.0
            normal = same - w[n + i * width] * w[n + j * width]
            if kind == DISTANCE:
                value = elastic * inverse * normal if size > 0.0 else relaxed * normal
                for one in range(2):
                    for other in range(2):
                        at = base + (rows * (one * d + i) + other * d + j) * width
                        out[at] += value if one == other else -value
            else:
                value = elastic * inverse * normal
                for end in range(2):
                    signed = value if end == 1 else -value
                    out[base + (rows * (end * d + i) + 2 * d + j) * width] += signed
                    out[base + (rows * (2 * d + i) + end * d + j) * width] += signed
                # The gradient in d is r/|d|.
                first, second = w[(rows + 2 * d + i) * width + lane], w[(rows + 2 * d + j) * width + lane]
                bent = (first * w[n + j * width] + w[n + i * width] * second) * inverse + along * normal * inverse**2
                out[base + (rows * (2 * d + i) + 2 * d + j) * width] -= elastic * bent


@njit(cache=True, error_model="numpy")
def damping(tile: Tile, forces: Forces, z: Array, zdot: Array, w: Array, out: Array, first: int) -> None:
    """Damping -dF/dzdot, [c + 2 c2 |g'| + F_c/v_s sech^2(g'/v_s)] dg/dz dg/dz', in blocks as in `tangent`. Pointers."""
    width, rows = len(tile), side(forces)
    for number in range(forces.size):
        gradient(tile, forces, number, z, w)
        slip(tile, forces, number, zdot, w)
        law = LAW * number * width
        start = (first + rows * rows * number) * width
        for lane in range(width):
            limit, speed = forces.law[law + COULOMB * width + lane], forces.law[law + SPEED * width + lane]
            rate = w[(value_row(forces) + 1) * width + lane]
            slope = forces.law[law + DAMPING * width + lane] + 2.0 * forces.law[law + DRAG * width + lane] * abs(rate)
            slope += _friction(limit, speed, rate)[1]
            for i in range(rows):
                for j in range(rows):
                    product = w[(rows + i) * width + lane] * w[(rows + j) * width + lane]
                    out[start + (rows * i + j) * width + lane] = slope * product
