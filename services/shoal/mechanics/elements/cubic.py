"""The force of the cubic beam element: the one kernel in which most runs spend their time.

The theory is that of `beam`; here its sums are written out for two nodes with position and slope. With r(s) the Hermite
curve, d = (r2 - r1)/L, p = r1', q = r2', the derivatives r' and L r'' have coefficients in (d, p, q) that do not depend
on the element: the tables below, which are constants of the compiled code, so that the loops over their points unroll.
Berzeri and Shabana 2000; Gerstmayr and Shabana 2006; with the reduced rule, Gerstmayr and Irschik 2008.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.errors import InputError
from shoal.mechanics.elements import beam, beam_tangent
from shoal.mechanics.elements.families import PLAN, Entry, Family, Kernel, implement
from shoal.mechanics.numerics.tile import Array, Number, Tile
from shoal.mechanics.numerics.vector import add, copy
from shoal.scene import Rod

ROWS = 2 * beam.CUBIC
FULL, REDUCED, CURVED, DAMPED = range(4)
"""Variants: straight and elastic by either rule; curved, and curved or not and damped, by the full one."""


class Cubics(Family):
    """Cubic beam elements. rows: x and y of r1, r1', r2, r2'. coefficients, reference: as in `beam`."""


FULL_RULE = beam.quadrature(beam.CUBIC, 5, 3)
REDUCED_RULE = beam.lobatto(beam.CUBIC, 2)
# Columns: coefficients of r' in (d, p, q), those of L r'', weights of the axial and of the bending strain.
_FULL_AXIAL, _FULL_BENDING = FULL_RULE[:5], FULL_RULE[5:]
_REDUCED_AXIAL, _REDUCED_BENDING = REDUCED_RULE[:3], REDUCED_RULE[3:]
_AXIAL, _BENDING = 6, 7

# Rows of the work space: coordinates of the element, force on them, rates.
_FORCE, _RATE = ROWS, 2 * ROWS


@njit(cache=True, error_model="numpy", inline="always")
def _mixed(a, b, c, d, p, q):  # type: ignore[no-untyped-def]
    """a d + b p + c q; where a is the constant zero, nothing is done for it."""
    return b * p + c * q if a == 0.0 else a * d + b * p + c * q


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract", "nsz", "arcp"})
def _force(
    tile: Tile,
    curved: bool,
    damped: bool,
    axial: Array,
    bending: Array,
    family: Family,
    number: int,
    w: Array,
    power: Array,
) -> None:
    """Force of the coordinates in w, into its next rows; curved, damped and the tables are constants of the call."""
    width = len(tile)
    base = beam.COEFFICIENTS * number * width
    rest = family.plan[PLAN * number + 2] * width
    out, rate = _FORCE * width, _RATE * width
    coefficient, reference = family.coefficients, family.reference
    for lane in range(width):
        inverse = coefficient[base + lane]
        ea = coefficient[base + width + lane]
        ei = coefficient[base + 2 * width + lane]
        dx = (w[4 * width + lane] - w[lane]) * inverse
        dy = (w[5 * width + lane] - w[width + lane]) * inverse
        px, py = w[2 * width + lane], w[3 * width + lane]
        qx, qy = w[6 * width + lane], w[7 * width + lane]
        if damped:
            eta = coefficient[base + 3 * width + lane]
            rdx = (w[rate + 4 * width + lane] - w[rate + lane]) * inverse
            rdy = (w[rate + 5 * width + lane] - w[rate + width + lane]) * inverse
            rpx, rpy = w[rate + 2 * width + lane], w[rate + 3 * width + lane]
            rqx, rqy = w[rate + 6 * width + lane], w[rate + 7 * width + lane]
            lost = 0.0
        fdx, fdy, fpx, fpy, fqx, fqy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for g in range(axial.shape[0]):
            a, b, c = axial[g, 0], axial[g, 1], axial[g, 2]
            tx, ty = _mixed(a, b, c, dx, px, qx), _mixed(a, b, c, dy, py, qy)
            shrink = 1.0 / np.sqrt(tx * tx + ty * ty)
            relaxed = reference[rest + 2 * g * width + lane] if curved else 1.0
            strain = relaxed - shrink  # eps/|r'|
            stiffness = ea * axial[g, _AXIAL]
            if damped:
                ux, uy = _mixed(a, b, c, rdx, rpx, rqx), _mixed(a, b, c, rdy, rpy, rqy)
                stretching = (tx * ux + ty * uy) * shrink
                strain += eta * relaxed * stretching * shrink
                lost += eta * stiffness * relaxed * stretching * stretching
            n = stiffness * strain
            tx, ty = n * tx, n * ty
            if a != 0.0:
                fdx, fdy = fdx + a * tx, fdy + a * ty
            fpx, fqx = fpx + b * tx, fqx + c * tx
            fpy, fqy = fpy + b * ty, fqy + c * ty
        for g in range(bending.shape[0]):
            a, b, c = bending[g, 0], bending[g, 1], bending[g, 2]
            d, e, h = bending[g, 3], bending[g, 4], bending[g, 5]
            tx, ty = _mixed(a, b, c, dx, px, qx), _mixed(a, b, c, dy, py, qy)
            cx, cy = _mixed(d, e, h, dx, px, qx), _mixed(d, e, h, dy, py, qy)
            flat = 1.0 / (tx * tx + ty * ty)
            turn = (tx * cy - ty * cx) * flat
            ax, ay = cy - 2.0 * turn * tx, -cx - 2.0 * turn * ty
            stiffness, angle = ei * bending[g, _BENDING], turn
            if curved:
                at = rest + 2 * (axial.shape[0] + g) * width + lane
                stiffness, angle = stiffness * reference[at], turn - reference[at + width]
            if damped:
                ux, uy = _mixed(a, b, c, rdx, rpx, rqx), _mixed(a, b, c, rdy, rpy, rqy)
                vx, vy = _mixed(d, e, h, rdx, rpx, rqx), _mixed(d, e, h, rdy, rpy, rqy)
                turning = (ax * ux + ay * uy - ty * vx + tx * vy) * flat
                angle += eta * turning
                lost += eta * stiffness * turning * turning
            m = stiffness * angle * flat
            gx, gy, hx, hy = m * ax, m * ay, -m * ty, m * tx
            fdx, fpx, fqx = fdx + a * gx + d * hx, fpx + b * gx + e * hx, fqx + c * gx + h * hx
            fdy, fpy, fqy = fdy + a * gy + d * hy, fpy + b * gy + e * hy, fqy + c * gy + h * hy
        w[out + lane], w[out + width + lane] = fdx * inverse, fdy * inverse
        w[out + 2 * width + lane], w[out + 3 * width + lane] = -fpx, -fpy
        w[out + 4 * width + lane], w[out + 5 * width + lane] = -fdx * inverse, -fdy * inverse
        w[out + 6 * width + lane], w[out + 7 * width + lane] = -fqx, -fqy
        if damped:
            power[lane] += lost


@njit(cache=True, error_model="numpy")
def force(tile: Tile, family: Family, z: Array, zdot: Array, f: Array, w: Array, power: Array, moving: bool) -> None:
    """See `families.add_force`."""
    for number in range(family.size):
        for k in range(ROWS):
            copy(tile, w, k, z, family.rows[ROWS * number + k])
        variant = family.plan[PLAN * number + 3]
        if variant == FULL:
            _force(tile, False, False, _FULL_AXIAL, _FULL_BENDING, family, number, w, power)
        elif variant == REDUCED:
            _force(tile, False, False, _REDUCED_AXIAL, _REDUCED_BENDING, family, number, w, power)
        elif variant == DAMPED and moving:
            for k in range(ROWS):
                copy(tile, w, _RATE + k, zdot, family.rows[ROWS * number + k])
            _force(tile, True, True, _FULL_AXIAL, _FULL_BENDING, family, number, w, power)
        else:
            _force(tile, True, False, _FULL_AXIAL, _FULL_BENDING, family, number, w, power)
        for k in range(ROWS):
            add(tile, f, family.rows[ROWS * number + k], w, _FORCE + k)


implement(
    Cubics,
    Kernel(ROWS, beam.COEFFICIENTS, 1),
    force=force,
    potential=beam_tangent.energy,
    stiffness=beam_tangent.stiffness,
    viscosity=beam_tangent.viscosity,
)


def _part(rod: Rod, height: Number, width: Number, length: Number, nodal: list[Number]) -> Entry:
    reduced, damped = rod.quadrature == "reduced", bool(np.any(rod.retardation))
    if reduced and (damped or rod.curvature):
        raise InputError("quadrature: a curved or damped ancf-cable has the full quadrature")
    variant = REDUCED if reduced else DAMPED if damped else CURVED if rod.curvature else FULL
    rule = REDUCED_RULE if reduced else FULL_RULE
    return beam.part(beam.CUBIC, rule, variant, rod, height, width, length, nodal)


ELEMENT = beam.element(beam.CUBIC, Cubics, lambda rod, s: [beam.tangent(rod, s)], _part)
