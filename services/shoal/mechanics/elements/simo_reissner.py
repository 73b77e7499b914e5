"""Simo and Reissner's rod in the plane: stretch, shear, bending, and the inertia of sections that turn.

Reissner 1972; Simo 1985. A node has r, r' and d, the unit normal of its section. The centreline is the cubic Hermite
curve, and the shear changes linearly along an element: with it, uniform shear and the bending that goes with it are
exact, so that nothing locks, and errors fall with the fourth power of the length. Strains are in
`simo_reissner_strains`; the rules are those of the reduced cable. Kelvin-Voigt damping adds the retardation times the
rate to every strain.

The mass is constant: that of the cable, and rho I of a normal that is linear in the coordinates, r' and the line
through d - r' at both nodes. No constraint holds |d| = 1, but the stiffness kappa G A per length: a section that turns
at omega makes d longer by rho I omega^2/(kappa G A), and only its own inertia knows.

Coefficients: 1/L [1/m], EA L, kappa G A L, EI/L [N m], retardation [s]; reference: the strains of the unstrained
element. Rows: x and y of r1, r1', d1, r2, r2', d2.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT, load, spread, store
from shoal.compile.tuples import minus, plus, times
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.batch import (
    VARIANT,
    add_rows,
    add_sum,
    coefficient,
    coefficients,
    kept,
    put,
    rests,
    rows,
    together,
)
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.simo_reissner_strains import (
    AXIAL,
    BENDING,
    STRAINS,
    TURNED,
    change,
    gradient,
    rates,
    strains,
)
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS, COEFFICIENTS = 12, 5
ELASTIC, DAMPED = 0, 1
"""Variants."""
_ROWS, _STIFF, _STRAINS = (0,) * ROWS, (0,) * (COEFFICIENTS - 1), (0,) * STRAINS
"""Tuples as long as those of the rows, coefficients and strains."""


class ShearRods(Family):
    """Simo and Reissner's rods."""


@njit(error_model="numpy", forceinline=True)
def _numbers(tile, family, number, lane):  # type: ignore[no-untyped-def]
    """Coefficients without the retardation, and reference of elements."""
    stiff = coefficients(_STIFF, tile, family, number, lane, COEFFICIENTS, 0)
    return stiff, rests(_STRAINS, tile, family, number, lane, 0)


@njit(error_model="numpy", forceinline=True)
def _state(tile, family, number, lane, z):  # type: ignore[no-untyped-def]
    """All rows."""
    return rows(_ROWS, tile, family, number, lane, ROWS, 0, z)


@njit(error_model="numpy", forceinline=True)
def _lost(stiff, rate):  # type: ignore[no-untyped-def]
    """Power lost to a retardation of one second."""
    _, ea, ga, ei = stiff
    total = spread(EIGHT, 0.0)
    for k in range(len(AXIAL)):
        total = total + AXIAL[k, 1] * (ea * rate[2 * k] * rate[2 * k] + ga * rate[2 * k + 1] * rate[2 * k + 1])
    for k in range(len(BENDING)):
        total = total + BENDING[k, 1] * ei * rate[6 + k] * rate[6 + k]
    return total


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile) - family.spare, len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            state = _state(tile, family, number, lane, z)
            if moving and family.plan[PLAN * number + VARIANT] == DAMPED:
                eta = coefficient(tile, family, number, lane, COEFFICIENTS, COEFFICIENTS - 1)
                rate = rates(state, _state(tile, family, number, lane, zdot), stiff[0])
                free = plus(free, -eta, rate)
                add_sum(tile, lane, count, w, power, eta * _lost(stiff, rate))
            _, g = gradient(state, stiff, free)
            add_rows(tile, family, number, lane, count, w, f, times(-1.0, g))
        number += count


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    number, total = 0, shift(energy, row * len(tile))
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            found, _ = gradient(_state(tile, family, number, lane, z), stiff, free)
            add_sum(tile, lane, count, w, total, found)
        number += count


