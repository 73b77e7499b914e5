"""The quintic beam element in R^d: nodes with position, slope and second derivative; theory in `beam`.

A quarter of the elements of the cubic one serve the same accuracy. r' is a polynomial of fourth degree in xi, from -1
to 1; points come in pairs +-xi that share its even and odd parts, and forces are sums over the points of what the
energy changes with r' and L r'', times powers of xi.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.simd import EIGHT, inverse_root, reciprocal, spread
from shoal.compile.tuples import dot, facing, minus, plus, times, wedge
from shoal.mechanics.elements import beam, beam_table
from shoal.mechanics.elements.batch import VARIANT, add_rows, add_sum, coefficient, nodal, of_one_variant, zeros_like
from shoal.mechanics.elements.families import PLAN, PLANE, SPACE, Entry, Family, Kernel, implement, space_of
from shoal.mechanics.elements.strain import STRAIGHT, bend, reference, stretch
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

VECTORS = beam.QUINTIC
FOUR, FOUR_CURVED, FOUR_DAMPED, FIVE, FIVE_CURVED, FIVE_DAMPED = range(6)
"""Variants: the points of the rule; straight and elastic, curved, curved or not and damped."""


class Quintics(Family):
    """Quintic beam elements in the plane. rows: x and y of r1, r1', r1'', r2, r2', r2''. Numbers: as in `beam`."""


class SpatialQuintics(Family):
    """The same in space. rows: x, y and z of r1, r1', r1'', r2, r2', r2''."""


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


@njit(error_model="numpy", forceinline=True)
def _combined(a, x, b, y):  # type: ignore[no-untyped-def]
    """a x + b y."""
    return plus(times(a, x), b, y)


@njit(error_model="numpy", forceinline=True)
def _curve(tile, space, family, number, lane, inverse, length, z):  # type: ignore[no-untyped-def]
    """c0 to c4."""
    at = tile, space, family, number, lane, VECTORS, z
    r1, p1, k1, r2, p2, k2 = nodal(0, *at), nodal(1, *at), nodal(2, *at), nodal(3, *at), nodal(4, *at), nodal(5, *at)
    chord, k1, k2 = times(inverse, minus(r2, r1)), times(length, k1), times(length, k2)
    s, a, u, b = plus(p1, 1.0, p2), minus(k1, k2), minus(p2, p1), plus(k1, 1.0, k2)
    return (
        plus(_combined(_EVEN[0, 0], chord, _EVEN[0, 1], s), _EVEN[0, 2], a),
        _combined(_ODD[0, 0], u, _ODD[0, 1], b),
        plus(_combined(_EVEN[1, 0], chord, _EVEN[1, 1], s), _EVEN[1, 2], a),
        _combined(_ODD[1, 0], u, _ODD[1, 1], b),
        plus(_combined(_EVEN[2, 0], chord, _EVEN[2, 1], s), _EVEN[2, 2], a),
    )


@njit(error_model="numpy", forceinline=True)
def _at_both(x, c):  # type: ignore[no-untyped-def]
    """r' and L r'' at +xi and at -xi."""
    c0, c1, c2, c3, c4 = c
    x2 = x * x
    even, odd = plus(c0, x2, plus(c2, x2, c4)), times(x, plus(c1, x2, c3))
    up, down = _combined(2.0, c1, 6.0 * x2, c3), times(x, _combined(4.0, c2, 8.0 * x2, c4))
    return plus(even, 1.0, odd), minus(even, odd), plus(up, 1.0, down), minus(up, down)


@njit(error_model="numpy", forceinline=True)
def _point(damped, p, c, u, v, inverse, angle, axial, bending, eta):  # type: ignore[no-untyped-def]
    """Derivatives of the energy by r' and by L r'' at a point, and the power lost; u, v: rates of r' and L r''."""
    shrink = inverse_root(dot(p, p))
    rate, change = dot(p, u), plus(wedge(u, c), 1.0, wedge(p, v))
    n, lost = stretch(damped, shrink, rate, inverse, axial, eta)
    m, turn, more = bend(damped, shrink * shrink, wedge(p, c), rate, change, inverse, angle, bending, eta, STRAIGHT)
    n = n - 2.0 * dot(m, turn)
    return plus(times(n, p), 1.0, facing(c, m)), times(-1.0, facing(p, m)), lost + more


@njit(error_model="numpy", forceinline=True)
def _collect(x, g, other, h, beyond, sums):  # type: ignore[no-untyped-def]
    """Add the derivatives by c0 to c4 of a pair of points: g by r', h by L r'' at +xi and at -xi."""
    s0, s1, s2, s3, s4 = sums
    even, odd, up, down = (
        plus(g, 1.0, other),
        times(x, minus(g, other)),
        plus(h, 1.0, beyond),
        times(x, minus(h, beyond)),
    )
    x2 = x * x
    return (
        plus(s0, 1.0, even),
        plus(plus(s1, 1.0, odd), 2.0, up),
        plus(plus(s2, x2, even), 4.0, down),
        plus(plus(s3, x2, odd), 6.0 * x2, up),
        plus(plus(s4, x2 * x2, even), 8.0 * x2, down),
    )


