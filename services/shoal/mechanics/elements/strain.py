"""Tension and moment at a point of a beam, for values of `simd`; theory in `beam`."""

from __future__ import annotations

from numba import njit

from shoal.compile.simd import EIGHT, spread
from shoal.mechanics.elements.batch import rest


@njit(error_model="numpy", forceinline=True)
def reference(tile, curved, family, number, lane, k, usual):  # type: ignore[no-untyped-def]
    """Entry k of the reference of curved elements, and what it is for straight ones."""
    return rest(tile, family, number, lane, k) if curved else spread(EIGHT, usual)


@njit(error_model="numpy", forceinline=True)
def stretch(damped, shrink, rate, relaxed, stiffness, eta):  # type: ignore[no-untyped-def]
    """The tension over |r'| at a point, EA (1/|r0'| - 1/|r'|), and the power lost; shrink: 1/|r'|, rate: r' . u."""
    strain, lost = relaxed - shrink, 0.0 * shrink
    if damped:
        stretching = relaxed * rate * shrink
        strain = strain + eta * stretching * shrink
        lost = eta * stiffness * stretching * (rate * shrink)
    return stiffness * strain, lost


@njit(error_model="numpy", forceinline=True)
def bend(damped, flat, k, rate, change, inverse, angle, stiffness, eta):  # type: ignore[no-untyped-def]
    """The moment over |r'|^2 at a point, its turn, and the power lost; flat: 1/|r'|^2, k: r' x L r''."""
    stiffness = stiffness * inverse
    turn = k * flat
    bent, lost = turn - angle, 0.0 * flat
    if damped:
        turning = (change - 2.0 * turn * rate) * flat
        bent = bent + eta * turning
        lost = eta * stiffness * turning * turning
    return stiffness * bent * flat, turn, lost