@njit(error_model="numpy", forceinline=True)
def _columns(tile: Tile, viscous: bool, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """Column by column: what a unit of each coordinate changes, or of its rate; viscous is a constant of the call."""
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            state = _state(tile, family, number, lane, z)
            if viscous:
                bare = strains(state, stiff[0])
                eta = coefficient(tile, family, number, lane, COEFFICIENTS, COEFFICIENTS - 1)
                _, still = gradient(state, stiff, bare)  # without stress, but for the director's length
            for column in range(ROWS):
                for k in range(ROWS):
                    store(w, len(EIGHT) * (1 + k), spread(EIGHT, 1.0 if k == column else 0.0))
                unit = kept(_ROWS, w, 1, 1)
                if viscous:
                    _, g = gradient(state, stiff, plus(bare, -eta, rates(state, unit, stiff[0])))
                    g = minus(g, still)
                else:
                    g = change(state, unit, stiff, free)
                for k in range(ROWS):
                    store(w, len(EIGHT) * (1 + ROWS + k), g[k])
                for k in range(ROWS):
                    row = first + ROWS * ROWS * number + ROWS * k + column
                    put(tile, lane, count, w, out, row, ROWS * ROWS, load(EIGHT, w, len(EIGHT) * (1 + ROWS + k)))
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int, viscous: bool) -> None:
    """See `families.tangent`."""
    _columns(tile, viscous, family, z, w, out, first)


implement(
    ShearRods,
    Kernel(ROWS, COEFFICIENTS, 1),
    force=force,
    potential=potential,
    stiffness=stiffness,
)


def _at_rest(length: Number, nodal: list[Number]) -> list[Number]:
    """The strains of the unstrained element, whose sections are at right angles to its axis."""
    first, slope, _, second, other, _ = nodal
    middle = 1.5 * (second - first) / length - 0.25 * (slope + other)
    turn, beta = _angle(slope, other), _angle(slope + other, middle)
    none = 0.0 * turn
    return [none, none, np.hypot(*middle) - 1.0, none, none, none, turn + TURNED * beta, turn - TURNED * beta]


def _angle(a: Number, b: Number) -> Number:
    return np.arctan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def entry(
    young: Number,
    shearing: Number,
    area: Number,
    bending: Number,
    length: Number,
    free: list[Number],
    retardation: Number = 0.0,
) -> Entry:
    """One element.

    young: Young's modulus [Pa]; shearing: stiffness kappa G A [N]; area [m^2]; bending: second moment [m^4]; free:
    strains at rest; retardation [s].
    """
    numbers = [1.0 / length, young * area * length, shearing * length, young * bending / length]
    damped = bool(np.any(retardation))
    variant = DAMPED if damped else ELASTIC
    return Entry(BENDING, variant, damped, [*numbers, retardation + 0.0 * length], free)


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number]) -> Entry:
    young: Number = rod.modulus
    nu = rod.poisson_ratio
    shearing = section.shear(nu) * young / (2 * (1 + nu)) * section.area
    free = _at_rest(length, nodal) if rod.curvature else [0.0] * STRAINS
    return entry(young, shearing, section.area, section.bending, length, free, rod.retardation)


def _nodal_vectors(rod: Rod, s: Number) -> list[Number]:
    tangent = beam.tangent(rod, s)
    return [tangent, tangent]


def _normal(x: Number, length: Number) -> list[Number]:
    """The normal of the section: r', and the line through d - r' at both nodes."""
    first, slope, second, other = beam.shape(beam.CUBIC, x, length, 1)
    return [first, slope - (1 - x), 1 - x + 0.0 * length, second, other - x, x + 0.0 * length]


_POINTS = np.polynomial.legendre.leggauss(3)


def _mass(density: Number, section: Section, length: Number) -> list[list[Number]]:
    """Return the mass of the cable, with the inertia of the sections, whose normal is of second degree."""
    cable = [beam.padded(row) for row in beam.mass_matrix(beam.CUBIC, density * section.area, length)]
    full = [*cable[:2], [0.0] * 6, *cable[2:], [0.0] * 6]
    for xi, weight in zip(*_POINTS, strict=True):
        normal = _normal((1 + xi) / 2, length)
        share = density * section.bending * length * weight / 2
        full = [
            [m + share * a * b for m, b in zip(row, normal, strict=True)] for row, a in zip(full, normal, strict=True)
        ]
    return full


ELEMENT = Element(
    family=ShearRods,
    nodal_vectors=_nodal_vectors,
    position_shape=lambda x, y, length: beam.padded(beam.shape(beam.CUBIC, x, length, 0)),
    direction_shape=lambda x, y, length: _normal(x, length),
    mass=_mass,
    weight=lambda line, length: beam.padded(beam.weight(beam.CUBIC, line, length)),
    part=_part,
    clamped=1,
)
