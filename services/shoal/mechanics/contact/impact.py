"""Impacts of contacts that touch at one instant: one problem of impulses, by Moreau's law (Moreau 1988).

The rates change by the least, in the metric of the masses, that brings g'+ + e g'- >= 0 in each contact that does not
separate; friction is that of `coulomb`. Rigid bodies leave open whether such contacts strike at once or one after the
other: where this matters, the impact says by how much.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.contact import complementarity, coulomb, response
from shoal.mechanics.contact.coulomb import FINE, OPEN, TROUBLES
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import DRY, HIT, RIGID, STICK
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile

APART, TOUCHES, SEPARATES = 0.0, 1.0, 2.0
"""States of a contact at an event."""
PASSES = 10_000
"""Impacts at one place in no time after which they are left as they are."""
STILL = 1e-12
"""Rate of a contact, over the largest of a coordinate, that is round-off."""
GAINS = 5
"""Trouble beside the outcomes of `coulomb.decide`: an impact that gains energy."""
GAIN = 1e-9
"""Energy gained by an impact, over the work of its impulses, that is round-off."""


@njit(cache=True, error_model="numpy")
def strike(tile: Tile, m: Arrays, w: Work, lane: int, state: Array, plastic: Array, impulse: Array) -> int:
    """Change the rates of one lane by the impulses of its contacts, and mark those that separate; returns the outcome.

    Contacts that an impact lets approach strike next, at the same place: of two that throw the body to and fro the
    impacts may accumulate in no time at finite rates. state, plastic, impulse: by contact and lane; those of which
    plastic is not 0 strike without restitution. Leaves in w.gaps.order how much the order of impacts matters.
    """
    g, width, size, ways = w.gaps, len(tile), m.gaps.size, 1 + m.gaps.tangents
    response.matrix(tile, m, w, lane, state)
    still, outcome = STILL * fastest(m, w, width, lane), FINE
    rates, total = np.zeros(size * ways), np.zeros(size * ways)
    for contact in range(size):
        impulse[contact * width + lane] = 0.0
        if state[contact * width + lane] != APART:
            for k in range(ways):
                row = contact * ways + k
                rates[row] = g.rate[contact * width + lane] if k == 0 else g.slip[row * width + lane]
    before = rates.copy()
    for turn in range(PASSES):
        some = turn == 0
        for contact in range(size):
            at, first = contact * width + lane, contact * ways
            # Dry friction of a joint has no impulse, as its force is given.
            rigid = m.gaps.kind[contact] != DRY and m.gaps.soft[contact] == RIGID
            member = rigid and state[at] != APART and rates[first] <= still
            some = some or (member and rates[first] < -still)
            g.chosen[contact] = STICK if member else OPEN
            for k in range(ways):
                g.load[first + k] = _asked(m, width, lane, contact, k, plastic, rates) if member else 0.0
        if not some:
            break
        if m.gaps.tangents == 0 and not m.gives:
            complementarity.complementary(size, g.matrix, g.load, g.chosen, g.found)
        else:
            outcome = coulomb.decide(
                m.gaps, g.few, g.given, width, lane, g.chosen, g.way, g.matrix, g.load, g.found, True
            )
        if outcome == FINE and _gains(m, w, rates):
            outcome = GAINS + TROUBLES * struck(size, width, lane, g.hit)
        if outcome != FINE:
            return outcome
        for direction in range(size * ways):
            rates[direction] += response.after(tile, m, w, direction)
            total[direction] += g.found[direction]
    g.order[lane] = _one_by_one(m, w, width, lane, state, plastic, still, before, total) if lane == 0 else 0.0
    for direction in range(size * ways):
        g.found[direction] = total[direction]
    response.push(tile, m, w, lane, w.zdot)
    for contact in range(size):
        at, first = contact * width + lane, contact * ways
        impulse[at] = total[first] if total[first] * g.matrix[first * size * ways + first] > still else 0.0
        rigid = m.gaps.kind[contact] != DRY and m.gaps.soft[contact] == RIGID
        if state[at] != APART and rigid and rates[first] > still:
            state[at] = SEPARATES
    return FINE


@njit(cache=True, error_model="numpy", forceinline=True)
def _asked(m: Arrays, width: int, lane: int, contact: int, k: int, plastic: Array, rates: Array) -> float:
    """Return (1 + e) v of a direction of a contact, which the impulses are to take away."""
    at = contact * width + lane
    restitution = 0.0 if plastic[at] != 0.0 else m.gaps.restitution[at]
    e = restitution if k == 0 else m.gaps.tangential[at]
    return (1.0 + e) * rates[contact * m.gaps.tangents + contact + k]  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _one_by_one(
    m: Arrays, w: Work, width: int, lane: int, state: Array, plastic: Array, still: float, rates: Array, once: Array
) -> float:
    """Return how far the impulses p of contacts that strike one after the other, the fastest first, are from those at
    once: (dp' G dp / p' G p)^1/2. Destroys rates.
    """
    g, ways, number = w.gaps, 1 + m.gaps.tangents, 0
    n = m.gaps.size * ways
    for contact in range(m.gaps.size):
        number += 1 if once[contact * ways] > 0.0 else 0
    if number < 2:
        return 0.0
    mode, way, rest, each, left = np.zeros(m.gaps.size), np.zeros(n), np.zeros(n), np.zeros(n), once.copy()
    for _ in range(PASSES):
        hits, fast = -1, -still
        for contact in range(m.gaps.size):
            strikes = state[contact * width + lane] != APART and m.gaps.soft[contact] == RIGID
            if strikes and m.gaps.kind[contact] != DRY and rates[contact * ways] < fast:
                hits, fast = contact, rates[contact * ways]
        if hits < 0:
            break
        first = hits * ways
        for k in range(ways):
            rest[first + k] = _asked(m, width, lane, hits, k, plastic, rates)
        if (
            coulomb.alone(m.gaps, g.few, g.given, hits, width, lane, STICK, mode, way, g.matrix, rest, each, True)
            != FINE
        ):
            break
        for k in range(ways):
            left[first + k] -= each[first + k]
            for i in range(n):
                rates[i] += g.matrix[i * n + first + k] * each[first + k]
    apart, whole = 0.0, 0.0
    for i in range(n):
        for j in range(n):
            apart += left[i] * g.matrix[i * n + j] * left[j]
            whole += once[i] * g.matrix[i * n + j] * once[j]
    return np.sqrt(max(apart, 0.0) / whole) if whole > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def fastest(m: Arrays, w: Work, width: int, lane: int) -> float:
    """Return the largest rate of a coordinate, against which slower rates of contacts are round-off."""
    most = 0.0
    for i in range(lane, m.unknowns * width, width):
        most = max(most, abs(w.zdot[i]))
    return most


@njit(cache=True, error_model="numpy")
def struck(size: int, width: int, lane: int, hit: Array) -> int:
    """Return the first contact of a lane whose gap has closed."""
    found = 0
    for number in range(size - 1, -1, -1):
        found = number if hit[number * width + lane] == HIT else found
    return found


@njit(cache=True, error_model="numpy")
def _gains(m: Arrays, w: Work, rates: Array) -> bool:
    """Return whether impulses p do work p'(v + G p / 2) > 0: the law of the impact gains energy."""
    size, work, whole = m.gaps.size * (1 + m.gaps.tangents), 0.0, 0.0
    for i in range(size):
        change = 0.0
        for j in range(size):
            change += 0.5 * w.gaps.matrix[i * size + j] * w.gaps.found[j]
        work += w.gaps.found[i] * (rates[i] + change)
        whole += abs(w.gaps.found[i]) * (abs(rates[i]) + abs(change))
    return work > GAIN * whole
