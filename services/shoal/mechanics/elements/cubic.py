"""The force of the cubic beam element in R^d: the one kernel in which most runs spend their time.

The theory is that of `beam`; here its sums are written out for two nodes with position and slope, in units in which few
products are left. On xi in [-1, 1]

    P = 4 r' = A + 2 B xi + C xi^2,    A = D - S, B = q - p, C = 3 S - D,    D = 6 (r2 - r1)/L, S = p + q,

with the slopes p and q, so that s = |P|^2 and k = A ^ B + A ^ C xi + B ^ C xi^2 are polynomials of xi, and

    1/|r'| = 4/sqrt(s),    r' ^ L r'' = k/4,    L kappa = 4 k/s.

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
from shoal.compile.tuples import dot, facing, minus, plus, times, wedge
from shoal.errors import InputError
from shoal.mechanics.elements import beam, beam_table
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, nodal, of_one_variant, zeros_like
from shoal.mechanics.elements.families import PLAN, PLANE, SPACE, Entry, Family, Kernel, implement, space_of
from shoal.mechanics.elements.strain import STRAIGHT, bend, less, reference
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

VECTORS = beam.CUBIC
FULL, REDUCED, CURVED, DAMPED = range(4)
"""Variants: straight and elastic by either rule; curved, and curved or not and damped, by the full one."""


class Cubics(Family):
    """Cubic beam elements in the plane. rows: x and y of r1, r1', r2, r2'. coefficients, reference: as in `beam`."""


class SpatialCubics(Family):
    """The same in space. rows: x, y and z of r1, r1', r2, r2'."""


FULL_RULE = beam.quadrature(VECTORS, 5, 3)
REDUCED_RULE = beam.lobatto(VECTORS, 2)

_STRAIGHT = STRAIGHT / 16
"""In units of P, in which the turn is a quarter."""
_GAUSS = np.polynomial.legendre.leggauss
_FULL_AXIAL, _FULL_BENDING = beam.pairs(*_GAUSS(5)), beam.pairs(*_GAUSS(3))
_LOBATTO = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3
_REDUCED_AXIAL, _REDUCED_BENDING = beam.pairs(*_LOBATTO), beam.pairs(*_GAUSS(2))
_POINTS, _BENDING_POINTS, _REDUCED_POINTS, _REDUCED_BENDING_POINTS = (
    np.column_stack([points, weights / 2]) for points, weights in (_GAUSS(5), _GAUSS(3), _LOBATTO, _GAUSS(2))
)


@njit(error_model="numpy", forceinline=True)
def _curve(tile, space, family, number, lane, six, z):  # type: ignore[no-untyped-def]
    """A, B, C of elements in the state z; six: 6/L."""
    at = tile, space, family, number, lane, VECTORS, z
    r1, p, r2, q = nodal(0, *at), nodal(1, *at), nodal(2, *at), nodal(3, *at)
    s = plus(p, 1.0, q)
    a = minus(times(six, minus(r2, r1)), s)
    # Sums cost nothing beside products: other units of the processor do them.
    return a, minus(q, p), minus(plus(s, 1.0, s), a)


@njit(error_model="numpy", forceinline=True)
def _square(a, b, c):  # type: ignore[no-untyped-def]
    """s0 to s4 of P . P = s0 + 4 s1 xi + 2 s2 xi^2 + 4 s3 xi^3 + s4 xi^4."""
    return dot(a, a), dot(a, b), dot(a, c) + dot(plus(b, 1.0, b), b), dot(b, c), dot(c, c)


@njit(error_model="numpy", forceinline=True)
def _product(a, b, c, d, e, f):  # type: ignore[no-untyped-def]
    """The same of (A + 2 B xi + C xi^2) . (D + 2 E xi + F xi^2)."""
    return (
        dot(a, d),
        0.5 * (dot(a, e) + dot(b, d)),
        0.5 * (dot(a, f) + dot(c, d)) + 2.0 * dot(b, e),
        0.5 * (dot(b, f) + dot(c, e)),
        dot(c, f),
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
    even, odd = plus(k[0], x * x, k[2]), times(x, k[1])
    return plus(even, 1.0, odd), minus(even, odd)


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
    space: tuple[int, ...],
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
    """Add the force of `count` elements to f; space, curved, damped and the rules are constants of the call."""
    six = 6.0 * coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    none, eta = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    a, b, c = _curve(tile, space, family, number, lane, six, z)
    s, k = _square(a, b, c), (wedge(a, b), wedge(a, c), wedge(b, c))
    still = zeros_like(k[0])
    p, change = (none, none, none, none, none), (still, still, still)
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        d, e, h = _curve(tile, space, family, number, lane, six, zdot)
        p = _product(a, b, c, d, e, h)
        change = (
            plus(wedge(d, b), 1.0, wedge(a, e)),
            plus(wedge(d, c), 1.0, wedge(a, h)),
            plus(wedge(e, c), 1.0, wedge(b, h)),
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
    m0, m1, m2, last = still, still, still, bending.shape[0] - 1
    if bending[last, 1] != 0.0:
        at = 2 * (points + int(bending[last, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        stiff = (16.0 * bending[last, 1]) * ei
        m0, turn, more = bend(
            damped, shrink * shrink, k[0], p[0], change[0], straight, 0.25 * angle, stiff, eta, _STRAIGHT
        )
        n, lost = (n[0] - 2.0 * dot(m0, turn), n[1], n[2], n[3], n[4]), lost + more
    for g in range(last):
        x, stiff = bending[g, 0], (16.0 * bending[g, 1]) * ei
        here, there = _at_both(x, s)
        rate, other = _at_both(x, p)
        k_here, k_there = _turning(x, k)
        turning, twisting = _turning(x, change)
        at = 2 * (points + int(bending[g, 3]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        moment, turn, more = bend(
            damped, reciprocal(here), k_here, rate, turning, straight, 0.25 * angle, stiff, eta, _STRAIGHT
        )
        at = 2 * (points + int(bending[g, 2]))
        straight = reference(tile, curved, family, number, lane, at, 1.0)
        angle = reference(tile, curved, family, number, lane, at + 1, 0.0)
        second, twist, most = bend(
            damped, reciprocal(there), k_there, other, twisting, straight, 0.25 * angle, stiff, eta, _STRAIGHT
        )
        lost = lost + (more + most)
        n = _collect(x, -2.0, dot(moment, turn), dot(second, twist), n)
        even, odd = plus(moment, 1.0, second), minus(moment, second)
        m0, m1, m2 = plus(m0, 1.0, even), plus(m1, x, odd), plus(m2, x * x, even)
    n0, n1, n2, n3, n4 = n[0], n[1] + n[1], n[2], n[3] + n[3], n[4]
    four = (n2 + n2) + (n2 + n2)
    by_a = plus(plus(plus(plus(times(n0, a), n1, b), n2, c), 1.0, facing(b, m0)), 1.0, facing(c, m1))
    by_b = plus(minus(plus(plus(times(n1, a), four, b), n3, c), facing(a, m0)), 1.0, facing(c, m2))
    by_c = minus(minus(plus(plus(times(n2, a), n3, b), n4, c), facing(a, m1)), facing(b, m2))
    d = minus(by_a, by_c)
    e, d = minus(d, plus(by_c, 1.0, by_c)), times(six, d)
    values = (*d, *plus(e, 1.0, by_b), *times(-1.0, d), *minus(e, by_b))
    add_rows(tile, family, number, lane, count, w, f, values)
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
    space = space_of(family)
    number = _first_of(family, one, other)
    while number < family.size:
        members = of_one_variant(family, number)
        count = members if len(tile) == 1 else 1
        for first in range(number, number + (members if _is_of(family, number, one, other) else 0), count):
            for lane in range(0, len(tile) - family.spare, len(EIGHT)):
                _force(tile, space, curved, damped, axial, bending, family, first, count, lane, z, zdot, f, w, power)
        number += members


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    at = family, z, zdot, f, w, power
    curved = len(space_of(family)) == len(PLANE)
    _forces(tile, FULL, FULL, False, False, _FULL_AXIAL, _FULL_BENDING, *at)
    _forces(tile, REDUCED, REDUCED, False, False, _REDUCED_AXIAL, _REDUCED_BENDING, *at)
    _forces(tile, CURVED, CURVED if moving else DAMPED, curved, False, _FULL_AXIAL, _FULL_BENDING, *at)
    if moving:
        _forces(tile, DAMPED, DAMPED, curved, True, _FULL_AXIAL, _FULL_BENDING, *at)


@njit(error_model="numpy", forceinline=True)
def _add_energy(tile, space, curved, axial, bending, family, number, count, lane, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the strain energy of `count` elements; space, curved and the rules, rows (xi, weight), are constants."""
    six = 6.0 * coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    a, b, c = _curve(tile, space, family, number, lane, six, z)
    s0, s1, s2, s3, s4 = _square(a, b, c)
    k0, k1, k2 = wedge(a, b), wedge(a, c), wedge(b, c)
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
        turn = times(4.0 / square, plus(k0, x, plus(k1, x, k2)))
        turn = less(turn, reference(tile, curved, family, number, lane, at + 1, 0.0))
        bent = bent + weight * dot(turn, turn) * reference(tile, curved, family, number, lane, at, 1.0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    add_sum(tile, lane, count, w, energy, 0.5 * (ea * stretched + ei * bent))


@njit(error_model="numpy", forceinline=True)
def _add_energies(tile, curved, axial, bending, family, number, members, z, w, energy):  # type: ignore[no-untyped-def]
    """Add the energies of `members` elements of one variant."""
    count, space = members if len(tile) == 1 else 1, space_of(family)
    for first in range(number, number + members, count):
        for lane in range(0, len(tile), len(EIGHT)):
            _add_energy(tile, space, curved, axial, bending, family, first, count, lane, z, w, energy)


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`: that of `beam_table` takes three times as long, 8 % of a short run of many lanes."""
    number, total, curved = 0, shift(energy, row * len(tile)), len(space_of(family)) == len(PLANE)
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, w, total
        if variant == REDUCED:
            _add_energies(tile, False, _REDUCED_POINTS, _REDUCED_BENDING_POINTS, *at)
        elif variant == FULL:
            _add_energies(tile, False, _POINTS, _BENDING_POINTS, *at)
        else:
            _add_energies(tile, curved, _POINTS, _BENDING_POINTS, *at)
        number += members


for _kind, _space in ((Cubics, PLANE), (SpatialCubics, SPACE)):
    implement(
        _kind,
        Kernel(len(_space) * VECTORS, beam.COEFFICIENTS, 1, _space, beam_table.TANGENTS[_space]),
        force=force,
        potential=potential,
        stiffness=beam_table.stiffness,
    )


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    reduced, damped = rod.quadrature == "reduced", bool(np.any(rod.retardation))
    if reduced and (damped or rod.curvature):
        raise InputError("quadrature: a curved or damped ancf-cable has the full quadrature")
    variant = REDUCED if reduced else DAMPED if damped else CURVED if rod.curvature else FULL
    return beam.part(VECTORS, REDUCED_RULE if reduced else FULL_RULE, variant, rod, section, length, nodal)


ELEMENT, SPATIAL_ELEMENT = (
    beam.element(VECTORS, family, space, _part) for family, space in ((Cubics, PLANE), (SpatialCubics, SPACE))
)
