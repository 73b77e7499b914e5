"""The force of the cubic beam element: the one kernel in which most runs spend their time.

The theory is that of `beam`; here its sums are written out for two nodes with position and slope. On xi in [-1, 1]

    r' = c0 + c1 xi + c2 xi^2,    L r'' = 2 (c1 + 2 c2 xi),

so that |r'|^2 and k |r'|^2 = r' x L r'' are polynomials of xi with scalar coefficients. Points come in pairs +-xi that
share their even and odd parts. What a strain contributes to dU/dc_i is sums over the points of its density times powers
of xi: N_j of the derivative by |r'|^2/2, K_j of that by r' x L r''. Straight or curved, elastic or damped, the same
formula serves; its vectors are lanes or elements (`batch`).
Berzeri and Shabana 2000; Gerstmayr and Shabana 2006; with the reduced rule, Gerstmayr and Irschik 2008.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.errors import InputError
from shoal.mechanics.elements import beam, beam_tangent
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, coordinate, rest, together
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.strain import bend, reference, stretch
from shoal.mechanics.numerics.pointers import shift
from shoal.mechanics.numerics.simd import EIGHT, root, spread
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS = 2 * beam.CUBIC
FULL, REDUCED, CURVED, DAMPED = range(4)
"""Variants: straight and elastic by either rule; curved, and curved or not and damped, by the full one."""


class Cubics(Family):
    """Cubic beam elements. rows: x and y of r1, r1', r2, r2'. coefficients, reference: as in `beam`."""


FULL_RULE = beam.quadrature(beam.CUBIC, 5, 3)
REDUCED_RULE = beam.lobatto(beam.CUBIC, 2)


_GAUSS = np.polynomial.legendre.leggauss
_LOBATTO = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3
_FULL_AXIAL, _FULL_BENDING = beam.pairs(*_GAUSS(5)), beam.pairs(*_GAUSS(3))
_REDUCED_AXIAL, _REDUCED_BENDING = beam.pairs(*_LOBATTO), beam.pairs(*_GAUSS(2))
_POINTS, _BENDING_POINTS, _REDUCED_POINTS, _REDUCED_BENDING_POINTS = (
    np.column_stack([points, weights / 2]) for points, weights in (_GAUSS(5), _GAUSS(3), _LOBATTO, _GAUSS(2))
)


@njit(error_model="numpy", forceinline=True)
def _curve(tile, family, number, lane, inverse, z):  # type: ignore[no-untyped-def]
    """c0, c1, c2 of elements in the state z."""
    x1, y1 = coordinate(tile, family, number, lane, ROWS, 0, z), coordinate(tile, family, number, lane, ROWS, 1, z)
    px, py = coordinate(tile, family, number, lane, ROWS, 2, z), coordinate(tile, family, number, lane, ROWS, 3, z)
    x2, y2 = coordinate(tile, family, number, lane, ROWS, 4, z), coordinate(tile, family, number, lane, ROWS, 5, z)
    qx, qy = coordinate(tile, family, number, lane, ROWS, 6, z), coordinate(tile, family, number, lane, ROWS, 7, z)
    dx, dy, sx, sy = 1.5 * (x2 - x1) * inverse, 1.5 * (y2 - y1) * inverse, px + qx, py + qy
    return dx - 0.25 * sx, dy - 0.25 * sy, 0.5 * (qx - px), 0.5 * (qy - py), 0.75 * sx - dx, 0.75 * sy - dy


@njit(error_model="numpy", forceinline=True)
def _dot(ax, ay, bx, by, cx, cy, dx, dy, ex, ey, fx, fy):  # type: ignore[no-untyped-def]
    """Coefficients of (a + b xi + c xi^2) . (d + e xi + f xi^2)."""
    return (
        ax * dx + ay * dy,
        ax * ex + ay * ey + (bx * dx + by * dy),
        ax * fx + ay * fy + (cx * dx + cy * dy) + (bx * ex + by * ey),
        bx * fx + by * fy + (cx * ex + cy * ey),
        cx * fx + cy * fy,
    )


@njit(error_model="numpy", forceinline=True)
def at_both(x, a0, a1, a2, a3, a4):  # type: ignore[no-untyped-def]
    """A polynomial of xi at +xi and at -xi."""
    square = x * x
    even, odd = a0 + square * a2 + (square * square) * a4, x * (a1 + square * a3)
    return even + odd, even - odd


@njit(error_model="numpy", forceinline=True)
def _force(
    tile: Tile,
    curved: bool,
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
    """Add the force of `count` elements to f; curved, damped and the rules are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    none, eta = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    ax, ay, bx, by, cx, cy = _curve(tile, family, number, lane, inverse, z)
    s0, s1, s2, s3, s4 = _dot(ax, ay, bx, by, cx, cy, ax, ay, bx, by, cx, cy)
    k0, k1, k2 = 2.0 * (ax * by - ay * bx), 4.0 * (ax * cy - ay * cx), 2.0 * (bx * cy - by * cx)
    p0, p1, p2, p3, p4, l0, l1, l2 = none, none, none, none, none, none, none, none
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        dx, dy, ex, ey, fx, fy = _curve(tile, family, number, lane, inverse, zdot)
        p0, p1, p2, p3, p4 = _dot(ax, ay, bx, by, cx, cy, dx, dy, ex, ey, fx, fy)
        l0 = 2.0 * (dx * by - dy * bx + ax * ey - ay * ex)
        l1 = 4.0 * (dx * cy - dy * cx + ax * fy - ay * fx)
        l2 = 2.0 * (ex * cy - ey * cx + bx * fy - by * fx)
    points, pairs = 2 * axial.shape[0] - 1, axial.shape[0] - 1
    # In the middle both strains share the root.
    shrink = 1.0 / root(s0)
    relaxed = reference(tile, curved, family, number, lane, 2 * int(axial[pairs, 2]), 1.0)
    n0, lost = stretch(damped, shrink, p0, relaxed, ea * axial[pairs, 1], eta)
    n1, n2, n3, n4, m0, m1, m2 = none, none, none, none, none, none, none
    for g in range(pairs):
        x, square = axial[g, 0], axial[g, 0] * axial[g, 0]
        here, there = at_both(x, s0, s1, s2, s3, s4)
        rate, other = at_both(x, p0, p1, p2, p3, p4)
        relaxed = reference(tile, curved, family, number, lane, 2 * int(axial[g, 3]), 1.0)
        first, power_first = stretch(damped, 1.0 / root(here), rate, relaxed, ea * axial[g, 1], eta)
        relaxed = reference(tile, curved, family, number, lane, 2 * int(axial[g, 2]), 1.0)
        second, power_second = stretch(damped, 1.0 / root(there), other, relaxed, ea * axial[g, 1], eta)
        lost = lost + (power_first + power_second)
        even, odd = first + second, x * (first - second)
        n0, n1, n2 = n0 + even, n1 + odd, n2 + square * even
        n3, n4 = n3 + square * odd, n4 + (square * square) * even
    last = bending.shape[0] - 1
    if bending[last, 1] != 0.0:
        at = 2 * (points + int(bending[last, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        m0, turn, more = bend(damped, shrink * shrink, k0, p0, l0, straight, angle, ei * bending[last, 1], eta)
        n0, lost = n0 - 2.0 * m0 * turn, lost + more
    for g in range(last):
        x, square = bending[g, 0], bending[g, 0] * bending[g, 0]
        here, there = at_both(x, s0, s1, s2, s3, s4)
        rate, other = at_both(x, p0, p1, p2, p3, p4)
        k, k_there = at_both(x, k0, k1, k2, none, none)
        turning, twisting = at_both(x, l0, l1, l2, none, none)
        at = 2 * (points + int(bending[g, 3]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        moment, turn, more = bend(damped, 1.0 / here, k, rate, turning, straight, angle, ei * bending[g, 1], eta)
        at = 2 * (points + int(bending[g, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        second, twist, most = bend(
            damped, 1.0 / there, k_there, other, twisting, straight, angle, ei * bending[g, 1], eta
        )
        lost = lost + (more + most)
        even, odd = -2.0 * (moment * turn + second * twist), (-2.0 * x) * (moment * turn - second * twist)
        n0, n1, n2 = n0 + even, n1 + odd, n2 + square * even
        n3, n4 = n3 + square * odd, n4 + (square * square) * even
        even = moment + second
        m0, m1, m2 = m0 + even, m1 + x * (moment - second), m2 + square * even
    m0, m1, m2 = 2.0 * m0, 4.0 * m1, 2.0 * m2
    gx, gy = n0 * ax + n1 * bx + n2 * cx + m0 * by + m1 * cy, n0 * ay + n1 * by + n2 * cy - m0 * bx - m1 * cx
    hx, hy = n1 * ax + n2 * bx + n3 * cx - m0 * ay + m2 * cy, n1 * ay + n2 * by + n3 * cy + m0 * ax - m2 * cx
    ix, iy = n2 * ax + n3 * bx + n4 * cx - m1 * ay - m2 * by, n2 * ay + n3 * by + n4 * cy + m1 * ax + m2 * bx
    dx, dy, hx, hy = 1.5 * (gx - ix) * inverse, 1.5 * (gy - iy) * inverse, 0.5 * hx, 0.5 * hy
    ex, ey = 0.25 * gx - 0.75 * ix, 0.25 * gy - 0.75 * iy
    add_rows(tile, family, number, lane, count, w, f, (dx, dy, ex + hx, ey + hy, -dx, -dy, ex - hx, ey - hy))
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        count, variant = together(tile, family, number), family.plan[PLAN * number + VARIANT]
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            at = family, number, count, lane, z, zdot, f, w, power
            if variant == FULL:
                _force(tile, False, False, _FULL_AXIAL, _FULL_BENDING, *at)
            elif variant == REDUCED:
                _force(tile, False, False, _REDUCED_AXIAL, _REDUCED_BENDING, *at)
            elif variant == DAMPED and moving:
                _force(tile, True, True, _FULL_AXIAL, _FULL_BENDING, *at)
            else:
                _force(tile, True, False, _FULL_AXIAL, _FULL_BENDING, *at)
        number += count


@njit(error_model="numpy", forceinline=True)
def _add_energy(tile, axial, bending, family, number, count, lane, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the strain energy of `count` elements; the rules, rows (xi, weight), are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ax, ay, bx, by, cx, cy = _curve(tile, family, number, lane, inverse, z)
    s0, s1, s2, s3, s4 = _dot(ax, ay, bx, by, cx, cy, ax, ay, bx, by, cx, cy)
    k0, k1, k2 = 2.0 * (ax * by - ay * bx), 4.0 * (ax * cy - ay * cx), 2.0 * (bx * cy - by * cx)
    stretched, bent = 0.0 * inverse, 0.0 * inverse
    for g in range(axial.shape[0]):
        x, weight = axial[g, 0], axial[g, 1]
        relaxed = rest(tile, family, number, lane, 2 * g)
        strain = root(s0 + x * (s1 + x * (s2 + x * (s3 + x * s4)))) * relaxed - 1.0
        stretched = stretched + weight * strain * strain / relaxed
    for g in range(bending.shape[0]):
        x, weight = bending[g, 0], bending[g, 1]
        at = 2 * (axial.shape[0] + g)
        square = s0 + x * (s1 + x * (s2 + x * (s3 + x * s4)))
        angle = (k0 + x * (k1 + x * k2)) / square - rest(tile, family, number, lane, at + 1)
        bent = bent + weight * angle * angle * rest(tile, family, number, lane, at)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    add_sum(tile, lane, count, w, energy, 0.5 * (ea * stretched + ei * bent))


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    number, total = 0, shift(energy, row * len(tile))
    while number < family.size:
        count, variant = together(tile, family, number), family.plan[PLAN * number + VARIANT]
        for lane in range(0, len(tile), len(EIGHT)):
            at = family, number, count, lane, z, w, total
            if variant == REDUCED:
                _add_energy(tile, _REDUCED_POINTS, _REDUCED_BENDING_POINTS, *at)
            else:
                _add_energy(tile, _POINTS, _BENDING_POINTS, *at)
        number += count


implement(
    Cubics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=potential,
    stiffness=beam_tangent.stiffness,
    viscosity=beam_tangent.viscosity,
)


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    reduced, damped = rod.quadrature == "reduced", bool(np.any(rod.retardation))
    if reduced and (damped or rod.curvature):
        raise InputError("quadrature: a curved or damped ancf-cable has the full quadrature")
    variant = REDUCED if reduced else DAMPED if damped else CURVED if rod.curvature else FULL
    rule = REDUCED_RULE if reduced else FULL_RULE
    return beam.part(beam.CUBIC, rule, variant, rod, section, length, nodal)


ELEMENT = beam.element(beam.CUBIC, Cubics, lambda rod, s: [beam.tangent(rod, s)], _part)
