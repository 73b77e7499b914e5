"""Straight Bernoulli-Euler elements without torsion in space, of any order, elastic or damped.

The strains are those of `beam` for r0 straight, the curvature by its size: with p = r', c = L r'' and

    A = p . p,    B = p . c,    C = c . c,    k^2 = |p x c|^2/|p|^4 = C/A - (B/A)^2,

a point of weight w on the unit interval contributes w/2 (EA L (sqrt(A) - 1)^2 + EI/L k^2). These are dot products, so
that a rod that stays in a plane has the forces of the plane. A sign of k, which pre-curvature needs, they do not have:
the elements of the plane have a force of their own, which is cheaper as well. Bending has the same stiffness in all
directions, and twisting costs nothing.

Kelvin-Voigt material: N = EA (eps + eta deps/dt), M = EI (k + eta dk/dt). dk/dt is that of the size of the curvature,
k dk/dt over k: a curvature that turns about the axis loses nothing, since without a frame of the section
it cannot be separated from a rigid rotation. Where the element is straight, k^2 below `STRAIGHT`, M has no direction,
and no damping part.

Coefficients of an element are those of `beam`; it has no reference. Rows: x, y, z of each nodal vector in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT, load, root, spread, store
from shoal.errors import InputError
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.batch import add_sum, coefficient, put, together
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.families import PLAN, Entry, Family
from shoal.mechanics.elements.nodal import gather, part_of
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod
from shoal.scene.sections import Section

DIMENSIONS = 3
STRAIGHT = 1e-16
"""Curvature times length of an element, squared, that counts as none: a rounding error of a straight element's."""

# Vectors of the work space: one of `batch`; scaled vectors; factors of nodal vectors; p and c of a point; sums.
_X, _FACTOR, _P, _C, _SUM = 1, 16, 22, 25, 28


@njit(error_model="numpy", forceinline=True)
def bend(damped, flat, b, c, rate, turning, change, stiffness, eta):  # type: ignore[no-untyped-def]
    """Derivatives of the bending energy at a point by A/2, B and C/2, and the power lost.

    flat: 1/A; b, c: B and C; rate, turning, change: those of A/2, B and C/2.
    """
    along, lost = b * flat, 0.0 * flat
    square = c * flat - along * along
    if damped:
        product = flat * (change - c * flat * rate - along * (turning - 2.0 * along * rate))
        relative = product / (square + STRAIGHT)
        lost = eta * stiffness * product * relative
        stiffness = stiffness * (1.0 + eta * relative)
    by_c = stiffness * flat
    return by_c * (along * along - square), -by_c * along, by_c, lost


@njit(error_model="numpy", forceinline=True)
def _point(table, at, inner, w):  # type: ignore[no-untyped-def]
    """p and c at a point of the table into w; returns A, B and C."""
    none = spread(EIGHT, 0.0)
    a, b, c = none, none, none
    for m in range(DIMENSIONS):
        p, q = none, none
        for i in range(inner):
            x = load(EIGHT, w, len(EIGHT) * (_X + DIMENSIONS * i + m))
            p, q = p + table[at + i] * x, q + table[at + inner + i] * x
        store(w, len(EIGHT) * (_P + m), p)
        store(w, len(EIGHT) * (_C + m), q)
        a, b, c = a + p * p, b + p * q, c + q * q
    return a, b, c


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    vectors, table, total = family.side // DIMENSIONS, family.table, shift(energy, row * len(tile))
    inner, number = vectors - 1, 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
            ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
            ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
            gather(tile, DIMENSIONS, vectors, family, number, lane, inverse, z, w, _X, _FACTOR)
            stretched, bent = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
            for g in range(family.plan[PLAN * number + 1]):
                at = 2 * vectors * (family.plan[PLAN * number] + g)
                a, b, c = _point(table, at, inner, w)
                strain, along = root(a) - 1.0, b / a
                stretched = stretched + table[at + 2 * inner] * strain * strain
                bent = bent + table[at + 2 * inner + 1] * (c / a - along * along)
            add_sum(tile, lane, count, w, total, 0.5 * (ea * stretched + ei * bent))
        number += count


