"""The quintic beam element: nodes with position, slope and second derivative; theory in `beam`.

A quarter of the elements of the cubic one serve the same accuracy. r' is a polynomial of fourth degree in xi, from -1
to 1; points come in pairs +-xi that share its even and odd parts, and forces are sums over the points of what the
energy changes with r' and L r'', times powers of xi.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT, inverse_root, reciprocal, root, spread
from shoal.mechanics import plane
from shoal.mechanics.elements import beam, beam_tangent
from shoal.mechanics.elements.batch import (
    VARIANT,
    add_rows,
    add_sum,
    coefficient,
    coordinate,
    of_one_variant,
    rest,
    together,
)
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.strain import bend, reference, stretch
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS = 2 * beam.QUINTIC
FOUR, FOUR_CURVED, FOUR_DAMPED, FIVE, FIVE_CURVED, FIVE_DAMPED = range(6)
"""Variants: the points of the rule; straight and elastic, curved, curved or not and damped."""


class Quintics(Family):
    """Quintic beam elements. rows: x and y of r1, r1', r1'', r2, r2', r2''. Numbers: as in `beam`."""


def recommended(elements: int) -> Array:
    """Return the rule with the least error on coarse meshes, for a rod of n elements.

    Four points do not see the stretch r' = P_4. Neighbours, which share r' and r'', forbid it; a rod of one element
    needs a fifth point.
    """
    points = 4 if elements > 1 else 5
    return beam.quadrature(beam.QUINTIC, points, points)


def _slope() -> Array:
    """r' = c0 + c1 xi + ... + c4 xi^4 of the scaled vectors: (5, vectors (d, r1', L r1'', r2', L r2''))."""
    xi = np.polynomial.Polynomial([0.5, 0.5])
    shapes = [np.polynomial.Polynomial(one).deriv()(xi).coef for one in beam.HERMITE[beam.QUINTIC][[3, 1, 2, 4, 5]]]
    return np.array([np.pad(one, (0, 5 - len(one))) for one in shapes]).T


# What is even in xi depends on d, r1' + r2' and L (r1'' - r2''), what is odd on r2' - r1' and L (r1'' + r2'').
_EVEN, _ODD = _slope()[[0, 2, 4], :3], _slope()[[1, 3], 3:]
_GAUSS = np.polynomial.legendre.leggauss
_FOUR_PAIRS, _FIVE_PAIRS = beam.pairs(*_GAUSS(4)), beam.pairs(*_GAUSS(5))
_FOUR_POINTS, _FIVE_POINTS = (np.column_stack([x, weights / 2]) for x, weights in (_GAUSS(4), _GAUSS(5)))


@njit(error_model="numpy", forceinline=True)
def component(tile, family, number, lane, side, inverse, length, k, z):  # type: ignore[no-untyped-def]
    """c0 to c4 in one direction, 0 or 1 of an element with 12 rows, 0 to 2 of one with 18."""
    d = side // beam.QUINTIC
    r1 = coordinate(tile, family, number, lane, side, k, z)
    p1 = coordinate(tile, family, number, lane, side, d + k, z)
    k1 = coordinate(tile, family, number, lane, side, 2 * d + k, z)
    r2 = coordinate(tile, family, number, lane, side, 3 * d + k, z)
    p2 = coordinate(tile, family, number, lane, side, 4 * d + k, z)
    k2 = coordinate(tile, family, number, lane, side, 5 * d + k, z)
    chord, k1, k2 = (r2 - r1) * inverse, k1 * length, k2 * length
    s, a, u, b = p1 + p2, k1 - k2, p2 - p1, k1 + k2
    return (
        _EVEN[0, 0] * chord + _EVEN[0, 1] * s + _EVEN[0, 2] * a,
        _ODD[0, 0] * u + _ODD[0, 1] * b,
        _EVEN[1, 0] * chord + _EVEN[1, 1] * s + _EVEN[1, 2] * a,
        _ODD[1, 0] * u + _ODD[1, 1] * b,
        _EVEN[2, 0] * chord + _EVEN[2, 1] * s + _EVEN[2, 2] * a,
    )


@njit(error_model="numpy", forceinline=True)
def at_both(x, c):  # type: ignore[no-untyped-def]
    """r' and L r'' at +xi and at -xi, in one direction."""
    c0, c1, c2, c3, c4 = c
    x2 = x * x
    even, odd = c0 + x2 * (c2 + x2 * c4), x * (c1 + x2 * c3)
    up, down = 2.0 * c1 + (6.0 * x2) * c3, x * (4.0 * c2 + (8.0 * x2) * c4)
    return even + odd, even - odd, up + down, up - down


