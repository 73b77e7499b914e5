"""Fully parameterised planar ANCF element: two nodes with position and both gradients (r, r_x, r_y).

Omar and Shabana 2001. Cubic in x, linear in y, rectangular when stress free (length L, height h, width b):
r = S1 r1 + S2 r1_x + (1 - x/L) y r1_y + S3 r2 + S4 r2_x + (x/L) y r2_y with the Hermite polynomials S.
St Venant-Kirchhoff material, U = 1/2 int E' C E b dx dy with E = (E11, E22, 2 E12) of (F'F - I)/2.

In the vectors d = (r2 - r1)/L, r1_x, r2_x, n = r1_y, m = r2_y - r1_y the two columns of F are
u + (y/L) m with u = a d + b r1_x + c r2_x, and v = n + (x/L) m. The integral over the section is exact:
with e = (u.u - 1)/2, k = u.m, g = m.m, t = (v.v - 1)/2, s = u.v, q = m.v and the section's moments
<(y/L)^2> = i2, <(y/L)^4> = i4, averages are <E11> = e + i2 g/2, <E11^2> = e^2 + i2 (k^2 + e g) + i4 g^2/4,
E22 = t and <(2 E12)^2> = s^2 + i2 q^2. All six strains are quadratic in the coordinates.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from shoal.mechanics.assembly.affine import Number
from shoal.mechanics.elements import ancf_cable
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import pointer

NODE_COORDINATES = 6
ROWS = 12
COEFFICIENTS = 10

# Rows of the work space: d, r1_x, r2_x, n, m; the same of a second configuration; forces on them; second
# derivatives in (u, m, v).
_X = 0
_AFTER = 10
_FORCE = 20
_HESSIAN = 30


class AncfFull(NamedTuple):
    """Elements of one law.

    table: points along the axis, (points, 6): a, b, c of u, x/L, and the weights on the unit interval of the
    section's and of the axis' energy. rows: x and y of r1, r1_x, r1_y, r2, r2_x, r2_y per element.
    coefficients: 1/L [1/m], (h/L)^2, then b h L C11, C12, C22, C33 [J] of the section and of the axis, per
    element, (10 size, lanes).
    """

    size: int
    points: int
    table: Array
    rows: Index
    coefficients: Array


class Law(NamedTuple):
    """A quadrature and two constitutive laws: of the whole section, and of the axis alone.

    section, axis: which stiffnesses (C11, C12, C22, C33)/E, functions of Poisson's ratio and the shear factor.
    """

    points: int
    section: str
    axis: str


def _stiffness(name: str, poisson: Number, shear: Number) -> tuple[Number, Number, Number, Number]:
    """(C11, C12, C22, C33) over Young's modulus."""
    nu = poisson
    g = shear / (2 * (1 + nu))
    plane = 1 / (1 - nu**2)
    volume = 1 / ((1 + nu) * (1 - 2 * nu))
    return {
        "none": (0 * nu, 0 * nu, 0 * nu, 0 * nu),
        "uncoupled": (1 + 0 * nu, 0 * nu, 1 + 0 * nu, g),
        "coupling": (plane - 1, nu * plane, plane - 1, 0 * nu),
        "plane": (plane, nu * plane, plane, g),
        "volume": ((1 - nu) * volume, nu * volume, (1 - nu) * volume, g),
    }[name]


# Five points are exact: the strains have degree 4 in x, the energy degree 8. In bending the thickness strain
# is constant over a section, so that a coupled law has the bending stiffness C11 I in place of E I.
LAWS: dict[str, Law] = {
    # Plane stress everywhere: bends with E I/(1 - nu^2).
    "plane-stress": Law(points=5, section="plane", axis="none"),
    # The three-dimensional Lame constants used in the plane: bends with E I (1 - nu)/((1 + nu)(1 - 2 nu)).
    "lame": Law(points=5, section="volume", axis="none"),
    # No Poisson coupling over the section, all of it on the axis: bends with E I (Gerstmayr, Matikainen, Mikkola 2008).
    "enhanced": Law(points=5, section="uncoupled", axis="coupling"),
    # Plane stress at two Gauss points: locks less on coarse meshes, has the limit of plane stress, and does not see
    # the stretch and the shear P_2, which neighbours share: two modes without stiffness unless a node's r_x is held.
    "two-point": Law(points=2, section="plane", axis="none"),
}