@njit(error_model="numpy", forceinline=True)
def _nodal_forces(inverse, length, sums):  # type: ignore[no-untyped-def]
    """The force on r1, r1', r1'', r2, r2', r2'', row by row."""
    s0, s1, s2, s3, s4 = sums
    d = times(inverse, plus(_combined(_EVEN[0, 0], s0, _EVEN[1, 0], s2), _EVEN[2, 0], s4))
    s = plus(_combined(_EVEN[0, 1], s0, _EVEN[1, 1], s2), _EVEN[2, 1], s4)
    a = times(length, plus(_combined(_EVEN[0, 2], s0, _EVEN[1, 2], s2), _EVEN[2, 2], s4))
    u, b = _combined(_ODD[0, 0], s1, _ODD[1, 0], s3), times(length, _combined(_ODD[0, 1], s1, _ODD[1, 1], s3))
    first = (*d, *minus(u, s), *times(-1.0, plus(a, 1.0, b)))
    return (*first, *times(-1.0, d), *times(-1.0, plus(s, 1.0, u)), *minus(a, b))


@njit(error_model="numpy", forceinline=True)
def _force(
    tile: Tile,
    space: tuple[int, ...],
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
    """Add the force of `count` elements to f; space, curved, damped and the rule are constants of the call."""
    inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
    ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
    ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
    length, eta, lost = reciprocal(inverse), spread(EIGHT, 0.0), spread(EIGHT, 0.0)
    r = _curve(tile, space, family, number, lane, inverse, length, z)
    still = zeros_like(r[0])
    sums, v = (still, still, still, still, still), (still, still, still, still, still)
    if damped:
        eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
        v = _curve(tile, space, family, number, lane, inverse, length, zdot)
    last = pairs.shape[0] - 1
    for k in range(last):
        xi, axial, bending = pairs[k, 0], ea * pairs[k, 1], ei * pairs[k, 1]
        p, q, c, e = _at_both(xi, r)
        u, t, a, b = _at_both(xi, v)
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[k, 3]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[k, 3]) + 1, 0.0)
        g, h, one = _point(damped, p, c, u, a, straight, angle, axial, bending, eta)
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[k, 2]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[k, 2]) + 1, 0.0)
        i, j, two = _point(damped, q, e, t, b, straight, angle, axial, bending, eta)
        sums = _collect(xi, g, i, h, j, sums)
        lost = lost + (one + two)
    if pairs[last, 1] != 0.0:
        axial, bending = ea * pairs[last, 1], ei * pairs[last, 1]
        straight = reference(tile, curved, family, number, lane, 2 * int(pairs[last, 2]), 1.0)
        angle = reference(tile, curved, family, number, lane, 2 * int(pairs[last, 2]) + 1, 0.0)
        p, c, u, a = r[0], times(2.0, r[1]), v[0], times(2.0, v[1])
        g, h, one = _point(damped, p, c, u, a, straight, angle, axial, bending, eta)
        sums = (plus(sums[0], 1.0, g), plus(sums[1], 2.0, h), sums[2], sums[3], sums[4])
        lost = lost + one
    add_rows(tile, family, number, lane, count, w, f, _nodal_forces(inverse, length, sums))
    if damped:
        add_sum(tile, lane, count, w, power, lost)


@njit(error_model="numpy", forceinline=True)
def _forces(tile, curved, damped, rule, family, number, members, z, zdot, f, w, power):  # type: ignore[no-untyped-def]
    """Add the forces of `members` elements of one variant, with its constants prepared once."""
    count, space = members if len(tile) == 1 else 1, space_of(family)
    for first in range(number, number + members, count):
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            _force(tile, space, curved, damped, rule, family, first, count, lane, z, zdot, f, w, power)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number, curved = 0, len(space_of(family)) == len(PLANE)
    while number < family.size:
        members, variant = of_one_variant(family, number), family.plan[PLAN * number + VARIANT]
        at = family, number, members, z, zdot, f, w, power
        if variant == FOUR:
            _forces(tile, False, False, _FOUR_PAIRS, *at)
        elif variant == FIVE:
            _forces(tile, False, False, _FIVE_PAIRS, *at)
        elif variant == FOUR_DAMPED and moving:
            _forces(tile, curved, True, _FOUR_PAIRS, *at)
        elif variant == FIVE_DAMPED and moving:
            _forces(tile, curved, True, _FIVE_PAIRS, *at)
        elif variant in (FOUR_CURVED, FOUR_DAMPED):
            _forces(tile, curved, False, _FOUR_PAIRS, *at)
        else:
            _forces(tile, curved, False, _FIVE_PAIRS, *at)
        number += members


for _kind, _space in ((Quintics, PLANE), (SpatialQuintics, SPACE)):
    implement(
        _kind,
        Kernel(len(_space) * VECTORS, beam.COEFFICIENTS, 1, _space, beam_table.TANGENTS[_space]),
        force=force,
        potential=beam_table.potential,
        stiffness=beam_table.stiffness,
    )


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    rule = recommended(rod.elements)
    kind = 2 if np.any(rod.retardation) else 1 if rod.curvature else 0
    variant = (FOUR if len(rule) == 4 else FIVE) + kind
    return beam.part(VECTORS, rule, variant, rod, section, length, nodal)


ELEMENT, SPATIAL_ELEMENT = (
    beam.element(VECTORS, family, space, _part) for family, space in ((Quintics, PLANE), (SpatialQuintics, SPACE))
)
