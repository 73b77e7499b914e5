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

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import plane
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.ancf_full_tangent import COEFFICIENTS, ROWS, columns, energy, gather, stiffness, strains
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

# Rows of the work space: d, r1_x, r2_x, n, m; the same of a second configuration; forces on them.
_X, _AFTER, _FORCE = 0, 10, 20


class Solids(Family):
    """Fully parameterised elements. rows: x and y of r1, r1_x, r1_y, r2, r2_x, r2_y.

    table: points along the axis, (points, 6): a, b, c of u, x/L, and the weights on the unit interval of the
    section's and of the axis' energy. coefficients: 1/L [1/m], (h/L)^2, then b h L C11, C12, C22, C33 [J] of the
    section and of the axis.
    """


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
    law: Law, length: Number, height: Number, width: Number, young: Number, poisson: Number, shear: Number = 1.0
) -> list[Number]:
    """The ten numbers of an element [1/m, 1, J ...]; `shear` scales the shear stiffness (1: none, 5/6 ...)."""
    scale = young * width * height * length
    parts = [part for name in (law.section, law.axis) for part in _stiffness(name, poisson, shear)]
    return [1.0 / length, (height / length) ** 2, *[scale * part for part in parts]]


def mass_matrix(density: Number, length: Number, height: Number, width: Number) -> list[list[Number]]:
    """Consistent mass [kg, kg m, kg m^2] on (r1, r1_x, r1_y, r2, r2_x, r2_y), the same for x and y."""
    axis = beam.mass_matrix(beam.CUBIC, density * width * height, length)
    turning = density * width * height**3 / 12 * length
    none = 0.0 * turning
    full = [[none] * 6 for _ in range(6)]
    for i, to in enumerate((0, 1, 3, 4)):
        for j, other in enumerate((0, 1, 3, 4)):
            full[to][other] = axis[i][j] + none
    full[2][2] = full[5][5] = turning / 3
    full[2][5] = full[5][2] = turning / 6
    return full


def weight(line: Number, length: Number) -> list[Number]:
    """Consistent load of a unit acceleration [kg, kg m] on the six vectors."""
    first, first_slope, second, second_slope = beam.weight(beam.CUBIC, line, length)
    return [first, first_slope, 0.0 * first, second, second_slope, 0.0 * first]


def position_shape(x: Number, y: Number, length: Number) -> list[Number]:
    """Shape functions of the point at the fraction x, y [m] off the axis [1, m, m]."""
    first, first_slope, second, second_slope = beam.shape(beam.CUBIC, x, length, 0)
    none = 0.0 * length
    return [first + 0 * y, first_slope + 0 * y, y * (1 - x) + none, second + 0 * y, second_slope + 0 * y, y * x + none]


@njit(cache=True, error_model="numpy", forceinline=True)
def _scatter(tile: Tile, family: Family, number: int, w: Array, f: Array) -> None:
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
def _force_points(tile: Tile, mean: bool, family: Family, number: int, w: Array) -> None:
    """The derivatives of the energy into the force rows of w; `mean` is a constant where this is called.

    mean: derivatives of the strains half-way between two configurations, times the mean of their stresses.
    """
    width = len(tile)
    base = COEFFICIENTS * number * width
    c, out, after = family.coefficients, _FORCE * width, _AFTER * width
    for i in range(out, out + 10 * width):
        w[i] = 0.0
    for point in range(family.plan[PLAN * number + 1]):
        row = 6 * (family.plan[PLAN * number] + point)
        a, b, d, x = family.table[row], family.table[row + 1], family.table[row + 2], family.table[row + 3]
        section, axis = family.table[row + 4], family.table[row + 5]
        for lane in range(width):
            ux, uy, vx, vy, mx, my = columns(w, 0, a, b, d, x, width, lane)
            e, k, g, t, s, q = strains(ux, uy, vx, vy, mx, my)
            if mean:
                wx, wy, zx, zy, lx, ly = columns(w, after, a, b, d, x, width, lane)
                e_, k_, g_, t_, s_, q_ = strains(wx, wy, zx, zy, lx, ly)
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
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    for number in range(family.size):
        gather(tile, family, number, z, w, _X)
        _force_points(tile, False, family, number, w)
        _scatter(tile, family, number, w, f)


@njit(cache=True, error_model="numpy")
def mean(tile: Tile, family: Family, before: Array, after: Array, f: Array, w: Array) -> None:
    """Add the force whose work over a step is exactly the loss of energy: f.(after - before) = U(before) - U(after).

    Simo and Tarnow 1992: the strains' derivatives half-way, times the mean of the stresses at both ends.
    before, after: coordinates, (rows, lanes); w: work space of 64 rows. Pointers.
    """
    for number in range(family.size):
        gather(tile, family, number, before, w, _X)
        gather(tile, family, number, after, w, _AFTER)
        _force_points(tile, True, family, number, w)
        _scatter(tile, family, number, w, f)


implement(Solids, Kernel(ROWS, COEFFICIENTS, 2), force=force, potential=energy, stiffness=stiffness, mean=mean)


def _direction_shape(x: Number, y: Number, length: Number) -> list[Number]:
    """The section's direction r_y."""
    zero = 0.0 * length
    return [zero, zero, 1 - x + zero, zero, zero, x + zero]


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    law = LAWS[rod.law]
    numbers = coefficients(law, length, section.height, section.width, rod.youngs_modulus, rod.poisson_ratio)
    return Entry(quadrature(law), 0, False, numbers, [])


ELEMENT = Element(
    family=Solids,
    nodal_vectors=lambda rod, s: [plane.vector(1.0 + 0.0 * s, 0.0), plane.vector(0.0 * s, 1.0)],
    position_shape=position_shape,
    direction_shape=_direction_shape,
    mass=lambda density, section, length: mass_matrix(density, length, section.height, section.width),
    weight=lambda line, length: weight(line, length),
    part=_part,
    clamped=1,
    normal=True,
)