def quadrature(law: Law) -> Array:
    """The table of a law, (points, 6)."""
    x, weights = np.polynomial.legendre.leggauss(law.points)
    x, weights = (x + 1) / 2, weights / 2
    columns = [6 * x * (1 - x), 1 - 4 * x + 3 * x * x, 3 * x * x - 2 * x, x, weights, weights]
    return np.column_stack(columns)


def coefficients(
    law: Law,
    length: Number,
    height: Number,
    width: Number,
    young: Number,
    poisson: Number,
    shear: Number = 1.0,
) -> list[Number]:
    """The ten numbers of an element [1/m, 1, J ...]; `shear` scales the shear stiffness (1: none, 5/6 ...)."""
    scale = young * width * height * length
    parts = [part for name in (law.section, law.axis) for part in _stiffness(name, poisson, shear)]
    return [1.0 / length, (height / length) ** 2, *[scale * part for part in parts]]


def mass_matrix(density: Number, length: Number, height: Number, width: Number) -> list[list[Number]]:
    """Consistent mass [kg, kg m, kg m^2] on (r1, r1_x, r1_y, r2, r2_x, r2_y), the same for x and y."""
    axis = ancf_cable.mass_matrix(density * width * height, length)
    turning = density * width * height**3 / 12 * length
    none = 0.0 * turning
    full = [[none] * 6 for _ in range(6)]
    for i, to in enumerate((0, 1, 3, 4)):
        for j, other in enumerate((0, 1, 3, 4)):
            full[to][other] = axis[i][j] + none
    full[2][2] = full[5][5] = turning / 3
    full[2][5] = full[5][2] = turning / 6
    return full


def weight(density: Number, length: Number, height: Number, width: Number) -> list[Number]:
    """Consistent load of a unit acceleration [kg, kg m] on the six vectors."""
    first, first_slope, second, second_slope = ancf_cable.weight(density * width * height, length)
    return [first, first_slope, 0.0 * first, second, second_slope, 0.0 * first]


def position_shape(x: Number, y: Number, length: Number) -> list[Number]:
    """Shape functions of the point at the fraction x, y [m] off the axis [1, m, m]."""
    first, first_slope, second, second_slope = ancf_cable.position_shape(x, length)
    none = 0.0 * length
    return [first + 0 * y, first_slope + 0 * y, y * (1 - x) + none, second + 0 * y, second_slope + 0 * y, y * x + none]


def slope_shape(x: Number, y: Number, length: Number) -> list[Number]:
    """Shape functions of r_x at the fraction x, y [m] off the axis [1/m, 1, 1]."""
    first, first_slope, second, second_slope = ancf_cable.slope_shape(x, length)
    turn = y / length + 0 * x
    return [first + 0 * y, first_slope + 0 * y, -turn, second + 0 * y, second_slope + 0 * y, turn]


def straight(length: Number) -> list[Number]:
    """Nodal vectors of an element at rest on the x axis, as complex numbers."""
    none = 0.0 * length
    return [none, 1.0 + none, 1j + none, 1.0 * length, 1.0 + none, 1j + none]


