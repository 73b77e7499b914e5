"""Event location within a step: the first root of gaps and contact forces in its dense output.

A gap is looked at only where it could close with rates of at most twice those at the ends of the step. There the step
is divided, and each part is judged by values and rates at both ends, so that a gap that closes and opens again is
seen by the root of its rate.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics import kernels
from shoal.mechanics.contact import response
from shoal.mechanics.contact.impact import STILL, fastest
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import DRY, HIT, LIFT, PASS, RIGID, SLIDE, SLIP, STICK, STOP, exceeded, is_outline
from shoal.mechanics.integrators.dense import quintic
from shoal.mechanics.integrators.scheme import Scheme, interpolate
from shoal.mechanics.marched import LoopRoom
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile

PARTS = 8
"""Parts of a step that are judged by their ends."""
NEVER = 2.0
ITERATIONS = 60
"""At most so many of a root; halving alone would know it to round-off."""
FRACTION = 1e-15
"""Width of a bracket, as a part of the step, that is a root."""
BEFORE_JUMP = 1e-12
"""Part of the step before the jump of the rate of what has come into an outline and nears its far side."""
VALUE, RATE, FORCE, MARGIN, LEFT = range(5)
QUANTITIES = 5
TOUCHING = 1e3
"""A start that leaves less of a gap, in units of its resolution, closes it."""


@njit(cache=True, error_model="numpy")
def begin(tile: Tile, m: Arrays, w: Work) -> None:
    """Keep gaps, rates, forces and margins at the beginning of a step."""
    kernels.look(tile, m, w, w.z, w.zdot)
    shift(tile, m, w)


@njit(cache=True, error_model="numpy")
def proceed(tile: Tile, m: Arrays, w: Work) -> None:
    """Begin the next step where the last one has ended."""
    shift(tile, m, w)
    if m.gaps.tangents > 1:
        response.turn_headings(m, w, len(tile))


@njit(cache=True, error_model="numpy")
def shift(tile: Tile, m: Arrays, w: Work) -> None:
    """Let what was looked at last be that at the beginning of a step."""
    width = len(tile)
    count = m.gaps.size * width
    for at in range(count):
        for what in range(QUANTITIES):
            w.gaps.before[what * count + at] = _read(m, w, width, at, what)
        w.gaps.dips[at] = 0.0
        # A slip that has just begun is none but for round-off, and so is the way from the end of a feature.
        if w.gaps.mode[at] == SLIP:
            w.gaps.before[MARGIN * count + at] = max(w.gaps.before[MARGIN * count + at], 0.0)
        w.gaps.before[LEFT * count + at] = max(w.gaps.before[LEFT * count + at], 0.0)


@njit(cache=True, error_model="numpy", forceinline=True)
def is_far(both: float, fastest: float, taken: float) -> bool:
    """Return whether a gap cannot close in a step, by the sum of its sizes and the fastest of its rates at both ends.

    With |g'| <= R in the step, of the length h, g >= (g(0) + g(h) - R h) / 2; R: twice the fastest.
    """
    return both > 2.0 * fastest * taken


@njit(cache=True, error_model="numpy", forceinline=True)
def _read(m: Arrays, w: Work, width: int, at: int, what: int) -> float:
    g = w.gaps
    if what == LEFT:
        return g.left[at]  # type: ignore[no-any-return]
    if what == FORCE:
        return g.force[at // width * (1 + m.gaps.tangents) * width + at % width]  # type: ignore[no-any-return]
    return g.value[at] if what == VALUE else (g.rate[at] if what == RATE else g.margin[at])  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def _pulls(m: Arrays, w: Work, width: int, at: int) -> bool:
    """Return whether the force of a closed contact is negative."""
    return m.gaps.kind[at // width] != DRY and _read(m, w, width, at, FORCE) < 0.0  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def _turns(m: Arrays, w: Work, width: int, at: int, taken: float) -> bool:
    """Return whether friction of a closed contact is beyond its limit, or its slip has turned back.

    Not by so little that it goes no way in a step of the length `taken` [s]: what is at rest slips to and fro by that.
    """
    least = m.gaps.resolution / taken if w.gaps.mode[at] == SLIP else 0.0
    return m.gaps.rubs[at // width] > 0 and w.gaps.mode[at] != 0.0 and w.gaps.margin[at] < -least  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def first(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, taken: float, tolerance: float
) -> float:
    """Return the fraction of the last step at which its first event is, NEVER if there is none; marks what it is about.

    t: beginning of the step [s]; taken: its length
    """
    g, width = w.gaps, len(tile)
    count = m.gaps.size * width
    kernels.look(tile, m, w, w.z, w.zdot)
    near, holding = False, False
    for at in range(count):
        g.hit[at], g.looked[at] = 0.0, 0.0
        if g.closed[at] != 0.0:
            holding = holding or g.dips[at] != 0.0 or _pulls(m, w, width, at) or _turns(m, w, width, at, taken)
            near = near or g.left[at] < 0.0
        else:
            fastest = max(abs(g.before[RATE * count + at]), abs(g.rate[at]))
            g.looked[at] = 0.0 if is_far(g.before[at] + g.value[at], fastest, taken) else 1.0
            near = near or g.looked[at] != 0.0
    if not (near or holding):
        return NEVER
    _look_along(m, w, width)
    for part in range(PARTS):
        left, right = part / PARTS, (part + 1) / PARTS
        _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
        found = NEVER
        for at in range(count):
            happens = False
            if g.closed[at] != 0.0:
                happens = g.left[at] < 0.0
                if holding:
                    happens = happens or (g.before[FORCE * count + at] >= 0.0 and _pulls(m, w, width, at))
                    happens = happens or (g.before[MARGIN * count + at] >= 0.0 and _turns(m, w, width, at, taken))
            elif g.looked[at] != 0.0:
                dips = g.before[RATE * count + at] < 0.0 and g.rate[at] > 0.0
                # What gives way may open before the surfaces have come apart.
                falls = m.gaps.soft[at // width] == RIGID or g.rate[at] < 0.0
                happens = (falls and g.value[at] < -m.gaps.resolution) or dips
            g.hit[at] = 1.0 if happens else 0.0
        if _any(count, g.hit):
            found = _earliest(tile, scheme, m, w, k, t, left, right, taken, tolerance, holding)
            if found <= 1.0:
                return found  # type: ignore[no-any-return]
            _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
        shift(tile, m, w)
    return _met(tile, m, w, taken)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _look_along(m: Arrays, w: Work, width: int) -> None:
    """Mark the closed contacts with outlines, which may end within the step, and those that share a chain of features.

    Forces of closed contacts take an acceleration, which looks at them.
    """
    g = w.gaps
    for at in range(m.gaps.size * width):
        if is_outline(m.gaps, at // width):
            twin = m.gaps.pairs.profiles.twin[m.gaps.number[at // width]] * width
            if g.closed[at] != 0.0 or g.looked[at + twin] != 0.0:
                g.looked[at] = 1.0


@njit(cache=True, error_model="numpy")
def _met(tile: Tile, m: Arrays, w: Work, taken: float) -> float:
    """Return 1 and mark the gaps if some close just at the end of the step, from where they would go on; else NEVER."""
    g, found = w.gaps, NEVER
    for at in range(m.gaps.size * len(tile)):
        closes = g.closed[at] == 0.0 and abs(g.value[at]) <= m.gaps.resolution
        g.hit[at] = HIT if closes and -g.rate[at] * taken > m.gaps.resolution else 0.0
        found = 1.0 if g.hit[at] == HIT else found
    return found


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
    g, width, found = w.gaps, len(tile), NEVER
    count = m.gaps.size * width
    where, about = np.full(count, NEVER), np.zeros(count)
    for at in range(count):
        if g.hit[at] == 0.0:
            continue
        arguments = (tile, scheme, m, w, k, t)
        g.looked[at] = 1.0
        if g.closed[at] != 0.0:
            _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
            pulls, turns = _pulls(m, w, width, at), _turns(m, w, width, at, taken)
            if pulls and g.before[FORCE * count + at] >= 0.0:
                where[at], about[at] = _root(*arguments, left, right, taken, tolerance, holding, at, FORCE), LIFT
            if turns and g.before[MARGIN * count + at] >= 0.0:
                turn = _root(*arguments, left, right, taken, tolerance, holding, at, MARGIN)
                if turn < where[at]:
                    where[at], about[at] = turn, STOP if g.mode[at] == SLIP else SLIDE
            _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
            if g.left[at] < 0.0:
                end = _root(*arguments, left, right, taken, tolerance, holding, at, LEFT)
                if end < where[at]:
                    where[at], about[at] = end, PASS
        else:
            start, end = left, right
            if g.before[RATE * count + at] >= 0.0 and g.before[at] <= m.gaps.resolution:
                start = _root(*arguments, left, right, taken, tolerance, holding, at, RATE)
            _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
            if g.value[at] >= -m.gaps.resolution:
                end = _root(*arguments, left, right, taken, tolerance, holding, at, RATE)
                _at(tile, scheme, m, w, k, t, end, taken, tolerance, holding)
                if g.value[at] >= -m.gaps.resolution and is_outline(m.gaps, at // width):
                    end = max(end - BEFORE_JUMP, start)
                    _at(tile, scheme, m, w, k, t, end, taken, tolerance, holding)
            if g.value[at] < -m.gaps.resolution:
                where[at], about[at] = _root(*arguments, start, end, taken, tolerance, holding, at, VALUE), HIT
        found = min(found, where[at])
    for at in range(count):
        g.hit[at] = about[at] if where[at] <= found and found <= 1.0 else 0.0
    return found


@njit(cache=True, error_model="numpy")
def _root(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, left: float, right: float, taken: float,
    tolerance: float, holding: bool, at: int, what: int,
) -> float:  # fmt: skip
    """Return the fraction at which a quantity of one contact changes its sign between two (Chandrupatla 1997)."""
    width = len(tile)
    # Gaps, their rates and slips follow from the motion; forces take an acceleration.
    holding = holding and (what == FORCE or (what == MARGIN and w.gaps.mode[at] == STICK))
    _at(tile, scheme, m, w, k, t, left, taken, tolerance, holding)
    a, b, fb = right, left, _read(m, w, width, at, what)
    # A gap that begins at zero, but for round-off, closes where it falls below that.
    level = m.gaps.resolution if what == VALUE and abs(fb) <= m.gaps.resolution else 0.0
    _at(tile, scheme, m, w, k, t, right, taken, tolerance, holding)
    fa, fb = _read(m, w, width, at, what) + level, fb + level
    if not fa * fb < 0.0:
        return left if left > 0.0 and fb < 0.0 else right
    part = fa / (fa - fb)
    for _ in range(ITERATIONS):
        x = a + part * (b - a)
        _at(tile, scheme, m, w, k, t, x, taken, tolerance, holding)
        f, c, fc = _read(m, w, width, at, what) + level, a, fa
        if f * fa <= 0.0:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, f
        if fa == 0.0:
            return a  # type: ignore[no-any-return]
        least = FRACTION / abs(b - a)
        if least > 0.5:
            break
        # Inverse quadratic interpolation where it is safe, else halving.
        xi, phi, part = (a - b) / (c - b), (fa - fb) / (fc - fb), 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        part = min(max(part, least), 1.0 - least)
    return a if abs(fa) < abs(fb) else b


@njit(cache=True, error_model="numpy")
def _at(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, t: float, x: float, taken: float, tolerance: float,
    holding: bool,
) -> None:  # fmt: skip
    """Gaps, rates and, where contacts are closed, forces at a fraction of the last step."""
    interpolate(tile, scheme, m, w, k.past, x, taken, k.q, k.v)
    if holding:
        kernels.acceleration(tile, m, w, t + x * taken, k.q, k.v, tolerance, k.a)
    kernels.look(tile, m, w, k.q, k.v, False)


@njit(cache=True, error_model="numpy")
def miss(tile: Tile, m: Arrays, w: Work, taken: float) -> float:
    """Return the time [s] by which the end of the step misses the gaps that it was to close, the largest by size.

    By Newton's method; none where a gap closes so slowly that it would leave the step, of length `taken`.
    """
    g, most = w.gaps, 0.0
    kernels.look(tile, m, w, w.z, w.zdot)
    for at in range(m.gaps.size * len(tile)):
        if g.hit[at] == HIT and g.rate[at] < 0.0 and abs(g.value[at]) > m.gaps.resolution:
            late = -g.value[at] / g.rate[at]
            most = late if abs(late) > abs(most) else most
    return most if abs(most) < 0.5 * taken else 0.0


@njit(cache=True, error_model="numpy")
def move(tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, taken: float, late: float) -> None:
    """Move the end of the step of the length `taken` [s] by so much more, and look at it.

    By Hermite's polynomial of degree 5 through the step, which is as exact as its end up to (late / taken)^3.
    """
    quintic(tile, scheme.settings, m, w, k.past, 1.0 + late / taken, taken, k.q, k.v)
    for i in range(m.unknowns * len(tile)):
        w.z[i], w.zdot[i] = k.q[i], k.v[i]
    kernels.look(tile, m, w, w.z, w.zdot)


@njit(cache=True, error_model="numpy")
def jumped(tile: Tile, m: Arrays, w: Work) -> float:
    """Mark closed contacts that forces or driven rates which have jumped open, let slip or strike; 1 if some do, or 0.

    By their rates and forces at the last acceleration: a search within the next step finds no change of sign.
    """
    g, width, found = w.gaps, len(tile), 0.0
    for at in range(m.gaps.size * width):
        g.hit[at] = 0.0
        if g.closed[at] == 0.0:
            continue
        still = STILL * fastest(m, w, width, at % width)
        moves = m.gaps.soft[at // width] == RIGID and abs(g.rate[at]) > still
        if moves and g.rate[at] < 0.0:
            g.hit[at] = HIT
        else:
            g.hit[at] = LIFT if moves else exceeded(m.gaps, g, width, at)
        if g.hit[at] == 0.0 and m.gaps.rubs[at // width] > 0:
            turns = g.margin[at] < 0.0 or (g.mode[at] == STICK and _slip(m, w, width, at) > still)
            g.hit[at] = STOP if turns else 0.0  # the way it goes on follows from its slip
        found = 1.0 if g.hit[at] != 0.0 else found
    return found


@njit(cache=True, error_model="numpy", forceinline=True)
def _slip(m: Arrays, w: Work, width: int, at: int) -> float:
    """Return the speed of slip of a contact [m/s or rad/s]."""
    square, ways = 0.0, 1 + m.gaps.tangents
    for k in range(1, ways):
        square += w.gaps.slip[(at // width * ways + k) * width + at % width] ** 2
    return np.sqrt(square)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def touching(tile: Tile, m: Arrays, w: Work) -> float:
    """Mark the gaps that are closed at the start and do not open; return whether there are some, 1 or 0."""
    g, found = w.gaps, 0.0
    kernels.look(tile, m, w, w.z, w.zdot)
    for at in range(m.gaps.size * len(tile)):
        still = STILL * fastest(m, w, len(tile), at % len(tile))
        if m.gaps.kind[at // len(tile)] == DRY:
            g.hit[at], g.closed[at], found = HIT, 1.0, 1.0
        elif g.value[at] <= TOUCHING * m.gaps.resolution and (g.rate[at] <= still or m.gaps.soft[at // len(tile)] > 0):
            g.hit[at], found = HIT, 1.0
    return found
