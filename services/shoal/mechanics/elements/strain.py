"""Tension and moment at a point of a beam in R^d, for values of `simd`; theory in `beam`."""

from __future__ import annotations

from numba import njit

from shoal.compile.simd import EIGHT, spread
from shoal.compile.tuples import dot, minus, plus, times
from shoal.mechanics.elements.batch import rest

STRAIGHT = 1.5e-8
"""Curvature times length of an element, squared, at which half of a turn of its plane is damped: the root of eps."""


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
def less(turn, angle):  # type: ignore[no-untyped-def]
    """A turn less that of the stress-free shape, which is zero but in the plane."""
    return (turn[0] - angle, *turn[1:])


@njit(error_model="numpy", forceinline=True)
def bend(damped, flat, k, rate, change, relaxed, angle, stiffness, eta, straight):  # type: ignore[no-untyped-def]
    """The moment over |r'|^2 at a point, its turn, and the power lost; flat: 1/|r'|^2, k: r' ^ L r'', change: its rate.

    In space the rate of the size of the turn is damped, and of a straight element that of the turn: without a frame of
    the section, a turn whose plane changes is not distinguished from a rigid rotation. The plane of a straight element
    is round-off, which the first rate alone would amplify as the turn passes zero. straight: `STRAIGHT` in the units of
    the turn.
    """
    stiffness = stiffness * relaxed
    turn = times(flat, k)
    bent, lost = less(turn, angle), 0.0 * flat
    if damped:
        turning = times(flat, minus(change, times(2.0 * rate, turn)))
        resisted = turning
        if len(turn) > 1:
            square = dot(turn, turn) + straight
            resisted = plus(times(dot(turn, turning) / square, turn), straight / square, turning)
        bent = plus(bent, eta, resisted)
        lost = eta * stiffness * dot(turning, resisted)
    return times(stiffness * flat, bent), turn, lost
