"""Stiffness and damping of beam elements of any order, with the quadrature as a table; see `beam`.

As the forces, written for values of `simd`, whose lanes are simulations or elements (`batch`).
"""

from __future__ import annotations

from numba import njit

from shoal.compile.simd import EIGHT, load, root, spread, store
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.batch import coefficient, put, rest, together
from shoal.mechanics.elements.families import PLAN, Family
from shoal.mechanics.elements.nodal import gather, part_of
from shoal.mechanics.numerics.tile import Array, Tile

# Vectors of the work space: one of `batch`; scaled vectors; factors of nodal vectors; blocks (a_i, d_i) H (a_j, d_j);
# behind these the ten numbers of H of every point.
_X, _FACTOR, _BLOCK, _HESSIAN = 1, 11, 17, 10


@njit(error_model="numpy", forceinline=True)
def _curve(table, at, inner, w):  # type: ignore[no-untyped-def]
    """p = r' and c = L r'' at a point of the table."""
    px = spread(EIGHT, 0.0)
    py, cx, cy = px, px, px
    for k in range(inner):
        x, y = load(EIGHT, w, len(EIGHT) * (_X + 2 * k)), load(EIGHT, w, len(EIGHT) * (_X + 2 * k + 1))
        a, d = table[at + k], table[at + inner + k]
        px, py, cx, cy = px + a * x, py + a * y, cx + d * x, cy + d * y
    return px, py, cx, cy


@njit(error_model="numpy", forceinline=True)
def _stretched(viscous, px, py, relaxed, axial):  # type: ignore[no-untyped-def]
    """xx, xy, yy of the second derivative by p of the stretching energy at a point, or of its damping matrix."""
    shrink = 1.0 / root(px * px + py * py)
    # (|p|/|p0| - 1)^2 |p0|/2 bends by 1/|p0| along p and by eps/|p| across it.
    along, across = axial * relaxed, axial * (relaxed - shrink)
    if viscous:
        across = 0.0 * shrink
    tx, ty, both = px * shrink, py * shrink, along - across
    return both * tx * tx + across, both * tx * ty, both * ty * ty + across


@njit(error_model="numpy", forceinline=True)
def _bent(viscous, px, py, cx, cy, relaxed, angle, bending):  # type: ignore[no-untyped-def]
    """The same of the bending energy by p, and by (p, c): xx, xy, yx, yy, and c: xx, xy, yy."""
    flat, stiffness = 1.0 / (px * px + py * py), bending * relaxed
    k = (px * cy - py * cx) * flat
    moment = stiffness * (k - angle)
    if viscous:
        moment = 0.0 * k
    # With a, b the gradient of k: d2k/dp2 = -2 (p a' + a p' + k I)/|p|^2, d2k/dpdc = ((0, 1; -1, 0) - 2 p b')/|p|^2.
    ax, ay, bx, by = (cy - 2.0 * k * px) * flat, (-cx - 2.0 * k * py) * flat, -py * flat, px * flat
    first, mixed = -2.0 * moment * flat, moment * flat
    by_p = (
        stiffness * ax * ax + first * (2.0 * px * ax + k),
        stiffness * ax * ay + first * (px * ay + ax * py),
        stiffness * ay * ay + first * (2.0 * py * ay + k),
    )
    others = (
        stiffness * ax * bx + first * px * bx,
        stiffness * ax * by + first * px * by + mixed,
        stiffness * ay * bx + first * py * bx - mixed,
        stiffness * ay * by + first * py * by,
        stiffness * bx * bx,
        stiffness * bx * by,
        stiffness * by * by,
    )
    return by_p, others


@njit(error_model="numpy", forceinline=True)
def _put_hessian(w, point, numbers):  # type: ignore[no-untyped-def]
    """Keep the numbers of a point."""
    for k in range(len(numbers)):
        store(w, len(EIGHT) * (point + k), numbers[k])


