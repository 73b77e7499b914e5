"""Stiffness and damping of beam elements of any order, with the quadrature as a table; see `beam`."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.elements import beam
from shoal.mechanics.elements.families import PLAN, Family
from shoal.mechanics.numerics.tile import Array, Tile

# Rows of the work space: scaled vectors; second derivatives in (p, c).
_X, _HESSIAN = 0, 30


@njit(cache=True, error_model="numpy", forceinline=True)
def gather(tile: Tile, vectors: int, family: Family, number: int, z: Array, w: Array, first: int) -> None:
    """The scaled vectors X of an element into rows of w from `first` on."""
    width = len(tile)
    order = vectors // 2
    base = beam.COEFFICIENTS * number * width
    for component in range(2):
        at = 2 * vectors * number + component
        a, b = family.rows[at] * width, family.rows[at + vectors] * width
        to = (first + component) * width
        for lane in range(width):
            w[to + lane] = (z[b + lane] - z[a + lane]) * family.coefficients[base + lane]
        for node in range(2):
            for j in range(1, order):
                a = family.rows[at + 2 * (node * order + j)] * width
                to = (first + 2 * (node * (order - 1) + j) + component) * width
                if j == 1:
                    for lane in range(width):
                        w[to + lane] = z[a + lane]
                else:
                    for lane in range(width):
                        w[to + lane] = z[a + lane] / family.coefficients[base + lane]


@njit(cache=True, error_model="numpy", inline="always")
def curve(table, at, inner, w, first, width, lane):  # type: ignore[no-untyped-def]
    """p = r' and c = L r'' at a point of the table, of the scaled vectors in rows of w from `first` on."""
    px, py, cx, cy = 0.0, 0.0, 0.0, 0.0
    for k in range(inner):
        a, d = table[at + k], table[at + inner + k]
        x, y = w[(first + 2 * k) * width + lane], w[(first + 2 * k + 1) * width + lane]
        px, py, cx, cy = px + a * x, py + a * y, cx + d * x, cy + d * y
    return px, py, cx, cy


