"""The force of the cubic beam element: the one kernel in which most runs spend their time.

The theory is that of `beam`; here its sums are written out for two nodes with position and slope, in units in which few
products are left. On xi in [-1, 1]

    P = 4 r' = A + 2 B xi + C xi^2,    A = D - S, B = q - p, C = 3 S - D,    D = 6 (r2 - r1)/L, S = p + q,

with the slopes p and q, so that s = |P|^2 and k = A x B + A x C xi + B x C xi^2 are polynomials of xi, and

    1/|r'| = 4/sqrt(s),    r' x L r'' = k/4,    L theta' = 4 k/s.

Points come in pairs +-xi that share their even and odd parts. What a strain contributes to dU/d(A, B, C) is sums over
the points of its density times powers of xi: N_j of the derivative by s/2, M_j of that by k. Straight or curved,
elastic or damped, the same formula serves; its vectors are lanes or elements (`batch`).
Berzeri and Shabana 2000; Gerstmayr and Shabana 2006; with the reduced rule, Gerstmayr and Irschik 2008.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT, inverse_root, reciprocal, spread
from shoal.errors import InputError
from shoal.mechanics.elements import beam, beam_tangent
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, coordinate, of_one_variant
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.strain import bend, reference
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
def _curve(tile, family, number, lane, six, z):  # type: ignore[no-untyped-def]
    """A, B, C of elements in the state z; six: 6/L."""
    x1, y1 = coordinate(tile, family, number, lane, ROWS, 0, z), coordinate(tile, family, number, lane, ROWS, 1, z)
    px, py = coordinate(tile, family, number, lane, ROWS, 2, z), coordinate(tile, family, number, lane, ROWS, 3, z)
    x2, y2 = coordinate(tile, family, number, lane, ROWS, 4, z), coordinate(tile, family, number, lane, ROWS, 5, z)
    qx, qy = coordinate(tile, family, number, lane, ROWS, 6, z), coordinate(tile, family, number, lane, ROWS, 7, z)
    sx, sy = px + qx, py + qy
    ax, ay = six * (x2 - x1) - sx, six * (y2 - y1) - sy
    # Sums cost nothing beside products: other units of the processor do them.
    return ax, ay, qx - px, qy - py, (sx + sx) - ax, (sy + sy) - ay


@njit(error_model="numpy", forceinline=True)
def _square(ax, ay, bx, by, cx, cy):  # type: ignore[no-untyped-def]
    """s0 to s4 of P . P = s0 + 4 s1 xi + 2 s2 xi^2 + 4 s3 xi^3 + s4 xi^4."""
    return (
        ax * ax + ay * ay,
        ax * bx + ay * by,
        ax * cx + ay * cy + (bx + bx) * bx + (by + by) * by,
        bx * cx + by * cy,
        cx * cx + cy * cy,
    )


@njit(error_model="numpy", forceinline=True)
def _product(ax, ay, bx, by, cx, cy, dx, dy, ex, ey, fx, fy):  # type: ignore[no-untyped-def]
    """The same of (A + 2 B xi + C xi^2) . (D + 2 E xi + F xi^2)."""
    return (
        ax * dx + ay * dy,
        0.5 * (ax * ex + ay * ey + bx * dx + by * dy),
        0.5 * (ax * fx + ay * fy + cx * dx + cy * dy) + 2.0 * (bx * ex + by * ey),
        0.5 * (bx * fx + by * fy + cx * ex + cy * ey),
        cx * fx + cy * fy,
    )


@njit(error_model="numpy", forceinline=True)
def _at_both(x, s):  # type: ignore[no-untyped-def]
    """Such a product at +xi and at -xi."""
    square = x * x
    even, odd = s[0] + (2.0 * square) * s[2] + (square * square) * s[4], (4.0 * x) * s[1] + (4.0 * x * square) * s[3]
    return even + odd, even - odd


@njit(error_model="numpy", forceinline=True)
def _turning(x, k):  # type: ignore[no-untyped-def]
    """k, or its rate, at +xi and at -xi."""
    even, odd = k[0] + (x * x) * k[2], x * k[1]
    return even + odd, even - odd


@njit(error_model="numpy", forceinline=True)
def _collect(x, weight, here, there, n):  # type: ignore[no-untyped-def]
    """Add the moments 0 to 4 of a density at +xi and at -xi."""
    square, even, odd = x * x, here + there, here - there
    return (
        n[0] + weight * even,
        n[1] + (weight * x) * odd,
        n[2] + (weight * square) * even,
        n[3] + (weight * x * square) * odd,
        n[4] + (weight * square * square) * even,
    )


@njit(error_model="numpy", forceinline=True)
def _slack(damped, shrink, rate, relaxed, eta):  # type: ignore[no-untyped-def]
    """|P|/s, less what damping adds to the tension, in the same units; and the power lost over EA; shrink: 1/|P|."""
    lost = 0.0 * shrink
    if damped:
        flow = 0.25 * rate * shrink
        lost = eta * relaxed * flow * flow
        shrink = shrink - eta * relaxed * flow * shrink
    return shrink, lost


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
    six = 6.0 * coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    none, eta = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    ax, ay, bx, by, cx, cy = _curve(tile, family, number, lane, six, z)
    s, k = _square(ax, ay, bx, by, cx, cy), (ax * by - ay * bx, ax * cy - ay * cx, bx * cy - by * cx)
    p, change = (none, none, none, none, none), (none, none, none)
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        dx, dy, ex, ey, fx, fy = _curve(tile, family, number, lane, six, zdot)
        p = _product(ax, ay, bx, by, cx, cy, dx, dy, ex, ey, fx, fy)
        change = (
            dx * by - dy * bx + ax * ey - ay * ex,
            dx * cy - dy * cx + ax * fy - ay * fx,
            ex * cy - ey * cx + bx * fy - by * fx,
        )
    points, pairs = 2 * axial.shape[0] - 1, axial.shape[0] - 1
    # In the middle both strains share the root. Weights are over 16: the force is that on P, over 4 once more for P.
    shrink, weight = inverse_root(s[0]), axial[pairs, 1]
    relaxed = reference(tile, curved, family, number, lane, 2 * int(axial[pairs, 2]), 1.0)
    slack, lost = _slack(damped, shrink, p[0], relaxed, eta)
    lost = weight * lost
    n, whole = (
        ((0.25 * weight) * slack, none, none, none, none),
        ((0.0625 * weight) * relaxed, none, none, none, none),
    )
    for g in range(pairs):
        x, weight = axial[g, 0], axial[g, 1]
        here, there = _at_both(x, s)
        rate, other = _at_both(x, p)
        relaxed = reference(tile, curved, family, number, lane, 2 * int(axial[g, 3]), 1.0)
        opposite = reference(tile, curved, family, number, lane, 2 * int(axial[g, 2]), 1.0)
        first, power_first = _slack(damped, inverse_root(here), rate, relaxed, eta)
        second, power_second = _slack(damped, inverse_root(there), other, opposite, eta)
        lost = lost + weight * (power_first + power_second)
        n = _collect(x, 0.25 * weight, first, second, n)
        whole = _collect(x, 0.0625 * weight, relaxed, opposite, whole)
    lost = ea * lost
    n = (
        ea * (whole[0] - n[0]),
        ea * (whole[1] - n[1]),
        ea * (whole[2] - n[2]),
        ea * (whole[3] - n[3]),
        ea * (whole[4] - n[4]),
    )
    m0, m1, m2, last = none, none, none, bending.shape[0] - 1
    if bending[last, 1] != 0.0:
        at = 2 * (points + int(bending[last, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        stiff = (16.0 * bending[last, 1]) * ei
        m0, turn, more = bend(damped, shrink * shrink, k[0], p[0], change[0], straight, 0.25 * angle, stiff, eta)
        n, lost = (n[0] - 2.0 * (m0 * turn), n[1], n[2], n[3], n[4]), lost + more
    for g in range(last):
        x, stiff = bending[g, 0], (16.0 * bending[g, 1]) * ei
        here, there = _at_both(x, s)
        rate, other = _at_both(x, p)
        k_here, k_there = _turning(x, k)
        turning, twisting = _turning(x, change)
        at = 2 * (points + int(bending[g, 3]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        moment, turn, more = bend(damped, reciprocal(here), k_here, rate, turning, straight, 0.25 * angle, stiff, eta)
        at = 2 * (points + int(bending[g, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        second, twist, most = bend(
            damped, reciprocal(there), k_there, other, twisting, straight, 0.25 * angle, stiff, eta
        )
        lost = lost + (more + most)
        n = _collect(x, -2.0, moment * turn, second * twist, n)
        even, odd = moment + second, moment - second
        m0, m1, m2 = m0 + even, m1 + x * odd, m2 + (x * x) * even
    n0, n1, n2, n3, n4 = n[0], n[1] + n[1], n[2], n[3] + n[3], n[4]
    four = (n2 + n2) + (n2 + n2)
    gx, gy = n0 * ax + n1 * bx + n2 * cx + m0 * by + m1 * cy, n0 * ay + n1 * by + n2 * cy - m0 * bx - m1 * cx
    hx, hy = n1 * ax + four * bx + n3 * cx - m0 * ay + m2 * cy, n1 * ay + four * by + n3 * cy + m0 * ax - m2 * cx
    ix, iy = n2 * ax + n3 * bx + n4 * cx - m1 * ay - m2 * by, n2 * ay + n3 * by + n4 * cy + m1 * ax + m2 * bx
    dx, dy = gx - ix, gy - iy
    ex, ey = dx - (ix + ix), dy - (iy + iy)
    dx, dy = six * dx, six * dy
    add_rows(tile, family, number, lane, count, w, f, (dx, dy, ex + hx, ey + hy, -dx, -dy, ex - hx, ey - hy))
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(error_model="numpy", forceinline=True)
def _first_of(family: Family, one: int, other: int) -> int:
    """The first element that is of one variant or another; beyond the last if there is none.

    The compiler makes ready before a loop what it needs: after this search, only for variants that there are.
    """
    number = 0
    while number < family.size and not _is_of(family, number, one, other):
        number += of_one_variant(family, number)
    return number


@njit(error_model="numpy", forceinline=True)
def _is_of(family: Family, number: int, one: int, other: int) -> bool:
    """Return whether an element is of one variant or another."""
    return family.plan[PLAN * number + VARIANT] in (one, other)


@njit(error_model="numpy", forceinline=True)
def _forces(tile, one, other, curved, damped, axial, bending, family, z, zdot, f, w, power):  # type: ignore[no-untyped-def]
    """Add the forces of all elements of one variant or another."""
    number = _first_of(family, one, other)
    while number < family.size:
        members = of_one_variant(family, number)
        count = members if len(tile) == 1 else 1
        for first in range(number, number + (members if _is_of(family, number, one, other) else 0), count):
            for lane in range(0, len(tile) - family.spare, len(EIGHT)):
                _force(tile, curved, damped, axial, bending, family, first, count, lane, z, zdot, f, w, power)
        number += members


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    at = family, z, zdot, f, w, power
    _forces(tile, FULL, FULL, False, False, _FULL_AXIAL, _FULL_BENDING, *at)
    _forces(tile, REDUCED, REDUCED, False, False, _REDUCED_AXIAL, _REDUCED_BENDING, *at)
    _forces(tile, CURVED, CURVED if moving else DAMPED, True, False, _FULL_AXIAL, _FULL_BENDING, *at)
    if moving:
        _forces(tile, DAMPED, DAMPED, True, True, _FULL_AXIAL, _FULL_BENDING, *at)


@njit(error_model="numpy", forceinline=True)
def _add_energy(tile, curved, axial, bending, family, number, count, lane, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the strain energy of `count` elements; curved and the rules, rows (xi, weight), are constants of the call."""
    six = 6.0 * coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ax, ay, bx, by, cx, cy = _curve(tile, family, number, lane, six, z)
    s0, s1, s2, s3, s4 = _square(ax, ay, bx, by, cx, cy)
    k0, k1, k2 = ax * by - ay * bx, ax * cy - ay * cx, bx * cy - by * cx
    stretched, bent = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    for g in range(axial.shape[0]):
        x, weight = axial[g, 0], axial[g, 1]
        relaxed = reference(tile, curved, family, number, lane, 2 * g, 1.0)
        square = s0 + x * (4.0 * s1 + x * (2.0 * s2 + x * (4.0 * s3 + x * s4)))
        strain = (0.25 * square) * inverse_root(square) * relaxed - 1.0
        stretched = stretched + (weight * strain) * (strain / relaxed)
    for g in range(bending.shape[0]):
        x, weight = bending[g, 0], bending[g, 1]
        at = 2 * (axial.shape[0] + g)
        square = s0 + x * (4.0 * s1 + x * (2.0 * s2 + x * (4.0 * s3 + x * s4)))
        rest = reference(tile, curved, family, number, lane, at + 1, 0.0)
        angle = 4.0 * ((k0 + x * (k1 + x * k2)) / square) - rest
        bent = bent + (weight * angle) * (angle * reference(tile, curved, family, number, lane, at, 1.0))
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    add_sum(tile, lane, count, w, energy, 0.5 * (ea * stretched + ei * bent))


@njit(error_model="numpy", forceinline=True)
def _add_energies(tile, curved, axial, bending, family, number, members, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the energies of `members` elements of one variant."""
    count = members if len(tile) == 1 else 1
    for first in range(number, number + members, count):
        for lane in range(0, len(tile), len(EIGHT)):
            _add_energy(tile, curved, axial, bending, family, first, count, lane, z, w, energy)


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    number, total = 0, shift(energy, row * len(tile))
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, w, total
        if variant == REDUCED:
            _add_energies(tile, False, _REDUCED_POINTS, _REDUCED_BENDING_POINTS, *at)
        elif variant == FULL:
            _add_energies(tile, False, _POINTS, _BENDING_POINTS, *at)
        else:
            _add_energies(tile, True, _POINTS, _BENDING_POINTS, *at)
        number += members


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