@njit(error_model="numpy", forceinline=True)
def _point(damped, px, py, cx, cy, ux, uy, vx, vy, inverse, angle, axial, bending, eta):  # type: ignore[no-untyped-def]
    """Derivatives of the energy by r' and by L r'' at a point, and the power lost; u, v: rates of r' and L r''."""
    shrink = inverse_root(px * px + py * py)
    rate, change = ux * px + uy * py, ux * cy - uy * cx + px * vy - py * vx
    n, lost = stretch(damped, shrink, rate, inverse, axial, eta)
    m, turn, more = bend(damped, shrink * shrink, px * cy - py * cx, rate, change, inverse, angle, bending, eta)
    n = n - 2.0 * m * turn
    return n * px + m * cy, n * py - m * cx, -m * py, m * px, lost + more


@njit(error_model="numpy", forceinline=True)
def collect(x, g, other, h, beyond, sums):  # type: ignore[no-untyped-def]
    """Add the derivatives by c0 to c4 of a pair of points in one direction: g by r', h by L r'' at +xi and at -xi."""
    s0, s1, s2, s3, s4 = sums
    even, odd, up, down = g + other, x * (g - other), h + beyond, x * (h - beyond)
    x2 = x * x
    return (
        s0 + even,
        s1 + odd + 2.0 * up,
        s2 + x2 * even + 4.0 * down,
        s3 + x2 * odd + (6.0 * x2) * up,
        s4 + (x2 * x2) * even + (8.0 * x2) * down,
    )


@njit(error_model="numpy", forceinline=True)
def nodal(inverse, length, sums):  # type: ignore[no-untyped-def]
    """The force in one direction on r1, r1', r1'', r2, r2', r2''."""
    s0, s1, s2, s3, s4 = sums
    d = (_EVEN[0, 0] * s0 + _EVEN[1, 0] * s2 + _EVEN[2, 0] * s4) * inverse
    s = _EVEN[0, 1] * s0 + _EVEN[1, 1] * s2 + _EVEN[2, 1] * s4
    a = (_EVEN[0, 2] * s0 + _EVEN[1, 2] * s2 + _EVEN[2, 2] * s4) * length
    u, b = _ODD[0, 0] * s1 + _ODD[1, 0] * s3, (_ODD[0, 1] * s1 + _ODD[1, 1] * s3) * length
    return d, u - s, -(a + b), -d, -(s + u), a - b


