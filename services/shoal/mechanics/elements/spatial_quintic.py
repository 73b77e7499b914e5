"""The force of the quintic element in space; theory in `spatial`, nodes and polynomials as in `quintic`."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT, inverse_root, reciprocal, spread
from shoal.mechanics.elements import beam, spatial
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, of_one_variant
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.quintic import at_both, collect, component, nodal, recommended
from shoal.mechanics.elements.spatial import bend
from shoal.mechanics.elements.strain import stretch
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS = spatial.DIMENSIONS * beam.QUINTIC
FOUR, FOUR_DAMPED, FIVE, FIVE_DAMPED = range(4)
"""Variants: the points of the rule; elastic, damped."""


class SpatialQuintics(Family):
    """Quintic elements in space. rows: x, y and z of r1, r1', r1'', r2, r2', r2''. coefficients: as in `beam`."""


_GAUSS = np.polynomial.legendre.leggauss
_FOUR_PAIRS, _FIVE_PAIRS = beam.pairs(*_GAUSS(4)), beam.pairs(*_GAUSS(5))


@njit(error_model="numpy", forceinline=True)
def _dot(u, v):  # type: ignore[no-untyped-def]
    """The dot product of two vectors of space."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(error_model="numpy", forceinline=True)
def _point(damped, p, c, u, v, axial, bending, eta):  # type: ignore[no-untyped-def]
    """Derivatives of the energy by p and by c at a point, and the power lost; u, v: rates of p and c."""
    square, rate = _dot(p, p), _dot(p, u)
    shrink = inverse_root(square)
    flat = shrink * shrink
    n, lost = stretch(damped, shrink, rate, spread(EIGHT, 1.0), axial, eta)
    turning, change = _dot(p, v) + _dot(c, u), _dot(c, v)
    by_a, m, by_c, more = bend(damped, flat, _dot(p, c), _dot(c, c), rate, turning, change, bending, eta)
    n = n + by_a
    g = n * p[0] + m * c[0], n * p[1] + m * c[1], n * p[2] + m * c[2]
    h = m * p[0] + by_c * c[0], m * p[1] + by_c * c[1], m * p[2] + by_c * c[2]
    return g, h, lost + more


@njit(error_model="numpy", forceinline=True)
def _force(
    tile: Tile,
    damped: bool,
    pairs: Array,
    family: Family,
    number: int,
    count: int,
    lane: int,
    z: Array,
    zdot: Array,
    f: Array,
    w: Array,
    power: Array,
) -> None:
    """Add the force of `count` elements to f; damped and the rule are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    length, none = reciprocal(inverse), spread(EIGHT, 0.0)
    eta, lost, still = none, none, (none, none, none, none, none)
    x = component(tile, family, number, lane, ROWS, inverse, length, 0, z)
    y = component(tile, family, number, lane, ROWS, inverse, length, 1, z)
    a = component(tile, family, number, lane, ROWS, inverse, length, 2, z)
    dx, dy, da, sx, sy, sa = still, still, still, still, still, still
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        dx = component(tile, family, number, lane, ROWS, inverse, length, 0, zdot)
        dy = component(tile, family, number, lane, ROWS, inverse, length, 1, zdot)
        da = component(tile, family, number, lane, ROWS, inverse, length, 2, zdot)
    last = pairs.shape[0] - 1
    for k in range(last):
        xi, axial, bending = pairs[k, 0], ea * pairs[k, 1], ei * pairs[k, 1]
        px, qx, cx, ex = at_both(xi, x)
        py, qy, cy, ey = at_both(xi, y)
        pa, qa, ca, ec = at_both(xi, a)
        ux, tx, vx, wx = at_both(xi, dx)
        uy, ty, vy, wy = at_both(xi, dy)
        ua, ta, va, wa = at_both(xi, da)
        g, h, one = _point(damped, (px, py, pa), (cx, cy, ca), (ux, uy, ua), (vx, vy, va), axial, bending, eta)
        i, j, two = _point(damped, (qx, qy, qa), (ex, ey, ec), (tx, ty, ta), (wx, wy, wa), axial, bending, eta)
        sx = collect(xi, g[0], i[0], h[0], j[0], sx)
        sy = collect(xi, g[1], i[1], h[1], j[1], sy)
        sa = collect(xi, g[2], i[2], h[2], j[2], sa)
        lost = lost + (one + two)
    if pairs[last, 1] != 0.0:
        p, c = (x[0], y[0], a[0]), (2.0 * x[1], 2.0 * y[1], 2.0 * a[1])
        u, v = (dx[0], dy[0], da[0]), (2.0 * dx[1], 2.0 * dy[1], 2.0 * da[1])
        g, h, one = _point(damped, p, c, u, v, ea * pairs[last, 1], ei * pairs[last, 1], eta)
        sx = (sx[0] + g[0], sx[1] + 2.0 * h[0], sx[2], sx[3], sx[4])
        sy = (sy[0] + g[1], sy[1] + 2.0 * h[1], sy[2], sy[3], sy[4])
        sa = (sa[0] + g[2], sa[1] + 2.0 * h[2], sa[2], sa[3], sa[4])
        lost = lost + one
    x1, x2, x3, x4, x5, x6 = nodal(inverse, length, sx)
    y1, y2, y3, y4, y5, y6 = nodal(inverse, length, sy)
    a1, a2, a3, a4, a5, a6 = nodal(inverse, length, sa)
    values = (x1, y1, a1, x2, y2, a2, x3, y3, a3, x4, y4, a4, x5, y5, a5, x6, y6, a6)
    add_rows(tile, family, number, lane, count, w, f, values)
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(error_model="numpy", forceinline=True)
def _forces(tile, damped, rule, family, number, members, z, zdot, f, w, power):  # type: ignore[no-untyped-def]
    """Add the forces of `members` elements of one variant, with its constants prepared once."""
    count = members if len(tile) == 1 else 1
    for first in range(number, number + members, count):
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            _force(tile, damped, rule, family, first, count, lane, z, zdot, f, w, power)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, zdot, f, w, power
        if variant == FOUR_DAMPED and moving:
            _forces(tile, True, _FOUR_PAIRS, *at)
        elif variant == FIVE_DAMPED and moving:
            _forces(tile, True, _FIVE_PAIRS, *at)
        elif variant in (FOUR, FOUR_DAMPED):
            _forces(tile, False, _FOUR_PAIRS, *at)
        else:
            _forces(tile, False, _FIVE_PAIRS, *at)
        number += members


implement(
    SpatialQuintics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=spatial.potential,
    stiffness=spatial.stiffness,
    viscosity=spatial.viscosity,
)


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    rule = recommended(rod.elements)
    variant = (FOUR if len(rule) == 4 else FIVE) + int(bool(np.any(rod.retardation)))
    return spatial.part(rule, variant, rod, section, length)


ELEMENT = spatial.element(beam.QUINTIC, SpatialQuintics, _part)