def section_forces(
    law: Law,
    nodal: npt.ArrayLike,
    x: npt.ArrayLike,
    length: float,
    height: float,
    width: float,
    young: float,
    poisson: float,
    shear: float = 1.0,
) -> tuple[Array, Array, Array]:
    """Normal force [N], shear force [N] and bending moment [N m] at the fractions x of an element.

    nodal: complex, (6,) or (6, times); x: (points,). Returns three (points,) or (points, times).
    The force is the one that the part beyond a section exerts on it, int P_1 b dy with P_1 = S11 r_x + S12 r_y
    the first Piola-Kirchhoff stress; N along the tangent of the axis, Q a quarter turn counter-clockwise
    from it. M = int y r_y x P_1 b dy. Strains of a coarse mesh oscillate within an element.
    """
    vectors: Any = np.asarray(nodal, dtype=complex)
    at = np.asarray(x, dtype=float).reshape((-1, 1) if vectors.ndim > 1 else (-1,))
    u = sum(s * v for s, v in zip(slope_shape(at, 0.0 * at, length), vectors, strict=True))
    v = (1 - at) * vectors[2] + at * vectors[5]
    turn = (vectors[5] - vectors[2]) / length

    def dot(first: Any, second: Any) -> Any:
        return np.real(np.conj(first) * second)

    c11, c12, _, c33 = (young * part for part in _stiffness(law.section, poisson, shear))
    a11, a12, _, a33 = (young * part for part in _stiffness(law.axis, poisson, shear))
    i2, i4 = height**2 / 12, height**4 / 80
    e, k, g, t, s, q = (dot(u, u) - 1) / 2, dot(u, turn), dot(turn, turn), (dot(v, v) - 1) / 2, dot(u, v), dot(turn, v)
    area = width * height
    normal = (c11 + a11) * e + (c12 + a12) * t + c11 * i2 * g / 2
    bending = c11 * i2 * k
    squared = c11 * (i2 * e + i4 * g / 2) + c12 * i2 * t  # int y^2 S11
    force = area * (normal * u + bending * turn + (c33 + a33) * s * v)
    couple = area * (bending * u + squared * turn + c33 * i2 * q * v)
    along = u / np.abs(u)
    return np.real(np.conj(along) * force), np.imag(np.conj(along) * force), np.imag(np.conj(v) * couple)