@njit(error_model="numpy", forceinline=True)
def _hessian(viscous, same, a, b, c, pm, pn, cm, cn, axial, bending):  # type: ignore[no-untyped-def]
    """Entries (m, n) of the second derivative by p, by (p, c), (c, p) and by c at a point, or of the damping there.

    same: 1 where m = n, otherwise 0.
    """
    flat = 1.0 / a
    shrink, along = root(flat), b * flat
    square = c * flat - along * along
    if viscous:
        # Dampings are products of the gradients of |p| and of k.
        factor, bent = axial * flat, bending / (square + STRAIGHT) * flat * flat
        vm, vn = (along * along - square) * pm - along * cm, (along * along - square) * pn - along * cn
        um, un = cm - along * pm, cn - along * pn
        return factor * pm * pn + bent * vm * vn, bent * vm * un, bent * um * vn, bent * um * un
    n, by_b, by_c, _ = bend(False, flat, b, c, a, a, a, bending, a)
    factor, four = bending * flat * flat, 4.0 * along
    by_p = same * (axial * (1.0 - shrink) + n) + axial * shrink * flat * pm * pn
    by_p = by_p + factor * ((4.0 * square - 2.0 * four * along) * pm * pn + four * (pm * cn + cm * pn) - cm * cn)
    mixed = same * by_b + factor * (four * pm * pn - 2.0 * pm * cn - cm * pn)
    other = same * by_b + factor * (four * pm * pn - cm * pn * 2.0 - pm * cn)
    return by_p, mixed, other, same * by_c - factor * pm * pn


@njit(error_model="numpy", forceinline=True)
def _blocks(tile: Tile, viscous: bool, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """Sum over the points of (a_i, d_i) H (a_j, d_j), component by component (m, n) of the nodal vectors."""
    vectors, side, table = family.side // DIMENSIONS, family.side, family.table
    order, inner, number = vectors // 2, vectors - 1, 0
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
            ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
            ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
            if viscous:
                eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
                ea, ei = ea * eta, ei * eta
            gather(tile, DIMENSIONS, vectors, family, number, lane, inverse, z, w, _X, _FACTOR)
            for m in range(DIMENSIONS):
                for n in range(m, DIMENSIONS):
                    same = 1.0 if m == n else 0.0
                    for k in range(inner * inner):
                        store(w, len(EIGHT) * (_SUM + k), spread(EIGHT, 0.0))
                    for g in range(family.plan[PLAN * number + 1]):
                        at = 2 * vectors * (family.plan[PLAN * number] + g)
                        a, b, c = _point(table, at, inner, w)
                        pm, pn = load(EIGHT, w, len(EIGHT) * (_P + m)), load(EIGHT, w, len(EIGHT) * (_P + n))
                        cm, cn = load(EIGHT, w, len(EIGHT) * (_C + m)), load(EIGHT, w, len(EIGHT) * (_C + n))
                        axial, bending = table[at + 2 * inner] * ea, table[at + 2 * inner + 1] * ei
                        pp, pc, cp, cc = _hessian(viscous, same, a, b, c, pm, pn, cm, cn, axial, bending)
                        for i in range(inner):
                            s, t = table[at + i], table[at + inner + i]
                            left, right = s * pp + t * cp, s * pc + t * cc
                            for j in range(inner):
                                place = len(EIGHT) * (_SUM + inner * i + j)
                                more = table[at + j] * left + table[at + inner + j] * right
                                store(w, place, load(EIGHT, w, place) + more)
                    for one in range(vectors):
                        for other in range(vectors):
                            place = _SUM + inner * part_of(order, one) + part_of(order, other)
                            value = load(EIGHT, w, len(EIGHT) * place) * load(EIGHT, w, len(EIGHT) * (_FACTOR + one))
                            value = value * load(EIGHT, w, len(EIGHT) * (_FACTOR + other))
                            row, column = DIMENSIONS * one + m, DIMENSIONS * other + n
                            start, step = first + side * side * number, side * side
                            put(tile, lane, count, w, out, start + side * row + column, step, value)
                            if m != n:
                                put(tile, lane, count, w, out, start + side * column + row, step, value)
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.tangent`."""
    _blocks(tile, False, family, z, w, out, first)


@njit(cache=True, error_model="numpy")
def viscosity(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """See `families.damping`."""
    _blocks(tile, True, family, z, w, out, first)


def part(rule: Array, variant: int, rod: Rod, section: Section, length: Number) -> Entry:
    """One element of a rod with this rule. Raises InputError for a curved one."""
    if rod.curvature:
        raise InputError(f"curvature: an {rod.element} is straight in space")
    axial, bending = rod.youngs_modulus * section.area, rod.youngs_modulus * section.bending
    numbers = [1.0 / length, axial * length, bending / length, rod.retardation + 0.0 * length]
    return Entry(rule, variant, bool(np.any(rod.retardation)), numbers, [])


def element(vectors: int, family: type, entry: Callable[[Rod, Section, Number, list[Number]], Entry]) -> Element:
    """A straight element in space as `Element` states it; its nodal vectors have three components."""

    def nodal_vectors(rod: Rod, s: Number) -> list[Number]:
        along: Any = np.stack([1.0 + 0.0 * np.asarray(s), 0.0 * np.asarray(s), 0.0 * np.asarray(s)])
        return [along, *[0.0 * along] * (vectors // 2 - 2)]

    return beam.element(vectors, family, nodal_vectors, entry)
