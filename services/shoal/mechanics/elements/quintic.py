"""The quintic beam element: nodes with position, slope and second derivative; theory in `beam`.

A quarter of the elements of the cubic one serve the same accuracy; its force keeps sums in the work space, row by row.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import plane
from shoal.mechanics.elements import beam, beam_tangent
from shoal.mechanics.elements.beam_tangent import curve, gather
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.scene import Rod

ROWS = 2 * beam.QUINTIC
ELASTIC, DAMPED = range(2)
"""Variants."""

# Rows of the work space: scaled vectors, their rates, forces on them.
_X, _RATE, _FORCE = 0, 10, 20


class Quintics(Family):
    """Quintic beam elements. rows: x and y of r1, r1', r1'', r2, r2', r2''. Numbers: as in `beam`."""


def recommended(elements: int) -> Array:
    """The rule with the least error on coarse meshes, for a rod of so many elements.

    Four points do not see the stretch r' = P_4. Neighbours, which share r' and r'', forbid it; a rod of one element
    needs a fifth point.
    """
    points = 4 if elements > 1 else 5
    return beam.quadrature(beam.QUINTIC, points, points)


@njit(cache=True, error_model="numpy", forceinline=True)
def _scatter(tile: Tile, family: Family, number: int, w: Array, f: Array) -> None:
    """Subtract dU/dX, in the force rows of w, from the rows of f."""
    width = len(tile)
    order = beam.QUINTIC // 2
    base = beam.COEFFICIENTS * number * width
    for component in range(2):
        at = 2 * beam.QUINTIC * number + component
        a, b = family.rows[at] * width, family.rows[at + beam.QUINTIC] * width
        source = (_FORCE + component) * width
        for lane in range(width):
            value = w[source + lane] * family.coefficients[base + lane]
            f[a + lane] += value
            f[b + lane] -= value
        for node in range(2):
            for j in range(1, order):
                a = family.rows[at + 2 * (node * order + j)] * width
                source = (_FORCE + 2 * (node * (order - 1) + j) + component) * width
                if j == 1:
                    for lane in range(width):
                        f[a + lane] -= w[source + lane]
                else:
                    for lane in range(width):
                        f[a + lane] -= w[source + lane] / family.coefficients[base + lane]


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def _force_points(tile: Tile, damped: bool, family: Family, number: int, w: Array, power: Array) -> None:
    """Add dU/dX and the damping forces to the force rows of w; damped is a constant of the call."""
    width = len(tile)
    inner = beam.QUINTIC - 1
    first, rule = family.plan[PLAN * number], family.plan[PLAN * number + 2]
    base = beam.COEFFICIENTS * number * width
    for g in range(family.plan[PLAN * number + 1]):
        at = 2 * beam.QUINTIC * (first + g)
        axial_weight, bending_weight = family.table[at + 2 * inner], family.table[at + 2 * inner + 1]
        rest = (rule + 2 * g) * width
        for lane in range(width):
            px, py, cx, cy = curve(family.table, at, inner, w, _X, width, lane)
            shrink = 1.0 / np.sqrt(px * px + py * py)
            flat = shrink * shrink
            inverse = family.reference[rest + lane]
            k_ = (px * cy - py * cx) * flat
            ax, ay = cy - 2.0 * k_ * px, -cx - 2.0 * k_ * py  # |p|^2 dk/dp; |p|^2 dk/dc = (-py, px)
            axial = axial_weight * family.coefficients[base + width + lane]
            bending = bending_weight * family.coefficients[base + 2 * width + lane] * inverse
            strain = inverse - shrink  # eps/|p|
            angle = k_ - family.reference[rest + width + lane]
            if damped:
                eta = family.coefficients[base + 3 * width + lane]
                ux, uy, vx, vy = curve(family.table, at, inner, w, _RATE, width, lane)
                stretch_rate = (px * ux + py * uy) * shrink
                angle_rate = (ax * ux + ay * uy - py * vx + px * vy) * flat
                strain += eta * inverse * stretch_rate * shrink
                angle += eta * angle_rate
                power[lane] += eta * (axial * inverse * stretch_rate**2 + bending * angle_rate**2)
            tension, moment = axial * strain, bending * angle * flat
            gx, gy = tension * px + moment * ax, tension * py + moment * ay
            hx, hy = -moment * py, moment * px
            for k in range(inner):
                a, d = family.table[at + k], family.table[at + inner + k]
                w[(_FORCE + 2 * k) * width + lane] += a * gx + d * hx
                w[(_FORCE + 2 * k + 1) * width + lane] += a * gy + d * hy


@njit(cache=True, error_model="numpy", forceinline=True)
def _add(tile: Tile, damped: bool, family: Family, number: int, f: Array, w: Array, power: Array) -> None:
    for i in range(_FORCE * len(tile), (_FORCE + 2 * beam.QUINTIC - 2) * len(tile)):
        w[i] = 0.0
    _force_points(tile, damped, family, number, w, power)
    _scatter(tile, family, number, w, f)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    for number in range(family.size):
        gather(tile, beam.QUINTIC, family, number, z, w, _X)
        if moving and family.plan[PLAN * number + 3] == DAMPED:
            gather(tile, beam.QUINTIC, family, number, zdot, w, _RATE)
            _add(tile, True, family, number, f, w, power)
        else:
            _add(tile, False, family, number, f, w, power)


implement(
    Quintics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=beam_tangent.energy,
    stiffness=beam_tangent.stiffness,
    viscosity=beam_tangent.viscosity,
)


def _nodal_vectors(rod: Rod, s: Number) -> list[Number]:
    tangent = beam.tangent(rod, s)
    curvature = sum(k * s**power for power, k in enumerate(rod.curvature)) + 0.0 * s
    return [tangent, curvature * plane.quarter(tangent)]


def _part(rod: Rod, height: Number, width: Number, length: Number, nodal: list[Number]) -> Entry:
    variant = DAMPED if np.any(rod.retardation) else ELASTIC
    return beam.part(beam.QUINTIC, recommended(rod.elements), variant, rod, height, width, length, nodal)


ELEMENT = beam.element(beam.QUINTIC, Quintics, _nodal_vectors, _part)