@njit(error_model="numpy", forceinline=True)
def _force(
    tile: Tile,
    curved: bool,
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
    """Add the force of `count` elements to f; curved, damped and the rule are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    length, none = reciprocal(inverse), spread(EIGHT, 0.0)
    eta, lost, still = none, none, (none, none, none, none, none)
    x = component(tile, family, number, lane, ROWS, inverse, length, 0, z)
    y = component(tile, family, number, lane, ROWS, inverse, length, 1, z)
    dx, dy, sx, sy = still, still, still, still
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        dx = component(tile, family, number, lane, ROWS, inverse, length, 0, zdot)
        dy = component(tile, family, number, lane, ROWS, inverse, length, 1, zdot)
    last = pairs.shape[0] - 1
    for g in range(last):
        xi, weight = pairs[g, 0], pairs[g, 1]
        px, qx, cx, ex = at_both(xi, x)
        py, qy, cy, ey = at_both(xi, y)
        ux, tx, vx, wx = at_both(xi, dx)
        uy, ty, vy, wy = at_both(xi, dy)
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[g, 3]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[g, 3]) + 1, 0.0)
        gx, gy, hx, hy, one = _point(
            damped, px, py, cx, cy, ux, uy, vx, vy, straight, angle, ea * weight, ei * weight, eta
        )
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[g, 2]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[g, 2]) + 1, 0.0)
        ix, iy, jx, jy, two = _point(
            damped, qx, qy, ex, ey, tx, ty, wx, wy, straight, angle, ea * weight, ei * weight, eta
        )
        sx, sy = collect(xi, gx, ix, hx, jx, sx), collect(xi, gy, iy, hy, jy, sy)
        lost = lost + (one + two)
    if pairs[last, 1] != 0.0:
        weight = pairs[last, 1]
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[last, 2]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[last, 2]) + 1, 0.0)
        px, py, cx, cy = x[0], y[0], 2.0 * x[1], 2.0 * y[1]
        ux, uy, vx, vy = dx[0], dy[0], 2.0 * dx[1], 2.0 * dy[1]
        gx, gy, hx, hy, one = _point(
            damped, px, py, cx, cy, ux, uy, vx, vy, straight, angle, ea * weight, ei * weight, eta
        )
        sx = (sx[0] + gx, sx[1] + 2.0 * hx, sx[2], sx[3], sx[4])
        sy = (sy[0] + gy, sy[1] + 2.0 * hy, sy[2], sy[3], sy[4])
        lost = lost + one
    a, b, c, d, e, h = nodal(inverse, length, sx)
    i, j, k, m, n, o = nodal(inverse, length, sy)
    add_rows(tile, family, number, lane, count, w, f, (a, i, b, j, c, k, d, m, e, n, h, o))
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(error_model="numpy", forceinline=True)
def _forces(tile, curved, damped, rule, family, number, members, z, zdot, f, w, power):  # type: ignore[no-untyped-def]
    """Add the forces of `members` elements of one variant, with its constants prepared once."""
    count = members if len(tile) == 1 else 1
    for first in range(number, number + members, count):
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            _force(tile, curved, damped, rule, family, first, count, lane, z, zdot, f, w, power)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, zdot, f, w, power
        if variant == FOUR:
            _forces(tile, False, False, _FOUR_PAIRS, *at)
        elif variant == FIVE:
            _forces(tile, False, False, _FIVE_PAIRS, *at)
        elif variant == FOUR_DAMPED and moving:
            _forces(tile, True, True, _FOUR_PAIRS, *at)
        elif variant == FIVE_DAMPED and moving:
            _forces(tile, True, True, _FIVE_PAIRS, *at)
        elif variant in (FOUR_CURVED, FOUR_DAMPED):
            _forces(tile, True, False, _FOUR_PAIRS, *at)
        else:
            _forces(tile, True, False, _FIVE_PAIRS, *at)
        number += members


@njit(error_model="numpy", forceinline=True)
def _add_energy(tile, points, family, number, count, lane, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the strain energy of `count` elements; the rule, rows (xi, weight), is a constant of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    length, total = 1.0 / inverse, spread(EIGHT, 0.0)
    x = component(tile, family, number, lane, ROWS, inverse, length, 0, z)
    y = component(tile, family, number, lane, ROWS, inverse, length, 1, z)
    for g in range(points.shape[0]):
        px, _, cx, _ = at_both(points[g, 0], x)
        py, _, cy, _ = at_both(points[g, 0], y)
        square, relaxed = px * px + py * py, rest(tile, family, number, lane, 2 * g)
        strain = root(square) * relaxed - 1.0
        angle = (px * cy - py * cx) / square - rest(tile, family, number, lane, 2 * g + 1)
        total = total + (0.5 * points[g, 1]) * (ea * strain * strain / relaxed + ei * angle * angle * relaxed)
    add_sum(tile, lane, count, w, energy, total)


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    number, total = 0, shift(energy, row * len(tile))
    while number < family.size:
        count, variant = together(tile, family, number), family.plan[PLAN * number + VARIANT]
        for lane in range(0, len(tile), len(EIGHT)):
            at = family, number, count, lane, z, w, total
            if variant in (FOUR, FOUR_CURVED, FOUR_DAMPED):
                _add_energy(tile, _FOUR_POINTS, *at)
            else:
                _add_energy(tile, _FIVE_POINTS, *at)
        number += count


implement(
    Quintics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=potential,
    stiffness=beam_tangent.stiffness,
    viscosity=beam_tangent.viscosity,
)


def _nodal_vectors(rod: Rod, s: Number) -> list[Number]:
    tangent = beam.tangent(rod, s)
    curvature = sum(k * s**power for power, k in enumerate(rod.curvature)) + 0.0 * s
    return [tangent, curvature * plane.quarter(tangent)]


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    rule = recommended(rod.elements)
    kind = 2 if np.any(rod.retardation) else 1 if rod.curvature else 0
    variant = (FOUR if len(rule) == 4 else FIVE) + kind
    return beam.part(beam.QUINTIC, rule, variant, rod, section, length, nodal)


ELEMENT = beam.element(beam.QUINTIC, Quintics, _nodal_vectors, _part)
