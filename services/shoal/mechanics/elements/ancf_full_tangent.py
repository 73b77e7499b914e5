"""Strains, energy and stiffness of the fully parameterised element; the theory is that of `ancf_full`."""

from __future__ import annotations

from numba import njit

from shoal.mechanics.elements.families import PLAN, Family
from shoal.mechanics.numerics.tile import Array, Tile

ROWS = 12
COEFFICIENTS = 10

# Rows of the work space: d, r1_x, r2_x, n, m; second derivatives in (u, m, v).
_X, _HESSIAN = 0, 30


@njit(cache=True, error_model="numpy", forceinline=True)
def gather(tile: Tile, family: Family, number: int, z: Array, w: Array, first: int) -> None:
    """The vectors d, r1_x, r2_x, n, m of an element into rows of w from `first` on."""
    width = len(tile)
    base = COEFFICIENTS * number * width
    for component in range(2):
        at = ROWS * number + component
        r1, x1, y1 = family.rows[at] * width, family.rows[at + 2] * width, family.rows[at + 4] * width
        r2, x2, y2 = family.rows[at + 6] * width, family.rows[at + 8] * width, family.rows[at + 10] * width
        to = (first + component) * width
        for lane in range(width):
            w[to + lane] = (z[r2 + lane] - z[r1 + lane]) * family.coefficients[base + lane]
            w[to + 2 * width + lane] = z[x1 + lane]
            w[to + 4 * width + lane] = z[x2 + lane]
            w[to + 6 * width + lane] = z[y1 + lane]
            w[to + 8 * width + lane] = z[y2 + lane] - z[y1 + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def columns(w, at, a, b, d, x, width, lane):  # type: ignore[no-untyped-def]
    """u, v and m at a point of a configuration whose rows begin at `at`."""
    mx, my = w[at + 8 * width + lane], w[at + 9 * width + lane]
    ux = a * w[at + lane] + b * w[at + 2 * width + lane] + d * w[at + 4 * width + lane]
    uy = a * w[at + width + lane] + b * w[at + 3 * width + lane] + d * w[at + 5 * width + lane]
    return ux, uy, w[at + 6 * width + lane] + x * mx, w[at + 7 * width + lane] + x * my, mx, my


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def strains(ux, uy, vx, vy, mx, my):  # type: ignore[no-untyped-def]
    """e, k, g, t, s, q."""
    return (
        0.5 * (ux * ux + uy * uy) - 0.5,
        ux * mx + uy * my,
        mx * mx + my * my,
        0.5 * (vx * vx + vy * vy) - 0.5,
        ux * vx + uy * vy,
        mx * vx + my * vy,
    )


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def energy(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    width = len(tile)
    c = family.coefficients
    for number in range(family.size):
        gather(tile, family, number, z, w, _X)
        base = COEFFICIENTS * number * width
        for point in range(family.plan[PLAN * number + 1]):
            r = 6 * (family.plan[PLAN * number] + point)
            a, b, d, x = family.table[r], family.table[r + 1], family.table[r + 2], family.table[r + 3]
            section, axis = family.table[r + 4], family.table[r + 5]
            for lane in range(width):
                ux, uy, vx, vy, mx, my = columns(w, 0, a, b, d, x, width, lane)
                e, k, g, t, s, q = strains(ux, uy, vx, vy, mx, my)
                i2 = c[base + width + lane] / 12.0
                i4 = i2 * i2 * 1.8
                mixed = c[base + 3 * width + lane] * t
                along = c[base + 2 * width + lane] * (e * e + i2 * (k * k + e * g) + 0.25 * i4 * g * g)
                shear = c[base + 5 * width + lane] * (s * s + i2 * q * q)
                whole = along + 2.0 * mixed * (e + 0.5 * i2 * g) + c[base + 4 * width + lane] * t * t + shear
                inner = (c[base + 6 * width + lane] * e + 2.0 * c[base + 7 * width + lane] * t) * e
                inner += c[base + 8 * width + lane] * t * t + c[base + 9 * width + lane] * s * s
                energy[row * width + lane] += 0.5 * (section * whole + axis * inner)


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def _hessian(tile: Tile, family: Family, number: int, point: int, w: Array) -> None:
    """Second derivatives of the energy of a point in (u, m, v), m and v independent, 6 x 6 rows of w; the half i <= j.

    Blocks in the order of (u, m, v): 4 rows each, uu, um, uv, mm, mv, vv.
    """
    width = len(tile)
    base = COEFFICIENTS * number * width
    c = family.coefficients
    r = 6 * (family.plan[PLAN * number] + point)
    a, b, d, x = family.table[r], family.table[r + 1], family.table[r + 2], family.table[r + 3]
    section, axis = family.table[r + 4], family.table[r + 5]
    for lane in range(width):
        ux, uy, vx, vy, mx, my = columns(w, 0, a, b, d, x, width, lane)
        e, k, g, t, s, q = strains(ux, uy, vx, vy, mx, my)
        i2 = c[base + width + lane] / 12.0
        i4 = i2 * i2 * 1.8
        b11, b12 = section * c[base + 2 * width + lane], section * c[base + 3 * width + lane]
        b33 = section * c[base + 5 * width + lane]
        t11, t12 = b11 + axis * c[base + 6 * width + lane], b12 + axis * c[base + 7 * width + lane]
        t22 = section * c[base + 4 * width + lane] + axis * c[base + 8 * width + lane]
        t33 = b33 + axis * c[base + 9 * width + lane]
        j11, j12, j33, k11 = b11 * i2, b12 * i2, b33 * i2, b11 * i4
        normal = t11 * e + t12 * t + 0.5 * j11 * g
        squared = j11 * e + 0.5 * k11 * g + j12 * t
        thick = t12 * e + 0.5 * j12 * g + t22 * t
        h = _HESSIAN * width + lane
        w[h] = normal + t11 * ux * ux + j11 * mx * mx + t33 * vx * vx
        w[h + width] = t11 * ux * uy + j11 * mx * my + t33 * vx * vy
        w[h + 2 * width] = w[h + width]
        w[h + 3 * width] = normal + t11 * uy * uy + j11 * my * my + t33 * vy * vy
        w[h + 4 * width] = j11 * (k + 2.0 * ux * mx)
        w[h + 5 * width] = j11 * (ux * my + mx * uy)
        w[h + 6 * width] = w[h + 5 * width]
        w[h + 7 * width] = j11 * (k + 2.0 * uy * my)
        w[h + 8 * width] = t33 * s + (t12 + t33) * ux * vx
        w[h + 9 * width] = t12 * ux * vy + t33 * vx * uy
        w[h + 10 * width] = t12 * uy * vx + t33 * vy * ux
        w[h + 11 * width] = t33 * s + (t12 + t33) * uy * vy
        w[h + 12 * width] = squared + j11 * ux * ux + k11 * mx * mx + j33 * vx * vx
        w[h + 13 * width] = j11 * ux * uy + k11 * mx * my + j33 * vx * vy
        w[h + 14 * width] = w[h + 13 * width]
        w[h + 15 * width] = squared + j11 * uy * uy + k11 * my * my + j33 * vy * vy
        w[h + 16 * width] = j33 * q + (j12 + j33) * mx * vx
        w[h + 17 * width] = j12 * mx * vy + j33 * vx * my
        w[h + 18 * width] = j12 * my * vx + j33 * vy * mx
        w[h + 19 * width] = j33 * q + (j12 + j33) * my * vy
        w[h + 20 * width] = thick + t22 * vx * vx + t33 * ux * ux + j33 * mx * mx
        w[h + 21 * width] = t22 * vx * vy + t33 * ux * uy + j33 * mx * my
        w[h + 22 * width] = w[h + 21 * width]
        w[h + 23 * width] = thick + t22 * vy * vy + t33 * uy * uy + j33 * my * my


# Where the six blocks of `_hessian` start, by the two vectors of (u, m, v), first <= second.
_UU, _UM, _UV, _MM, _MV, _VV = 0, 4, 8, 12, 16, 20
# The places of d, r1_x, r2_x, n, m among the six nodal vectors while the tangent is assembled.
_D, _P, _Q, _N, _M = 3, 1, 4, 2, 5


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_block(
    tile: Tile, out: Array, block: int, i: int, j: int, factor: float, w: Array, hessian: int, turned: bool
) -> None:
    """Add factor times a 2 x 2 block of w (transposed if turned) at the nodal vectors i, j of an element."""
    width = len(tile)
    for m in range(2):
        for n in range(2):
            to = (block + ROWS * (2 * i + m) + 2 * j + n) * width
            source = (_HESSIAN + hessian + (2 * n + m if turned else 2 * m + n)) * width
            for lane in range(width):
                out[to + lane] += factor * w[source + lane]


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int, viscous: bool) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (144 size, lanes), 12 x 12 blocks, row-major.

    w: work space of 64 rows. Pointers.
    """
    for number in range(family.size):
        gather(tile, family, number, z, w, _X)
        block = first + ROWS * ROWS * number
        for i in range(block * len(tile), (block + ROWS * ROWS) * len(tile)):
            out[i] = 0.0
        for point in range(family.plan[PLAN * number + 1]):
            _hessian(tile, family, number, point, w)
            r = 6 * (family.plan[PLAN * number] + point)
            x = family.table[r + 3]
            for i in range(3):
                row, a = (_D, _P, _Q)[i], family.table[r + i]
                for j in range(i, 3):
                    _add_block(tile, out, block, row, (_D, _P, _Q)[j], a * family.table[r + j], w, _UU, False)
                _add_block(tile, out, block, row, _N, a, w, _UV, False)
                _add_block(tile, out, block, row, _M, a, w, _UM, False)
                _add_block(tile, out, block, row, _M, a * x, w, _UV, False)
            _add_block(tile, out, block, _N, _N, 1.0, w, _VV, False)
            _add_block(tile, out, block, _N, _M, x, w, _VV, False)
            _add_block(tile, out, block, _N, _M, 1.0, w, _MV, True)
            _add_block(tile, out, block, _M, _M, 1.0, w, _MM, False)
            _add_block(tile, out, block, _M, _M, x, w, _MV, False)
            _add_block(tile, out, block, _M, _M, x, w, _MV, True)
            _add_block(tile, out, block, _M, _M, x * x, w, _VV, False)
        _complete(tile, family, number, out, block)


@njit(cache=True, error_model="numpy")
def _complete(tile: Tile, family: Family, number: int, out: Array, block: int) -> None:
    """From second derivatives in d, r1_x, r2_x, n, m to those in the nodal vectors, all entries."""
    width = len(tile)
    base = COEFFICIENTS * number * width
    order = (_D, _P, _Q, _N, _M)
    for i in range(5):
        for j in range(i, 5):
            for m in range(2):
                for n in range(m if i == j else 0, 2):
                    to = (block + ROWS * (2 * order[i] + m) + 2 * order[j] + n) * width
                    mirror = (block + ROWS * (2 * order[j] + n) + 2 * order[i] + m) * width
                    for lane in range(width):
                        value = out[to + lane]
                        if i == 0:
                            value *= family.coefficients[base + lane]
                        if j == 0:
                            value *= family.coefficients[base + lane]
                        out[to + lane] = value
                        out[mirror + lane] = value
    # r1 = -(what moves r2); r1_y also moves m backwards. Columns, then rows.
    for k in range(2, ROWS):
        for m in range(2):
            r1, r2 = (block + ROWS * k + m) * width, (block + ROWS * k + 6 + m) * width
            y1, y2 = (block + ROWS * k + 4 + m) * width, (block + ROWS * k + 10 + m) * width
            for lane in range(width):
                out[r1 + lane] = -out[r2 + lane]
                out[y1 + lane] -= out[y2 + lane]
    for k in range(ROWS):
        for m in range(2):
            r1, r2 = (block + ROWS * m + k) * width, (block + ROWS * (6 + m) + k) * width
            y1, y2 = (block + ROWS * (4 + m) + k) * width, (block + ROWS * (10 + m) + k) * width
            for lane in range(width):
                out[r1 + lane] = -out[r2 + lane]
                out[y1 + lane] -= out[y2 + lane]
