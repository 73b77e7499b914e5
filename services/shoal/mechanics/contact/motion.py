"""Accelerations with closed contacts, by Gauss's principle, and the removal of their drift.

Between events each closed contact is held, sticks or slips as it did after the last one, so that its force follows from
linear equations: the principle's for those that are held, Coulomb's for slip.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.contact import complementarity, coulomb, response
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import DRY, RIGID, SLIP, STICK, press
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.rubbing import LOST, ROUNDS, SETTLED


@njit(cache=True, error_model="numpy", forceinline=True)
def some(tile: Tile, m: Arrays, flags: Array) -> bool:
    """Return whether a contact is marked in any lane."""
    found = False
    for i in range(m.gaps.size * len(tile)):
        found = found or flags[i] != 0.0
    return found


@njit(cache=True, error_model="numpy")
def _hold(tile: Tile, m: Arrays, w: Work, lane: int) -> None:
    """Find the forces of the closed contacts of a lane from w.gaps.matrix and load into found."""
    g, width, size = w.gaps, len(tile), m.gaps.size
    mode = np.zeros(size)
    for contact in range(size):
        at = contact * width + lane
        if g.closed[at] != 0.0:
            mode[contact] = g.mode[at] if m.gaps.rubs[contact] > 0 else STICK
        if mode[contact] != 0.0 and m.gaps.soft[contact] != RIGID:
            g.load[contact * (1 + m.gaps.tangents)] = press(m.gaps, g, contact, width, lane)[0]
    if m.gaps.tangents == 0 and not m.gives:
        complementarity.solve(size, g.matrix, g.load, mode, g.found)
        return
    unclear, change = False, np.inf
    for _ in range(ROUNDS):
        unclear = coulomb.hold(m.gaps, g.given, width, lane, mode, g.way, g.matrix, g.load, g.near, g.found)
        change = response.allow(m, w, width, lane)
        if change <= SETTLED:
            break
    if not change <= LOST:
        _jam(m, w, width, lane, mode)
    for contact in range(size):
        if unclear and mode[contact] != 0.0:
            g.unclear[contact * width + lane] = 1.0


@njit(cache=True, error_model="numpy")
def _jam(m: Arrays, w: Work, width: int, lane: int, mode: Array) -> None:
    """Leave no forces where friction and the joint forces that it depends on find none that agree."""
    for contact in range(m.gaps.size - 1, -1, -1):
        if mode[contact] == SLIP and m.gaps.share[contact * width + lane] > 0.0:
            w.gaps.found[contact * (1 + m.gaps.tangents) + 1] = np.nan
            w.gauss.ended[2 * width + lane] = coulomb.JAMS + coulomb.TROUBLES * contact


@njit(cache=True, error_model="numpy")
def accelerate(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """Add what the forces of closed contacts do to an acceleration that knows none of them."""
    g, width, c, ways = w.gaps, len(tile), m.constraints.size, 1 + m.gaps.tangents
    if not some(tile, m, g.closed):
        return
    response.respond(tile, m, w, t, z, zdot, tolerance, g.closed)
    for lane in range(width):
        response.matrix(tile, m, w, lane, g.closed)
        response.load_by(tile, m, w, lane, g.closed, a)
        for contact in range(m.gaps.size):
            if g.mode[contact * width + lane] == SLIP:
                response.tangent_of(m, w, contact, width, lane)
        _hold(tile, m, w, lane)
        for direction in range(m.gaps.size * ways):
            g.force[direction * width + lane] = g.found[direction]
            for k in range(c):
                more = g.found[direction] * g.reaction[((direction + 1) * c + k) * width + lane]
                w.gauss.multiplier[k * width + lane] += more
        response.push(tile, m, w, lane, a)
        if m.gaps.tangents > 0 or m.gives:
            _rub(tile, m, w, lane)
        for contact in range(m.gaps.size):
            at, first = contact * width + lane, contact * ways
            pulls = m.gaps.kind[contact] != DRY and g.found[first] < 0.0
            if g.closed[at] != 0.0 and (pulls or (m.gaps.rubs[contact] > 0 and g.margin[at] < 0.0)):
                g.dips[at] = 1.0


@njit(cache=True, error_model="numpy")
def _rub(tile: Tile, m: Arrays, w: Work, lane: int) -> None:
    """Add the dissipated power of friction and compliant contacts; compute the margin to the limit of stick."""
    g, width, ways = w.gaps, len(tile), 1 + m.gaps.tangents
    for contact in range(m.gaps.size):
        at, first, square = contact * width + lane, contact * ways, 0.0
        if m.gaps.soft[contact] != RIGID and g.closed[at] != 0.0:
            elastic = press(m.gaps, g, contact, width, lane)[1]
            w.power[lane] -= (g.found[first] - elastic) * g.rate[at]
        for k in range(1, ways):
            square += g.found[first + k] ** 2
            if g.mode[at] == SLIP:
                w.power[lane] -= g.found[first + k] * g.slip[(first + k) * width + lane]
        if g.mode[at] == STICK:
            limit = coulomb.limit(m.gaps, g.given, contact, width, lane, g.found[first], True)
            # What gives way by less than can be seen opens next, at its limit though it may be.
            hardly = m.gaps.soft[contact] != RIGID and -g.value[at] <= m.gaps.resolution
            g.margin[at] = 0.0 if hardly else limit - np.sqrt(square)


@njit(cache=True, error_model="numpy")
def settle(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Take the drift of closed contacts out of places and rates, by the least change in the mass metric.

    Of the places that along the normal and of joints that stick, of the rates that along all tangents that stick.
    """
    g, width, ways = w.gaps, len(tile), 1 + m.gaps.tangents
    if not some(tile, m, g.closed):
        return
    response.respond(tile, m, w, t, w.z, w.zdot, tolerance, g.closed)
    held = np.zeros(m.gaps.size)
    for lane in range(width):
        response.matrix(tile, m, w, lane, g.closed)
        for part in range(2):
            for contact in range(m.gaps.size):
                at, first = contact * width + lane, contact * ways
                held[contact] = STICK if g.closed[at] != 0.0 else 0.0
                if m.gaps.rubs[contact] > 0 and g.mode[at] == SLIP and m.gaps.kind[contact] == DRY:
                    held[contact] = 0.0
                for k in range(ways):
                    g.load[first + k] = 0.0
                    if held[contact] != 0.0 and _is_held(tile, m, w, contact, lane, k, part):
                        rate = g.rate[at] if k == 0 else g.slip[(first + k) * width + lane]
                        g.load[first + k] = g.value[at] if part == 0 else rate
            if m.gaps.tangents == 0 and not m.gives:
                complementarity.solve(m.gaps.size, g.matrix, g.load, held, g.found)
            else:
                _settle_rubbing(tile, m, w, lane, held, part)
            response.push(tile, m, w, lane, w.z if part == 0 else w.zdot)


