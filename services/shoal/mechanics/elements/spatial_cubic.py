"""The force of the cubic element in space; theory in `spatial`, nodes and polynomials as in `cubic`.

All that the energy depends on are the six dot products of c0, c1 and c2. A and C are polynomials of xi with these as
coefficients, and B = dA/dxi. What a strain contributes to dU/dc_i is sums over the points, of powers of xi times its
derivatives by A/2 (n_j), by B, which adds to n_j, and by C/2 (t_j).
Berzeri and Shabana 2000; Gerstmayr and Shabana 2006; with the reduced rule, Gerstmayr and Irschik 2008.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT, inverse_root, reciprocal, spread
from shoal.errors import InputError
from shoal.mechanics.elements import beam, spatial
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, coordinate, of_one_variant
from shoal.mechanics.elements.cubic import FULL_RULE, REDUCED_RULE
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.spatial import bend
from shoal.mechanics.elements.strain import stretch
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS = spatial.DIMENSIONS * beam.CUBIC
FULL, REDUCED, DAMPED = range(3)
"""Variants: elastic by either rule; damped by the full one."""


class SpatialCubics(Family):
    """Cubic elements in space. rows: x, y and z of r1, r1', r2, r2'. coefficients: as in `beam`."""


_GAUSS = np.polynomial.legendre.leggauss
_FULL_AXIAL, _FULL_BENDING = beam.pairs(*_GAUSS(5)), beam.pairs(*_GAUSS(3))
_REDUCED_AXIAL = beam.pairs(np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3)
_REDUCED_BENDING = beam.pairs(*_GAUSS(2))


@njit(error_model="numpy", forceinline=True)
def _at_both(x, a0, a1, a2, a3, a4):  # type: ignore[no-untyped-def]
    """A polynomial of xi at +xi and at -xi."""
    square = x * x
    even, odd = a0 + square * a2 + (square * square) * a4, x * (a1 + square * a3)
    return even + odd, even - odd


@njit(error_model="numpy", forceinline=True)
def _component(tile, family, number, lane, inverse, k, z):  # type: ignore[no-untyped-def]
    """c0, c1 and c2 in one direction, 0 to 2."""
    r1, p1 = coordinate(tile, family, number, lane, ROWS, k, z), coordinate(tile, family, number, lane, ROWS, 3 + k, z)
    r2 = coordinate(tile, family, number, lane, ROWS, 6 + k, z)
    p2 = coordinate(tile, family, number, lane, ROWS, 9 + k, z)
    d, s = 1.5 * (r2 - r1) * inverse, p1 + p2
    return d - 0.25 * s, 0.5 * (p2 - p1), 0.75 * s - d


@njit(error_model="numpy", forceinline=True)
def _dot(i, j, x, y, v, dx, dy, dv):  # type: ignore[no-untyped-def]
    """The dot product of the i-th coefficient of one curve and the j-th of another."""
    return x[i] * dx[j] + y[i] * dy[j] + v[i] * dv[j]


@njit(error_model="numpy", forceinline=True)
def _nodal(inverse, c, n0, n1, n2, e11, e12, e22):  # type: ignore[no-untyped-def]
    """The force in one direction on r1, r1', r2, r2'."""
    g, h, i = (
        n0 * c[0] + n1 * c[1] + n2 * c[2],
        0.5 * (n1 * c[0] + e11 * c[1] + e12 * c[2]),
        n2 * c[0] + e12 * c[1] + e22 * c[2],
    )
    d, e = 1.5 * (g - i) * inverse, 0.25 * g - 0.75 * i
    return d, e + h, -d, e - h


@njit(error_model="numpy", forceinline=True)
def _force(
    tile: Tile,
    damped: bool,
    axial: Array,
    bending: Array,
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
    """Add the force of `count` elements to f; damped and the rules are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    none, one, eta = spread(EIGHT, 0.0), spread(EIGHT, 1.0), spread(EIGHT, 0.0)
    x = _component(tile, family, number, lane, inverse, 0, z)
    y = _component(tile, family, number, lane, inverse, 1, z)
    v = _component(tile, family, number, lane, inverse, 2, z)
    c11, c12, c22 = _dot(1, 1, x, y, v, x, y, v), _dot(1, 2, x, y, v, x, y, v), _dot(2, 2, x, y, v, x, y, v)
    s0, s1 = _dot(0, 0, x, y, v, x, y, v), 2.0 * _dot(0, 1, x, y, v, x, y, v)
    s2, s3, s4 = 2.0 * _dot(0, 2, x, y, v, x, y, v) + c11, 2.0 * c12, c22
    k0, k1, k2 = 4.0 * c11, 16.0 * c12, 16.0 * c22
    p0, p1, p2, p3, p4, l0, l1, l2 = none, none, none, none, none, none, none, none
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        a = _component(tile, family, number, lane, inverse, 0, zdot)
        b = _component(tile, family, number, lane, inverse, 1, zdot)
        c = _component(tile, family, number, lane, inverse, 2, zdot)
        p0, p4 = _dot(0, 0, x, y, v, a, b, c), _dot(2, 2, x, y, v, a, b, c)
        p1 = _dot(0, 1, x, y, v, a, b, c) + _dot(1, 0, x, y, v, a, b, c)
        p3 = _dot(1, 2, x, y, v, a, b, c) + _dot(2, 1, x, y, v, a, b, c)
        l0, l1, l2 = _dot(1, 1, x, y, v, a, b, c), 8.0 * p3, 16.0 * p4
        p2 = _dot(0, 2, x, y, v, a, b, c) + _dot(2, 0, x, y, v, a, b, c) + l0
        l0 = 4.0 * l0
    # In the middle both strains share the root.
    middle, shrink = axial.shape[0] - 1, inverse_root(s0)
    n0, lost = stretch(damped, shrink, p0, one, ea * axial[middle, 1], eta)
    n1, n2, n3, n4, t0, t1, t2 = none, none, none, none, none, none, none
    for g in range(middle):
        xi, square = axial[g, 0], axial[g, 0] * axial[g, 0]
        here, there = _at_both(xi, s0, s1, s2, s3, s4)
        rate, other = _at_both(xi, p0, p1, p2, p3, p4)
        first, power_first = stretch(damped, inverse_root(here), rate, one, ea * axial[g, 1], eta)
        second, power_second = stretch(damped, inverse_root(there), other, one, ea * axial[g, 1], eta)
        lost = lost + (power_first + power_second)
        even, odd = first + second, xi * (first - second)
        n0, n1, n2 = n0 + even, n1 + odd, n2 + square * even
        n3, n4 = n3 + square * odd, n4 + (square * square) * even
    last = bending.shape[0] - 1
    if bending[last, 1] != 0.0:
        by_a, by_b, by_c, more = bend(damped, shrink * shrink, s1, k0, p0, 2.0 * p1, l0, ei * bending[last, 1], eta)
        n0, n1, t0, lost = n0 + by_a, n1 + 2.0 * by_b, t0 + by_c, lost + more
    for g in range(last):
        xi, square = bending[g, 0], bending[g, 0] * bending[g, 0]
        here, there = _at_both(xi, s0, s1, s2, s3, s4)
        b, b_there = _at_both(xi, s1, 2.0 * s2, 3.0 * s3, 4.0 * s4, none)
        c, c_there = _at_both(xi, k0, k1, k2, none, none)
        rate, other = _at_both(xi, p0, p1, p2, p3, p4)
        turning, twisting = _at_both(xi, 2.0 * p1, 4.0 * p2, 6.0 * p3, 8.0 * p4, none)
        change, changing = _at_both(xi, l0, l1, l2, none, none)
        by_a, by_b, by_c, more = bend(damped, reciprocal(here), b, c, rate, turning, change, ei * bending[g, 1], eta)
        of_a, of_b, of_c, most = bend(
            damped, reciprocal(there), b_there, c_there, other, twisting, changing, ei * bending[g, 1], eta
        )
        lost = lost + (more + most)
        even, odd, up, down = by_a + of_a, xi * (by_a - of_a), 2.0 * (by_b + of_b), (4.0 * xi) * (by_b - of_b)
        n0, n1, n2 = n0 + even, n1 + odd + up, n2 + square * even + down
        n3, n4 = n3 + square * (odd + 3.0 * up), n4 + square * (square * even + 2.0 * down)
        even = by_c + of_c
        t0, t1, t2 = t0 + even, t1 + xi * (by_c - of_c), t2 + square * even
    e11, e12, e22 = n2 + 4.0 * t0, n3 + 8.0 * t1, n4 + 16.0 * t2
    x1, x2, x3, x4 = _nodal(inverse, x, n0, n1, n2, e11, e12, e22)
    y1, y2, y3, y4 = _nodal(inverse, y, n0, n1, n2, e11, e12, e22)
    v1, v2, v3, v4 = _nodal(inverse, v, n0, n1, n2, e11, e12, e22)
    add_rows(tile, family, number, lane, count, w, f, (x1, y1, v1, x2, y2, v2, x3, y3, v3, x4, y4, v4))
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(error_model="numpy", forceinline=True)
def _forces(tile, damped, axial, bending, family, number, members, z, zdot, f, w, power):  # type: ignore[no-untyped-def]
    """Add the forces of `members` elements of one variant, with its constants prepared once."""
    count = members if len(tile) == 1 else 1
    for first in range(number, number + members, count):
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            _force(tile, damped, axial, bending, family, first, count, lane, z, zdot, f, w, power)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, zdot, f, w, power
        if variant == REDUCED:
            _forces(tile, False, _REDUCED_AXIAL, _REDUCED_BENDING, *at)
        elif variant == DAMPED and moving:
            _forces(tile, True, _FULL_AXIAL, _FULL_BENDING, *at)
        else:
            _forces(tile, False, _FULL_AXIAL, _FULL_BENDING, *at)
        number += members


implement(
    SpatialCubics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=spatial.potential,
    stiffness=spatial.stiffness,
    viscosity=spatial.viscosity,
)


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    reduced, damped = rod.quadrature == "reduced", bool(np.any(rod.retardation))
    if reduced and damped:
        raise InputError("quadrature: a damped ancf-cable has the full quadrature")
    variant = REDUCED if reduced else DAMPED if damped else FULL
    return spatial.part(REDUCED_RULE if reduced else FULL_RULE, variant, rod, section, length)


ELEMENT = spatial.element(beam.CUBIC, SpatialCubics, _part)