@njit(cache=True, error_model="numpy", forceinline=True)
def raw(family: AncfFull) -> AncfFull:
    """The same elements with pointers in place of arrays."""
    return AncfFull(
        family.size, family.points, pointer(family.table), pointer(family.rows), pointer(family.coefficients)
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _gather(tile: Tile, family: AncfFull, number: int, z: Array, w: Array, first: int) -> None:
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
def _scatter(tile: Tile, family: AncfFull, number: int, w: Array, f: Array) -> None:
    """Subtract the derivatives of the energy, in the force rows of w, from the rows of f."""
    width = len(tile)
    base = COEFFICIENTS * number * width
    for component in range(2):
        at = ROWS * number + component
        r1, x1, y1 = family.rows[at] * width, family.rows[at + 2] * width, family.rows[at + 4] * width
        r2, x2, y2 = family.rows[at + 6] * width, family.rows[at + 8] * width, family.rows[at + 10] * width
        source = (_FORCE + component) * width
        for lane in range(width):
            value = w[source + lane] * family.coefficients[base + lane]
            f[r1 + lane] += value
            f[r2 + lane] -= value
            f[x1 + lane] -= w[source + 2 * width + lane]
            f[x2 + lane] -= w[source + 4 * width + lane]
            value = w[source + 8 * width + lane]
            f[y1 + lane] -= w[source + 6 * width + lane] - value
            f[y2 + lane] -= value


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def _strains(ux, uy, vx, vy, mx, my):  # type: ignore[no-untyped-def]
    """e, k, g, t, s, q."""
    return (
        0.5 * (ux * ux + uy * uy) - 0.5,
        ux * mx + uy * my,
        mx * mx + my * my,
        0.5 * (vx * vx + vy * vy) - 0.5,
        ux * vx + uy * vy,
        mx * vx + my * vy,
    )


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def _force_points(tile: Tile, mean: bool, family: AncfFull, number: int, w: Array) -> None:
    """The derivatives of the energy into the force rows of w; `mean` is a constant where this is called.

    mean: derivatives of the strains half-way between two configurations, times the mean of their stresses.
    """
    width = len(tile)
    base = COEFFICIENTS * number * width
    c, out, after = family.coefficients, _FORCE * width, _AFTER * width
    for i in range(out, out + 10 * width):
        w[i] = 0.0
    for point in range(family.points):
        row = 6 * point
        a, b, d, x = family.table[row], family.table[row + 1], family.table[row + 2], family.table[row + 3]
        section, axis = family.table[row + 4], family.table[row + 5]
        for lane in range(width):
            mx, my = w[8 * width + lane], w[9 * width + lane]
            ux = a * w[lane] + b * w[2 * width + lane] + d * w[4 * width + lane]
            uy = a * w[width + lane] + b * w[3 * width + lane] + d * w[5 * width + lane]
            vx, vy = w[6 * width + lane] + x * mx, w[7 * width + lane] + x * my
            e, k, g, t, s, q = _strains(ux, uy, vx, vy, mx, my)
            if mean:
                lx, ly = w[after + 8 * width + lane], w[after + 9 * width + lane]
                wx = a * w[after + lane] + b * w[after + 2 * width + lane] + d * w[after + 4 * width + lane]
                wy = a * w[after + width + lane] + b * w[after + 3 * width + lane] + d * w[after + 5 * width + lane]
                zx, zy = w[after + 6 * width + lane] + x * lx, w[after + 7 * width + lane] + x * ly
                e_, k_, g_, t_, s_, q_ = _strains(wx, wy, zx, zy, lx, ly)
                e, k, g = 0.5 * (e + e_), 0.5 * (k + k_), 0.5 * (g + g_)
                t, s, q = 0.5 * (t + t_), 0.5 * (s + s_), 0.5 * (q + q_)
                ux, uy, vx, vy = 0.5 * (ux + wx), 0.5 * (uy + wy), 0.5 * (vx + zx), 0.5 * (vy + zy)
                mx, my = 0.5 * (mx + lx), 0.5 * (my + ly)
            i2 = c[base + width + lane] / 12.0
            i4 = i2 * i2 * 1.8
            b11, b12 = section * c[base + 2 * width + lane], section * c[base + 3 * width + lane]
            b33 = section * c[base + 5 * width + lane]
            t11, t12 = b11 + axis * c[base + 6 * width + lane], b12 + axis * c[base + 7 * width + lane]
            t22 = section * c[base + 4 * width + lane] + axis * c[base + 8 * width + lane]
            # Derivatives of the energy in e, k, g (twice), t, s, q.
            normal = t11 * e + t12 * t + 0.5 * b11 * i2 * g
            bending = b11 * i2 * k
            squared = b11 * (i2 * e + 0.5 * i4 * g) + b12 * i2 * t
            thick = t12 * e + 0.5 * b12 * i2 * g + t22 * t
            shear = (b33 + axis * c[base + 9 * width + lane]) * s
            taper = b33 * i2 * q
            gx, gy = normal * ux + bending * mx + shear * vx, normal * uy + bending * my + shear * vy
            hx, hy = thick * vx + shear * ux + taper * mx, thick * vy + shear * uy + taper * my
            w[out + lane] += a * gx
            w[out + width + lane] += a * gy
            w[out + 2 * width + lane] += b * gx
            w[out + 3 * width + lane] += b * gy
            w[out + 4 * width + lane] += d * gx
            w[out + 5 * width + lane] += d * gy
            w[out + 6 * width + lane] += hx
            w[out + 7 * width + lane] += hy
            w[out + 8 * width + lane] += bending * ux + squared * mx + taper * vx + x * hx
            w[out + 9 * width + lane] += bending * uy + squared * my + taper * vy + x * hy


@njit(cache=True, error_model="numpy")
def add_force(tile: Tile, family: AncfFull, z: Array, f: Array, w: Array) -> None:
    """Add the elastic force -dU/dz [N, N m] to f (rows, lanes); w: work space of 64 rows. Pointers."""
    for number in range(family.size):
        _gather(tile, family, number, z, w, _X)
        _force_points(tile, False, family, number, w)
        _scatter(tile, family, number, w, f)


@njit(cache=True, error_model="numpy")
def add_mean_force(tile: Tile, family: AncfFull, before: Array, after: Array, f: Array, w: Array) -> None:
    """Add the force whose work over a step is exactly the loss of energy: f.(after - before) = U(before) - U(after).

    Simo and Tarnow 1992: the strains' derivatives half-way, times the mean of the stresses at both ends.
    before, after: coordinates, (rows, lanes); w: work space of 64 rows. Pointers.
    """
    for number in range(family.size):
        _gather(tile, family, number, before, w, _X)
        _gather(tile, family, number, after, w, _AFTER)
        _force_points(tile, True, family, number, w)
        _scatter(tile, family, number, w, f)


@njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "arcp"})
def add_energy(tile: Tile, family: AncfFull, z: Array, w: Array, energy: Array, row: int) -> None:
    """Add the strain energy [J] to a row of energy; w: work space of 64 rows. Pointers."""
    width = len(tile)
    c = family.coefficients
    for number in range(family.size):
        _gather(tile, family, number, z, w, _X)
        base = COEFFICIENTS * number * width
        for point in range(family.points):
            r = 6 * point
            a, b, d, x = family.table[r], family.table[r + 1], family.table[r + 2], family.table[r + 3]
            section, axis = family.table[r + 4], family.table[r + 5]
            for lane in range(width):
                mx, my = w[8 * width + lane], w[9 * width + lane]
                ux = a * w[lane] + b * w[2 * width + lane] + d * w[4 * width + lane]
                uy = a * w[width + lane] + b * w[3 * width + lane] + d * w[5 * width + lane]
                vx, vy = w[6 * width + lane] + x * mx, w[7 * width + lane] + x * my
                e, k, g, t, s, q = _strains(ux, uy, vx, vy, mx, my)
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
def _hessian(tile: Tile, family: AncfFull, number: int, point: int, w: Array) -> None:
    """Second derivatives of the energy of a point in (u, m, v), m and v independent, 6 x 6 rows of w; the half i <= j.

    Blocks in the order of (u, m, v): 4 rows each, uu, um, uv, mm, mv, vv.
    """
    width = len(tile)
    base = COEFFICIENTS * number * width
    c = family.coefficients
    r = 6 * point
    a, b, d, x = family.table[r], family.table[r + 1], family.table[r + 2], family.table[r + 3]
    section, axis = family.table[r + 4], family.table[r + 5]
    for lane in range(width):
        mx, my = w[8 * width + lane], w[9 * width + lane]
        ux = a * w[lane] + b * w[2 * width + lane] + d * w[4 * width + lane]
        uy = a * w[width + lane] + b * w[3 * width + lane] + d * w[5 * width + lane]
        vx, vy = w[6 * width + lane] + x * mx, w[7 * width + lane] + x * my
        e, k, g, t, s, q = _strains(ux, uy, vx, vy, mx, my)
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
def tangent(tile: Tile, family: AncfFull, z: Array, w: Array, out: Array, first: int) -> None:
    """Stiffness d2U/dz2 of every element; rows of out from `first` on: (144 size, lanes), 12 x 12 blocks, row-major.

    w: work space of 64 rows. Pointers.
    """
    for number in range(family.size):
        _gather(tile, family, number, z, w, _X)
        block = first + ROWS * ROWS * number
        for i in range(block * len(tile), (block + ROWS * ROWS) * len(tile)):
            out[i] = 0.0
        for point in range(family.points):
            _hessian(tile, family, number, point, w)
            r = 6 * point
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
def _complete(tile: Tile, family: AncfFull, number: int, out: Array, block: int) -> None:
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
