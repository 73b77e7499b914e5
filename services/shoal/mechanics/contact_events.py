"""Event location within a step: the first root of gaps and contact forces in its dense output.

A gap is looked at only where it could close: its rates at the ends times the step, doubled, against its size. There the
step is divided, and each part is judged by values and rates at both ends, so that a gap that closes and opens again is
seen by the root of its rate.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import kernels
from shoal.mechanics.contact import HIT, LIFT
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.scheme import Scheme, interpolate
from shoal.mechanics.marched import LoopRoom
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile

PARTS = 8
"""Parts of a step that are judged by their ends."""
NEVER = 2.0
ITERATIONS = 60
"""Of a root by halving and false position, by which it is known to round-off."""
VALUE, RATE, FORCE = range(3)
TOUCHING = 1e3
"""A start that leaves less of a gap, in units of its resolution, closes it."""


@njit(cache=True, error_model="numpy")
def begin(tile: Tile, m: Arrays, w: Work) -> None:
    """Keep gaps, rates and forces at the beginning of a step."""
    kernels.look(tile, m, w, w.z, w.zdot)
    _shift(tile, m, w)


@njit(cache=True, error_model="numpy")
def _shift(tile: Tile, m: Arrays, w: Work) -> None:
    g = w.gaps
    for at in range(m.gaps.size * len(tile)):
        g.value_before[at], g.rate_before[at], g.force_before[at] = g.value[at], g.rate[at], g.force[at]


@njit(cache=True, error_model="numpy")
def first(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, taken: float, tolerance: float
) -> float:
    """Return the fraction of the last step at which its first event is, NEVER if there is none; marks what it is about.

    t: beginning of the step [s]; taken: its length
    """
    g, count = w.gaps, m.gaps.size * len(tile)
    kernels.look(tile, m, w, w.z, w.zdot)
    near, holding = False, False
    for at in range(count):
        g.hit[at] = 0.0
        if g.closed[at] != 0.0:
            holding, near = True, near or g.force[at] < 0.0
        else:
            reach = 2.0 * taken * max(abs(g.rate_before[at]), abs(g.rate[at]))
            near = near or min(g.value_before[at], g.value[at]) < reach
    if not near:
        return NEVER
    for part in range(PARTS):
        left, right = part / PARTS, (part + 1) / PARTS
        _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
        found = NEVER
        for at in range(count):
            if g.closed[at] != 0.0:
                happens = g.force_before[at] >= 0.0 and g.force[at] < 0.0
            else:
                dips = g.rate_before[at] < 0.0 and g.rate[at] > 0.0
                happens = g.value[at] < -m.gaps.resolution or dips
            g.hit[at] = 1.0 if happens else 0.0
        if holding or _any(count, g.hit):
            found = _earliest(tile, scheme, m, w, k, t, left, right, taken, tolerance, holding)
        if found <= 1.0:
            return found
        _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
        _shift(tile, m, w)
    return NEVER


@njit(cache=True, error_model="numpy")
def _any(count: int, flags: Array) -> bool:
    found = False
    for at in range(count):
        found = found or flags[at] != 0.0
    return found


@njit(cache=True, error_model="numpy")
def _earliest(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, left: float, right: float, taken: float,
    tolerance: float, holding: bool,
) -> float:  # fmt: skip
    """Return the first root between two fractions of those that are marked, and leave the marks of its gaps alone."""
    g, count, found = w.gaps, m.gaps.size * len(tile), NEVER
    where = np.full(count, NEVER)
    for at in range(count):
        if g.hit[at] == 0.0:
            continue
        arguments = (tile, scheme, m, w, k, t)
        if g.closed[at] != 0.0:
            where[at] = _root(*arguments, left, right, taken, tolerance, holding, at, FORCE)
        else:
            start, end = left, right
            if g.rate_before[at] >= 0.0 and g.value_before[at] <= m.gaps.resolution:
                start = _root(*arguments, left, right, taken, tolerance, holding, at, RATE)
            _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
            if g.value[at] >= -m.gaps.resolution:
                end = _root(*arguments, left, right, taken, tolerance, holding, at, RATE)
                _at(tile, scheme, m, w, k, t, end, taken, tolerance, holding)
            if g.value[at] < -m.gaps.resolution:
                where[at] = _root(*arguments, start, end, taken, tolerance, holding, at, VALUE)
        found = min(found, where[at])
    for at in range(count):
        here = where[at] <= found and found <= 1.0
        g.hit[at] = (LIFT if g.closed[at] != 0.0 else HIT) if here else 0.0
    return found


@njit(cache=True, error_model="numpy")
def _root(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, left: float, right: float, taken: float,
    tolerance: float, holding: bool, at: int, what: int,
) -> float:  # fmt: skip
    """Return the fraction at which a quantity of one gap changes its sign between two (Illinois method)."""
    _at(tile, scheme, m, w, k, t, left, taken, tolerance, holding)
    low = _read(w, at, what)
    _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
    high, side = _read(w, at, what), 0
    if not low * high < 0.0:
        return right
    best, least = right, abs(high)
    for number in range(ITERATIONS):
        middle = (low * right - high * left) / (low - high) if number % 3 != 2 else 0.5 * (left + right)
        if not (left < middle and middle < right):
            break
        _at(tile, scheme, m, w, k, t, middle, taken, tolerance, holding)
        value = _read(w, at, what)
        if abs(value) < least:
            best, least = middle, abs(value)
        if value == 0.0:
            break
        if value * high < 0.0:
            left, low, high = middle, value, 0.5 * high if side < 0 else high
            side = -1
        else:
            right, high, low = middle, value, 0.5 * low if side > 0 else low
            side = 1
    return best


@njit(cache=True, error_model="numpy", forceinline=True)
def _read(w: Work, at: int, what: int) -> float:
    g = w.gaps
    return g.value[at] if what == VALUE else (g.rate[at] if what == RATE else g.force[at])  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _at(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, x: float, taken: float, tolerance: float,
    holding: bool,
) -> None:  # fmt: skip
    """Gaps, rates and, where contacts are closed, forces at a fraction of the last step."""
    interpolate(tile, scheme, m, w, k.past, x, taken, k.q, k.v)
    if holding:
        kernels.acceleration(tile, m, w, t + x * taken, k.q, k.v, tolerance, k.a)
    kernels.look(tile, m, w, k.q, k.v)


@njit(cache=True, error_model="numpy")
def miss(tile: Tile, m: Arrays, w: Work) -> float:
    """Return the time [s] by which the end of the step misses the gaps that it was to close, the largest by size."""
    g, most = w.gaps, 0.0
    kernels.look(tile, m, w, w.z, w.zdot)
    for at in range(m.gaps.size * len(tile)):
        if g.hit[at] == HIT and g.rate[at] < 0.0 and abs(g.value[at]) > m.gaps.resolution:
            late = -g.value[at] / g.rate[at]
            most = late if abs(late) > abs(most) else most
    return most


@njit(cache=True, error_model="numpy")
def touching(tile: Tile, m: Arrays, w: Work) -> float:
    """Mark the gaps that are closed at the start and do not open; return whether there are some, 1 or 0."""
    g, found = w.gaps, 0.0
    kernels.look(tile, m, w, w.z, w.zdot)
    for at in range(m.gaps.size * len(tile)):
        if g.value[at] <= TOUCHING * m.gaps.resolution and g.rate[at] <= 0.0:
            g.hit[at], found = HIT, 1.0
    return found
