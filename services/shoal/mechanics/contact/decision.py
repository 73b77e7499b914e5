"""Decisions at an event: impacts, then which contacts are closed, and which of those stick or slip.

Of all accelerations with g_q a >= -bias for gaps with g = g' = 0 the true one deviates least from the free one (Gauss's
principle with inequalities). Friction is that of `coulomb`, impacts are those of `impact`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile import function_pointers
from shoal.mechanics.contact import complementarity, coulomb, impact, motion, response
from shoal.mechanics.contact.coulomb import FINE, JAMS, KNOWN, OPEN, TROUBLES
from shoal.mechanics.contact.impact import APART, SEPARATES, STILL, TOUCHES
from shoal.mechanics.dynamics import ACCELERATION, Work
from shoal.mechanics.gaps import DRY, HIT, LIFT, LOGGED, PASS, RECORD, RIGID, SLIDE, SLIP, STICK, STOP, exceeded, press
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Flags, Tile
from shoal.mechanics.profiles import CORNER
from shoal.mechanics.rubbing import ROUNDS, SETTLED

MEET = 4.0
"""Event beside those of `gaps`: a contact that gives way is met."""
KINDS = {HIT: "impact", MEET: "touches", LIFT: "opens", SLIDE: "slips", STOP: "sticks"}
MOST = 100_000
"""Events after which a motion is given up."""
TOO_MANY = 4
"""Trouble beside the outcomes of `coulomb.decide`: more than `MOST` events."""
MARGIN = 1e-9
"""Part of an acceleration, or of the limit of friction, that is round-off of the location of an event."""


@njit(cache=True, error_model="numpy")
def decide(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Decide on the lanes in which contacts are marked in w.gaps.hit.

    Leaves the rates after the impacts in w.zdot, and the acceleration in w.a.
    """
    g, width, size = w.gaps, len(tile), m.gaps.size
    state = np.zeros(size * width)
    for lane in range(width):
        g.decisions[lane] += 1.0
        if g.decisions[lane] > MOST:
            _end(m, w, t, width, lane, TOO_MANY + TROUBLES * impact.struck(size, width, lane, g.hit))
    if motion.some(tile, m, g.closed):  # the forces just before the event, which its search has left at other times
        function_pointers.call(m.table.motion, (tile, m, w, t, w.z, w.zdot, tolerance, w.a, ACCELERATION))
    passes = _pass(m, width, w)
    for at in range(size * width):
        near = g.value[at] <= m.gaps.resolution and m.gaps.soft[at // width] == RIGID
        state[at] = TOUCHES if g.hit[at] == HIT or g.closed[at] != 0.0 or near else APART
        g.impulse[at] = 0.0
        if g.hit[at] == HIT:
            g.speed[at] = -g.rate[at]
        if g.hit[at] == LIFT:
            log(m, w, t, at // width, width, at % width, LIFT, 0.0)
    free = _strike(tile, m, w, t, tolerance, state)
    for _ in range(2 * size + 2):
        _resolve(tile, m, w, t, tolerance, state, free)
        again, free = False, False
        for at in range(size * width):
            g.hit[at] = 0.0
            state[at] = TOUCHES if g.closed[at] != 0.0 else APART
            if g.closed[at] == 0.0:
                continue
            # Round-off may leave a force or a friction beyond its limit: the event follows at once.
            g.hit[at] = exceeded(m.gaps, g, width, at)
            again = again or g.hit[at] != 0.0
        if not again:
            break
    for at in range(size * width):
        g.kept[at] = g.closed[at]
        if passes[at] and g.closed[at] == 0.0:
            log(m, w, t, at // width, width, at % width, LIFT, 0.0)


@njit(cache=True, error_model="numpy")
def _pass(m: Arrays, width: int, w: Work) -> Flags:
    """Let the contacts that have come to the end of a feature go on with the next one, and return which do.

    A point goes round no corner.
    """
    g, chains = w.gaps, m.gaps.pairs.profiles
    passes = np.zeros(m.gaps.size * width, dtype=np.bool_)
    for at in range(m.gaps.size * width):
        passes[at] = g.hit[at] == PASS
        if passes[at]:
            pair = m.gaps.number[at // width]
            feature = (int(g.feature[at] + g.onward[at]) + chains.length[pair]) % chains.length[pair]
            g.feature[at] = feature
            radius = m.gaps.pairs.radius[pair * width + at % width]
            if chains.kind[chains.begin[pair] + feature] == CORNER and radius == 0.0:
                g.hit[at], passes[at] = LIFT, False
    return passes


@njit(cache=True, error_model="numpy", forceinline=True)
def _concerns(size: int, width: int, lane: int, hit: Array) -> bool:
    found = False
    for number in range(size):
        found = found or hit[number * width + lane] != 0.0
    return found


@njit(cache=True, error_model="numpy", forceinline=True)
def _strikes(size: int, width: int, lane: int, hit: Array) -> bool:
    """Return whether a gap of the lane has closed."""
    found = False
    for number in range(size):
        found = found or hit[number * width + lane] == HIT
    return found


@njit(cache=True, error_model="numpy")
def _release(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, state: Array) -> None:
    """Open all contacts of the lanes that are decided on; find the acceleration without them, and their responses."""
    g, width, size = w.gaps, len(tile), m.gaps.size
    for at in range(size * width):
        if _concerns(size, width, at % width, g.hit):
            g.closed[at] = 0.0
    function_pointers.call(m.table.motion, (tile, m, w, t, w.z, w.zdot, tolerance, w.a, ACCELERATION))
    response.respond(tile, m, w, t, w.z, w.zdot, tolerance, state)


@njit(cache=True, error_model="numpy")
def _strike(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, state: Array) -> bool:
    """Let the contacts that touch strike each other, and mark those that separate; return whether some do.

    It leaves the acceleration as `_release` does.

    A contact that would only hop below the resolution, v^2 / 2a, strikes without restitution: its accumulation of
    impacts ends here, with all of its impulse. One that the others throw up so little is closed.
    """
    g, width, size, n = w.gaps, len(tile), m.gaps.size, m.unknowns
    some = False
    for lane in range(width):
        some = some or _strikes(size, width, lane, g.hit)
    if not some:
        return False
    before, plastic = np.zeros(n * width), np.zeros(size * width)
    for i in range(n * width):
        before[i] = w.zdot[i]
    closed, touching = np.zeros(size * width), state.copy()
    for at in range(size * width):
        closed[at] = g.closed[at]
    for _ in range(size + 1):
        for i in range(n * width):
            w.zdot[i] = before[i]
        for at in range(size * width):
            state[at], g.closed[at] = touching[at], closed[at]
        response.respond(tile, m, w, t, w.z, w.zdot, tolerance, state)
        for lane in range(width):
            if _strikes(size, width, lane, g.hit):
                outcome = impact.strike(tile, m, w, lane, state, plastic, g.impulse)
                if outcome != FINE:
                    _end(m, w, t, width, lane, outcome)
        _release(tile, m, w, t, tolerance, state)
        lower = False
        for lane in range(width):
            if _strikes(size, width, lane, g.hit):
                _choose(tile, m, w, t, lane, state)
                for contact in range(size):
                    at, first = contact * width + lane, contact * (1 + m.gaps.tangents)
                    falling = -(g.load[first] + response.after(tile, m, w, first))
                    low = falling > 0.0 and g.rate[at] ** 2 < 2.0 * falling * m.gaps.resolution
                    if state[at] == SEPARATES and low:
                        lower, plastic[at] = lower or plastic[at] == 0.0, 1.0
                        state[at] = TOUCHES
        if not lower:
            break
    for lane in range(width):
        for contact in range(size):
            at = contact * width + lane
            meets = g.hit[at] == HIT and m.gaps.kind[contact] != DRY and t > 0.0
            if meets or (closed[at] == 0.0 and g.impulse[at] > 0.0):
                log(m, w, t, contact, width, lane, HIT if m.gaps.soft[contact] == RIGID else MEET, g.impulse[at])
    return True


@njit(cache=True, error_model="numpy")
def _resolve(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, state: Array, free: bool) -> None:
    """Decide which contacts that touch are closed from here on, and find the acceleration.

    free: whether `_release` has found that without contacts
    """
    g, width, size = w.gaps, len(tile), m.gaps.size
    before = np.zeros(size * width)
    for lane in range(width):
        _slide_together(m, w, width, lane)
    for at in range(size * width):
        before[at] = g.mode[at]
        if g.hit[at] == LIFT or state[at] == SEPARATES:
            state[at] = APART
        if g.hit[at] == SLIDE:
            _head_against_force(m, w, at // width, width, at % width)
    if not free:
        _release(tile, m, w, t, tolerance, state)
    for lane in range(width):
        if _concerns(size, width, lane, g.hit):
            outcome = _choose(tile, m, w, t, lane, state)
            if outcome != FINE:
                _end(m, w, t, width, lane, outcome)
            _close(tile, m, w, t, lane, before)
    for at in range(size * width * (1 + m.gaps.tangents)):
        g.force[at] = 0.0
    if motion.some(tile, m, g.closed):
        motion.settle(tile, m, w, t, tolerance)
        function_pointers.call(m.table.motion, (tile, m, w, t, w.z, w.zdot, tolerance, w.a, ACCELERATION))


@njit(cache=True, error_model="numpy")
def _slide_together(m: Arrays, w: Work, width: int, lane: int) -> None:
    """Let contacts whose friction is at its limit, but for round-off, begin to slip with one that does."""
    g, ways, some = w.gaps, 1 + m.gaps.tangents, False
    for contact in range(m.gaps.size):
        some = some or g.hit[contact * width + lane] == SLIDE
    for contact in range(m.gaps.size):
        at, square = contact * width + lane, 0.0
        for k in range(1, ways):
            square += g.force[(contact * ways + k) * width + lane] ** 2
        sticks = some and g.closed[at] != 0.0 and m.gaps.rubs[contact] > 0 and g.mode[at] == STICK
        if sticks and g.hit[at] == 0.0 and square > 0.0 and g.margin[at] <= MARGIN * np.sqrt(square):
            g.hit[at] = SLIDE


@njit(cache=True, error_model="numpy")
def _end(m: Arrays, w: Work, t: float, width: int, lane: int, trouble: int) -> None:
    """End the motion of a lane, which is no number from here on."""
    if w.gauss.ended[lane] < 0.0:
        w.gauss.ended[lane], w.gauss.ended[2 * width + lane] = t, trouble
    for i in range(lane, m.unknowns * width, width):
        w.zdot[i] = np.nan


@njit(cache=True, error_model="numpy")
def log(m: Arrays, w: Work, t: float, contact: int, width: int, lane: int, kind: float, impulse: float) -> None:
    """Count an event, and keep it if it is of the first lane."""
    g = w.gaps
    g.number[lane] += 1.0
    count = int(g.number[lane])
    if lane == 0 and count <= LOGGED:
        first = RECORD * (count - 1)
        g.log[first], g.log[first + 1], g.log[first + 2], g.log[first + 3] = t, contact, kind, impulse
        g.log[first + 4] = g.order[lane] if kind == HIT else 0.0


@njit(cache=True, error_model="numpy")
def _choose(tile: Tile, m: Arrays, w: Work, t: float, lane: int, state: Array) -> int:
    """Find forces of the contacts of a lane that touch, by the acceleration without them in w.a; returns the outcome.

    Leaves the accelerations without them in w.gaps.load, and in w.gaps.chosen what they do.
    """
    g, width, size, ways = w.gaps, len(tile), m.gaps.size, 1 + m.gaps.tangents
    response.matrix(tile, m, w, lane, state)
    response.load_by(tile, m, w, lane, state, w.a)
    for contact in range(size):
        g.chosen[contact] = _asked(tile, m, w, lane, contact, state)
        if m.gaps.soft[contact] != RIGID and g.chosen[contact] != OPEN:
            g.load[contact * ways] = press(m.gaps, g, contact, width, lane)[0]
    if m.gaps.tangents == 0 and not m.gives:
        complementarity.complementary(size, g.matrix, g.load, g.chosen, g.found)
        return FINE
    outcome = _decide(m, w, width, lane)
    if _leads_on(tile, m, w, lane):
        return outcome  # type: ignore[no-any-return]
    # One whose friction has reached its limit may stick on if others take more of what they hold together.
    if _ask_again(tile, m, w, lane, state, STICK) == FINE and _has_room(tile, m, w, lane):
        return FINE
    return _ask_again(tile, m, w, lane, state, KNOWN)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _ask_again(tile: Tile, m: Arrays, w: Work, lane: int, state: Array, slides: float) -> int:
    """Decide the modes again, with contacts that have begun to slip taken to stick or to slip on (`slides`)."""
    g, width = w.gaps, len(tile)
    for contact in range(m.gaps.size):
        g.chosen[contact] = _asked(tile, m, w, lane, contact, state)
        if g.hit[contact * width + lane] == SLIDE and g.chosen[contact] == KNOWN:
            g.chosen[contact] = slides
    return _decide(m, w, width, lane)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _decide(m: Arrays, w: Work, width: int, lane: int) -> int:
    """Decide modes as w.gaps.chosen asks, with the friction that the forces of joints allow; returns the outcome."""
    g, asked = w.gaps, np.zeros(m.gaps.size)
    for contact in range(m.gaps.size):
        asked[contact] = g.chosen[contact]
    for _ in range(ROUNDS):
        for contact in range(m.gaps.size):
            g.chosen[contact] = asked[contact]
        outcome = coulomb.decide(m.gaps, g.few, g.given, width, lane, g.chosen, g.way, g.matrix, g.load, g.found, False)
        if outcome != FINE or response.allow(m, w, width, lane) <= SETTLED:
            return outcome  # type: ignore[no-any-return]
    jammed = FINE
    for contact in range(m.gaps.size - 1, -1, -1):
        at = contact * width + lane
        g.given[at] = m.gaps.given[at]
        jammed = JAMS + TROUBLES * contact if m.gaps.share[at] > 0.0 else jammed
    return jammed


@njit(cache=True, error_model="numpy")
def _leads_on(tile: Tile, m: Arrays, w: Work, lane: int) -> bool:
    """Return whether the accelerations lead each contact that has begun to slip on in the way it slips."""
    g, width, ways, leads = w.gaps, len(tile), 1 + m.gaps.tangents, True
    for contact in range(m.gaps.size):
        if g.hit[contact * width + lane] == SLIDE and g.chosen[contact] == KNOWN:
            along, size = 0.0, 0.0
            for row in range(contact * ways + 1, contact * ways + ways):
                change = response.after(tile, m, w, row)
                along += g.way[row] * (g.load[row] + change)
                size += abs(g.load[row]) + abs(change)
            leads = leads and along > MARGIN * size
    return leads


@njit(cache=True, error_model="numpy")
def _has_room(tile: Tile, m: Arrays, w: Work, lane: int) -> bool:
    """Return whether each contact that has begun to slip sticks, with its friction below its limit again."""
    g, width, ways, room = w.gaps, len(tile), 1 + m.gaps.tangents, True
    for contact in range(m.gaps.size):
        if g.hit[contact * width + lane] == SLIDE:
            square, first = 0.0, contact * ways
            for row in range(first + 1, first + ways):
                square += g.found[row] ** 2
            limit = coulomb.limit(m.gaps, g.given, contact, width, lane, g.found[first], True)
            room = room and g.chosen[contact] == STICK and np.sqrt(square) < (1.0 - MARGIN) * limit
    return room


@njit(cache=True, error_model="numpy")
def _close(tile: Tile, m: Arrays, w: Work, t: float, lane: int, before: Array) -> None:
    """Close the contacts of a lane that press, and keep what those that rub do from here on."""
    g, width, ways = w.gaps, len(tile), 1 + m.gaps.tangents
    for direction in range(m.gaps.size * ways):
        g.near[direction * width + lane] = g.found[direction]
    for contact in range(m.gaps.size):
        at, now = contact * width + lane, g.chosen[contact]
        given = m.gaps.kind[contact] == DRY or m.gaps.soft[contact] != RIGID
        closed = now != OPEN and (given or g.found[contact * ways] > 0.0)
        g.closed[at] = 1.0 if closed else 0.0
        if m.gaps.rubs[contact] == 0:
            continue
        g.mode[at] = (SLIP if now == KNOWN else now) if closed else OPEN
        if m.gaps.kind[contact] == DRY and g.mode[at] == STICK and before[at] != STICK:
            g.anchor[at] += g.value[at]
        if g.mode[at] == SLIP:
            response.head(m, w, contact, width, lane)
        if closed and t > 0.0 and g.mode[at] != before[at]:
            log(m, w, t, contact, width, lane, STOP if g.mode[at] == STICK else SLIDE, 0.0)


@njit(cache=True, error_model="numpy")
def _head_against_force(m: Arrays, w: Work, contact: int, width: int, lane: int) -> None:
    """Let a contact that has stuck slip against its friction."""
    g, ways, total = w.gaps, 1 + m.gaps.tangents, 0.0
    for k in range(1, ways):
        total += g.force[(contact * ways + k) * width + lane] ** 2
    for k in range(1, ways):
        g.way[contact * ways + k] = -g.force[(contact * ways + k) * width + lane] / np.sqrt(total)
    response.head(m, w, contact, width, lane)


@njit(cache=True, error_model="numpy")
def _asked(tile: Tile, m: Arrays, w: Work, lane: int, contact: int, state: Array) -> float:
    """Return what `coulomb.decide` is asked about a contact: OPEN, KNOWN with its direction in w.gaps.way, or STICK."""
    g, width, ways = w.gaps, len(tile), 1 + m.gaps.tangents
    at = contact * width + lane
    if state[at] != TOUCHES:
        return OPEN
    if m.gaps.rubs[contact] == 0:
        return STICK
    square, push = 0.0, 0.0
    for k in range(ways):
        push = max(push, abs(g.load[contact * ways + k]))
        square += g.slip[(contact * ways + k) * width + lane] ** 2 if k > 0 else 0.0
    if m.gaps.kind[contact] == DRY:
        row = contact * ways + 1
        push += g.matrix[row * m.gaps.size * ways + row] * g.given[at]
    speed = np.sqrt(square)
    if g.hit[at] == SLIDE:
        response.along_heading(m, w, contact, width, lane)
        return KNOWN
    # A slip is none that such accelerations stop within the resolution, as a hop is.
    if speed <= max(np.sqrt(2.0 * push * m.gaps.resolution), STILL * impact.fastest(m, w, width, lane)):
        return STICK
    for k in range(1, ways):
        g.way[contact * ways + k] = g.slip[(contact * ways + k) * width + lane] / speed
    return KNOWN