@njit(cache=True, error_model="numpy")
def _blocks(tile: Tile, viscous: bool, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """Sum over the points of (a_i, d_i) H (a_j, d_j), H the second derivative in (p, c), or the damping matrix there.

    Filled at the places of r2 (which stands for X_0) and of the other vectors, for i <= j, then completed.
    """
    width = len(tile)
    vectors = family.side // 2
    inner, order, side = vectors - 1, vectors // 2, family.side
    for number in range(family.size):
        gather(tile, vectors, family, number, z, w, _X)
        block = first + side * side * number
        for i in range(block * width, (block + side * side) * width):
            out[i] = 0.0
        for g in range(family.plan[PLAN * number + 1]):
            _hessian(tile, vectors, viscous, family, number, g, w)
            at = side * (family.plan[PLAN * number] + g)
            for i in range(inner):
                a, d = family.table[at + i], family.table[at + inner + i]
                for j in range(i, inner):
                    b, e = family.table[at + j], family.table[at + inner + j]
                    place = block + 2 * (side * _place(order, i) + _place(order, j))
                    ab, ae, db, de = a * b, a * e, d * b, d * e
                    for m in range(2):
                        for n in range(2):
                            to = (place + side * m + n) * width
                            pp = (_HESSIAN + 4 * m + n) * width
                            pc, cp, cc = pp + 2 * width, pp + 8 * width, pp + 10 * width
                            for lane in range(width):
                                out[to + lane] += (ab * w[pp + lane] + ae * w[pc + lane]) + (
                                    db * w[cp + lane] + de * w[cc + lane]
                                )
        _complete(tile, vectors, family, number, out, block)


@njit(cache=True, error_model="numpy", forceinline=True)
def _place(order: int, k: int) -> int:
    """The nodal vector at whose place X_k is assembled."""
    return order if k == 0 else (k if k < order else k + 1)


@njit(cache=True, error_model="numpy")
def _complete(tile: Tile, vectors: int, family: Family, number: int, out: Array, block: int) -> None:
    """From second derivatives in X to those in the nodal vectors, all entries."""
    width = len(tile)
    order, side = vectors // 2, 2 * vectors
    base = beam.COEFFICIENTS * number * width
    for i in range(1, vectors):
        for j in range(1, vectors):
            # X_0 comes first in the half that was filled.
            filled = i == order or (j != order and i <= j)
            for m in range(2):
                for n in range(m if i == j else 0, 2):
                    to = (block + side * (2 * i + m) + 2 * j + n) * width
                    mirror = (block + side * (2 * j + n) + 2 * i + m) * width
                    if filled:
                        for lane in range(width):
                            inverse = family.coefficients[base + lane]
                            value = out[to + lane]
                            value = value * inverse if i % order == 0 else value
                            value = value * inverse if j % order == 0 else value
                            value = value / inverse if i % order == 2 else value
                            value = value / inverse if j % order == 2 else value
                            out[to + lane] = value
                            out[mirror + lane] = value
    for k in range(2, side):
        for m in range(2):
            right = (block + side * k + 2 * order + m) * width
            left = (block + side * k + m) * width
            below = (block + side * (2 * order + m) + k) * width
            above = (block + side * m + k) * width
            for lane in range(width):
                out[left + lane] = -out[right + lane]
                out[above + lane] = -out[below + lane]
    for m in range(2):
        for n in range(2):
            corner = (block + side * m + n) * width
            opposite = (block + side * (2 * order + m) + 2 * order + n) * width
            for lane in range(width):
                out[corner + lane] = out[opposite + lane]


@njit(cache=True, error_model="numpy")
def _hessian(tile: Tile, vectors: int, viscous: bool, family: Family, number: int, g: int, w: Array) -> None:
    """Second derivatives of the energy of a point in (p, c), or its damping matrix there, into 16 rows of w."""
    width = len(tile)
    inner = vectors - 1
    base = beam.COEFFICIENTS * number * width
    at = 2 * vectors * (family.plan[PLAN * number] + g)
    rest = (family.plan[PLAN * number + 2] + 2 * g) * width
    h = _HESSIAN * width
    for lane in range(width):
        px, py, cx, cy = curve(family.table, at, inner, w, _X, width, lane)
        shrink = 1.0 / np.sqrt(px * px + py * py)
        flat = shrink * shrink
        tx, ty = px * shrink, py * shrink
        inverse = family.reference[rest + lane]
        k_ = (px * cy - py * cx) * flat
        # The gradient of k in (p, c).
        ax, ay, bx, by = (cy - 2.0 * k_ * px) * flat, (-cx - 2.0 * k_ * py) * flat, -py * flat, px * flat
        axial = family.table[at + 2 * inner] * family.coefficients[base + width + lane]
        bending = family.table[at + 2 * inner + 1] * family.coefficients[base + 2 * width + lane] * inverse
        if viscous:
            eta = family.coefficients[base + 3 * width + lane]
            axial, bending = axial * eta, bending * eta
            along, across, moment = axial * inverse, 0.0, 0.0
        else:
            # (|p|/|p0| - 1)^2 |p0|/2 bends by 1/|p0| along p and by eps/|p| across it.
            along, across = axial * inverse, axial * (inverse - shrink)
            moment = bending * (k_ - family.reference[rest + width + lane])
        # With a, b this gradient: d2k/dp2 = -2 (p a' + a p' + k I)/|p|^2, d2k/dpdc = ((0, 1; -1, 0) - 2 p b')/|p|^2.
        first, both = -2.0 * moment * flat, along - across
        pxx = both * tx * tx + across + bending * ax * ax + first * (2.0 * px * ax + k_)
        pxy = both * tx * ty + bending * ax * ay + first * (px * ay + ax * py)
        pyy = both * ty * ty + across + bending * ay * ay + first * (2.0 * py * ay + k_)
        mixed = moment * flat
        xx, xy = bending * ax * bx + first * px * bx, bending * ax * by + first * px * by + mixed
        yx, yy = bending * ay * bx + first * py * bx - mixed, bending * ay * by + first * py * by
        cxx, cxy, cyy = bending * bx * bx, bending * bx * by, bending * by * by
        w[h + lane], w[h + width + lane], w[h + 2 * width + lane], w[h + 3 * width + lane] = pxx, pxy, xx, xy
        w[h + 4 * width + lane], w[h + 5 * width + lane] = pxy, pyy
        w[h + 6 * width + lane], w[h + 7 * width + lane] = yx, yy
        w[h + 8 * width + lane], w[h + 9 * width + lane] = xx, yx
        w[h + 10 * width + lane], w[h + 11 * width + lane] = cxx, cxy
        w[h + 12 * width + lane], w[h + 13 * width + lane] = xy, yy
        w[h + 14 * width + lane], w[h + 15 * width + lane] = cxy, cyy


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.tangent`."""
    _blocks(tile, False, family, z, w, out, first)


@njit(cache=True, error_model="numpy")
def viscosity(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.damping`."""
    _blocks(tile, True, family, z, w, out, first)