@njit(cache=True, error_model="numpy", forceinline=True)
def _is_held(tile: Tile, m: Arrays, w: Work, contact: int, lane: int, k: int, part: int) -> bool:
    """Return whether a closed contact holds its place (part 0) or its rate (1) along a direction.

    Tangents of two surfaces have no place that could be held.
    """
    if k == 0:
        return m.gaps.soft[contact] == RIGID  # type: ignore[no-any-return]
    sticks = w.gaps.mode[contact * len(tile) + lane] == STICK
    return sticks and (part == 1 or m.gaps.kind[contact] == DRY)


@njit(cache=True, error_model="numpy")
def _settle_rubbing(tile: Tile, m: Arrays, w: Work, lane: int, held: Array, part: int) -> None:
    """Find the changes along the directions that are held."""
    g, ways = w.gaps, 1 + m.gaps.tangents
    size, n = m.gaps.size * ways, 0
    each = np.zeros(size, np.int64)
    for row in range(size):
        g.found[row] = 0.0
        contact, k = row // ways, row % ways
        if _is_held(tile, m, w, contact, lane, k, part) and coulomb.is_unknown(m.gaps, contact, k, held[contact]):
            each[n], n = row, n + 1
    equations, right, found = np.zeros(n * n), np.zeros(n), np.zeros(n)
    for i in range(n):
        right[i] = -g.load[each[i]]
        for j in range(n):
            equations[i * n + j] = g.matrix[each[i] * size + each[j]]
    coulomb.solve(n, equations, right, found, np.zeros(n * n))
    for i in range(n):
        g.found[each[i]] = found[i]