@njit(error_model="numpy", forceinline=True)
def _sum(table, at, points, inner, i, j, w, hessian, block):  # type: ignore[no-untyped-def]
    """The block (a_i, d_i) H (a_j, d_j), summed over the points; without bending H has three numbers."""
    xx = spread(EIGHT, 0.0)
    xy, yx, yy = xx, xx, xx
    for g in range(points):
        row, h = at + 2 * (inner + 1) * g, len(EIGHT) * (hessian + _HESSIAN * g)
        a, b = table[row + i], table[row + j]
        ab, mixed = a * b, load(EIGHT, w, h + len(EIGHT))
        xx = xx + ab * load(EIGHT, w, h)
        xy = xy + ab * mixed
        yx = yx + ab * mixed
        yy = yy + ab * load(EIGHT, w, h + 2 * len(EIGHT))
        if table[row + 2 * inner + 1] != 0.0:
            d, e = table[row + inner + i], table[row + inner + j]
            ae, db, de, mixed = a * e, d * b, d * e, load(EIGHT, w, h + 8 * len(EIGHT))
            pxy, pyx = load(EIGHT, w, h + 4 * len(EIGHT)), load(EIGHT, w, h + 5 * len(EIGHT))
            xx = xx + ((ae + db) * load(EIGHT, w, h + 3 * len(EIGHT)) + de * load(EIGHT, w, h + 7 * len(EIGHT)))
            xy = xy + (ae * pxy + db * pyx + de * mixed)
            yx = yx + (ae * pyx + db * pxy + de * mixed)
            yy = yy + ((ae + db) * load(EIGHT, w, h + 6 * len(EIGHT)) + de * load(EIGHT, w, h + 9 * len(EIGHT)))
    store(w, block, xx)
    store(w, block + len(EIGHT), xy)
    store(w, block + 2 * len(EIGHT), yx)
    store(w, block + 3 * len(EIGHT), yy)


@njit(error_model="numpy", forceinline=True)
def _write(tile, vectors, number, lane, count, w, out, first):  # type: ignore[no-untyped-def]
    """From second derivatives in X to those in the nodal vectors, all entries, to the blocks of `count` elements."""
    order, side, inner = vectors // 2, 2 * vectors, vectors - 1
    for one in range(vectors):
        i = part_of(order, one)
        for other in range(vectors):
            j = part_of(order, other)
            low, high = min(i, j), max(i, j)
            block = _BLOCK + 4 * (low * inner - low * (low - 1) // 2 + high - low)
            factor = load(EIGHT, w, len(EIGHT) * (_FACTOR + one)) * load(EIGHT, w, len(EIGHT) * (_FACTOR + other))
            for m in range(2):
                for n in range(2):
                    value = factor * load(EIGHT, w, len(EIGHT) * (block + (2 * m + n if i <= j else 2 * n + m)))
                    put(tile, lane, count, w, out, first + side * (2 * one + m) + 2 * other + n, side * side, value)


@njit(error_model="numpy", forceinline=True)
def _blocks(tile: Tile, viscous: bool, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """Sum over the points of (a_i, d_i) H (a_j, d_j); H: second derivative in (p, c), or the damping matrix there."""
    vectors = family.side // 2
    inner, side = vectors - 1, family.side
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
            ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
            ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
            if viscous:
                eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
                ea, ei = ea * eta, ei * eta
            gather(tile, 2, vectors, family, number, lane, inverse, z, w, _X, _FACTOR)
            hessian, points = _BLOCK + 2 * inner * vectors, family.plan[PLAN * number + 1]
            table, at = family.table, side * family.plan[PLAN * number]
            for g in range(points):
                row = at + side * g
                axial, bending = table[row + 2 * inner], table[row + 2 * inner + 1]
                px, py, cx, cy = _curve(table, row, inner, w)
                relaxed = rest(tile, family, number, lane, 2 * g)
                by_p = _stretched(viscous, px, py, relaxed, axial * ea)
                if bending != 0.0:
                    angle = rest(tile, family, number, lane, 2 * g + 1)
                    more, others = _bent(viscous, px, py, cx, cy, relaxed, angle, bending * ei)
                    by_p = (by_p[0] + more[0], by_p[1] + more[1], by_p[2] + more[2])
                    _put_hessian(w, hessian + _HESSIAN * g + 3, others)
                _put_hessian(w, hessian + _HESSIAN * g, by_p)
            block = len(EIGHT) * _BLOCK
            for i in range(inner):
                for j in range(i, inner):
                    _sum(table, at, points, inner, i, j, w, hessian, block)
                    block += 4 * len(EIGHT)
            _write(tile, vectors, number, lane, count, w, out, first + side * side * number)
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.tangent`."""
    _blocks(tile, False, family, z, w, out, first)


@njit(cache=True, error_model="numpy")
def viscosity(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.damping`."""
    _blocks(tile, True, family, z, w, out, first)
