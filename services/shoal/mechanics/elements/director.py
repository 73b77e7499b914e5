"""The director rod: a cubic centreline with one director a node, for bending about two axes, torsion and curved shapes.

A node has r, r' and d, an axis of the section, with |d| = 1 and d . r' = 0 (`Element.products`). The smallest rotation
carries both directors from their tangents to that in the middle of the element, t_m, where phi is the angle between
them. At x the section is that halfway between, turned by phi (x - 1/2) about t_m into (e, f), and carried by the
smallest rotation from t_m to t. With h = L t' and u = h . t_m/(1 + t . t_m) its strains, times L, are

    bending:  k_y = (h - u t) . e,    k_z = (h - u t) . f,    torsion:  phi - t_m . (t x h)/(1 + t . t_m),

and the energy that of EI_y (k_y - k_y0)^2, EI_z (k_z - k_z0)^2 and GJ, by two points of Gauss, with the stretching of
the cable by three of Lobatto. Kelvin-Voigt damping adds the retardation times the rate to every strain. Twist in an
element stays below a right angle or so; it is linear, and the rod of second order.

Coefficients: 1/L [1/m], EA L, GJ/L, EI_y/L (in the plane of t and d), EI_z/L [N m], retardation [s]; reference: the
strains of the unstrained element. Rows: x, y, z of r1, r1', d1, r2, r2', d2. The mass has the polar inertia of the
section on d, which stands for its rotary inertia as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from shoal.compile.pointers import pointer, shift
from shoal.compile.simd import EIGHT, load, root, spread, store
from shoal.compile.tuples import dot, minus, plus, times
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
from shoal.mechanics.elements.director_strains import AXIAL, BENDING, STRAINS, gradient, strains
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.elements.hermite import curve
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

ROWS, COEFFICIENTS = 18, 6
ELASTIC, DAMPED = 0, 1
"""Variants."""
_STEP = 5e-4
"""Of the differences of the force that are the stiffness, in slopes; times the length of the element in places."""
_INSTANT = 1e-7
"""Of the differences of the strains that are their rates [s]."""
_ROWS, _STIFF, _STRAINS = (0,) * ROWS, (0,) * (COEFFICIENTS - 1), (0,) * STRAINS
"""Tuples as long as those of the rows, coefficients and strains."""


class DirectorRods(Family):
    """Director rods."""


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
def _kept(w):  # type: ignore[no-untyped-def]
    """All rows, as the stiffness keeps them."""
    return kept(_ROWS, w, 1, 1)


@njit(error_model="numpy", forceinline=True)
def _rates(z, v, inverse):  # type: ignore[no-untyped-def]
    """Rates of the strains; those of stretching, which are stiff, without differences."""
    ahead, behind = strains(plus(z, _INSTANT, v), inverse), strains(plus(z, -_INSTANT, v), inverse)
    bent = times(0.5 / _INSTANT, minus(ahead[0:6], behind[0:6]))
    chord, turning = plus(z[9:12], -1.0, z[0:3]), plus(v[9:12], -1.0, v[0:3])
    middle, _ = curve(0.5, times(inverse, chord), z[3:6], z[12:15])
    moving, _ = curve(0.5, times(inverse, turning), v[3:6], v[12:15])
    return (*bent, _grown(z[3:6], v[3:6]), _grown(middle, moving), _grown(z[12:15], v[12:15]))


@njit(error_model="numpy", forceinline=True)
def _grown(s, v):  # type: ignore[no-untyped-def]
    """The rate of the length of a slope."""
    return dot(s, v) / root(dot(s, s))


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
                rate = _rates(state, _state(tile, family, number, lane, zdot), stiff[0])
                free = plus(free, -eta, rate)
                lost = spread(EIGHT, 0.0)
                for k in range(len(BENDING)):
                    a, b, c = rate[3 * k], rate[3 * k + 1], rate[3 * k + 2]
                    lost = lost + BENDING[k, 1] * (stiff[2] * a * a + stiff[3] * b * b + stiff[4] * c * c)
                for k in range(len(AXIAL)):
                    lost = lost + AXIAL[k, 1] * stiff[1] * rate[6 + k] * rate[6 + k]
                add_sum(tile, lane, count, w, power, eta * lost)
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
    """Column by column: differences of the force, or the damping force of a unit rate."""
    number = 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            stiff, free = _numbers(tile, family, number, lane)
            state = _state(tile, family, number, lane, z)
            if viscous:
                free = strains(state, stiff[0])
                eta = coefficient(tile, family, number, lane, COEFFICIENTS, COEFFICIENTS - 1)
            for column in range(ROWS):
                step = _STEP * (1.0 / stiff[0] if column % 9 < 3 else spread(EIGHT, 1.0))
                for k in range(ROWS):
                    store(w, len(EIGHT) * (1 + k), state[k])
                here = len(EIGHT) * (1 + column)
                middle = load(EIGHT, w, here)
                for side in range(4):  # +h, -h, +2h, -2h
                    sign = 1.0 - 2.0 * (side % 2)
                    weight = 8.0 * sign if side < 2 else -sign
                    store(w, here, middle + sign * (1.0 + side // 2) * step)
                    other = free
                    if viscous:
                        other = plus(free, -1.0 * eta, minus(strains(_kept(w), stiff[0]), free))
                    _, g = gradient(state if viscous else _kept(w), stiff, other)
                    for k in range(ROWS):
                        place = len(EIGHT) * (1 + ROWS + k)
                        value = weight * g[k]
                        if side > 0:
                            value = value + load(EIGHT, w, place)
                        store(w, place, value)
                        if side == 3:
                            row = first + ROWS * ROWS * number + ROWS * k + column
                            put(tile, lane, count, w, out, row, ROWS * ROWS, value / (12.0 * step))
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int, viscous: bool) -> None:
    """See `families.tangent`: differences of fourth order of the force; 1e-13 of the largest is left of round-off."""
    _columns(tile, viscous, family, z, w, out, first)


implement(
    DirectorRods,
    Kernel(ROWS, COEFFICIENTS, 1),
    force=force,
    potential=potential,
    stiffness=stiffness,
)


@njit(cache=True, error_model="numpy")
def _strains_of(w: Array, out: Array) -> None:
    """Strains of eight elements, (9, 8), from 1/L and their rows, (19, 8)."""
    found = strains(_kept(pointer(w)), load(EIGHT, pointer(w), 0))
    for k in range(STRAINS):
        store(pointer(out), len(EIGHT) * k, found[k])


def _at_rest(rod: Rod, length: Number, nodal: list[Number]) -> list[Number]:
    """The strains of the unstrained element."""
    if rod.straight:
        return [0.0] * STRAINS
    vectors = [row for vector in nodal for row in vector]
    rows = np.array(np.broadcast_arrays(1.0 / np.asarray(length), *vectors)).reshape(1 + ROWS, -1)
    lanes = rows.shape[1]
    found = np.zeros((STRAINS, lanes))
    for first in range(0, lanes, len(EIGHT)):
        here = np.minimum(np.arange(first, first + len(EIGHT)), lanes - 1)
        some = np.zeros((STRAINS, len(EIGHT)))
        _strains_of(np.ascontiguousarray(rows[:, here]), some)
        found[:, here] = some
    return list(found)


def _part(rod: Rod, section: Section, length: Number, nodal: list[Number], across: bool = False) -> Entry:
    free = _at_rest(rod, length, nodal)
    young: Number = rod.modulus
    shear = young / (2 * (1 + rod.poisson_ratio))
    torsion = section.torsion if rod.torsion_constant is None else rod.torsion_constant
    bending = (section.side, section.bending) if across else (section.bending, section.side)
    return entry(young, shear * torsion, section.area, bending, length, free, rod.retardation)


def entry(
    young: Number,
    twisting: Number,
    area: Number,
    bending: tuple[Number, Number],
    length: Number,
    free: list[Number],
    retardation: Number = 0.0,
) -> Entry:
    """One element.

    young: Young's modulus [Pa]; twisting: stiffness GJ [N m^2]; area [m^2]; bending: second moments along the director
    and across it [m^4]; free: strains at rest; retardation [s].
    """
    bend = [young * moment / length for moment in bending]
    numbers = [1.0 / length, young * area * length, twisting / length, *bend, retardation + 0.0 * length]
    damped = bool(np.any(retardation))
    return Entry(BENDING, DAMPED if damped else ELASTIC, damped, numbers, free)


def _nodal_vectors(rod: Rod, s: Number) -> list[Number]:
    _, axes = unstrained(rod, s)
    return [axes[:, 0], axes[:, 1]]


def _nodal_vectors_across(rod: Rod, s: Number) -> list[Number]:
    _, axes = unstrained(rod, s)
    return [axes[:, 0], axes[:, 2]]


def _mass(density: Number, section: Section, length: Number) -> list[list[Number]]:
    """Return the mass of the cable, with the polar inertia of the section on the directors (interpolated linearly)."""
    cable = beam.mass_matrix(beam.CUBIC, density * section.area, length)
    polar = density * section.polar * length
    full = [beam.padded(row) for row in cable]
    first, second = [0.0, 0.0, polar / 3, 0.0, 0.0, polar / 6], [0.0, 0.0, polar / 6, 0.0, 0.0, polar / 3]
    return [*full[:2], first, *full[2:], second]


def _stretching(axial: Number, length: Number) -> list[list[Number]]:
    rows = [beam.padded(row) for row in beam.stretching(beam.CUBIC, axial, length)]
    return [*rows[:2], [0.0] * 6, *rows[2:], [0.0] * 6]


ALONG_Z = Element(
    family=DirectorRods,
    nodal_vectors=_nodal_vectors_across,
    position_shape=lambda x, y, length: beam.padded(beam.shape(beam.CUBIC, x, length, 0)),
    direction_shape=lambda x, y, length: beam.padded(beam.shape(beam.CUBIC, x, length, 1)),
    mass=_mass,
    weight=lambda line, length: beam.padded(beam.weight(beam.CUBIC, line, length)),
    part=lambda rod, section, length, nodal: _part(rod, section, length, nodal, across=True),
    stretching=_stretching,
    products=((1, 1, 1.0), (0, 1, 0.0)),
    director=2,
)
"""The same rod with the local z axis of its sections as their director."""

ELEMENT = replace(ALONG_Z, nodal_vectors=_nodal_vectors, part=_part, director=1, other=ALONG_Z)
