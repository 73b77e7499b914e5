"""Accelerations with closed contacts, and impacts: least deviations in the metric of the mass matrix.

Gauss's principle with inequalities: of all accelerations with g_q a >= -bias for gaps with g = g' = 0, the true one
deviates least from the free one. Its forces, of a closed contact not negative, solve a small convex complementarity
problem with G = g_q P g_q', P the inverse mass matrix confined to the joints; between events those of closed contacts
solve its equations. An impact changes the rates by the least that brings g'+ + e g'- >= 0 (Moreau 1988).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile import function_pointers
from shoal.compile.vector import clear
from shoal.mechanics import dynamics, forces, gaps
from shoal.mechanics.derived import derive, fold
from shoal.mechanics.dynamics import ACCELERATION, Work
from shoal.mechanics.gaps import LOGGED
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import complementarity
from shoal.mechanics.numerics.tile import Array, Tile

HIT, LIFT = 1.0, -1.0
"""What an event is about: a gap that closes, a contact that opens."""
MOST = 100_000
"""Events after which a motion is given up."""
STILL = 1e-12
"""Rate after an impact, over the largest before it, that is none."""


@njit(cache=True, error_model="numpy")
def look(tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array) -> None:
    """Values and rates of all gaps at a state."""
    derive(tile, m.derived, z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, zdot, m.unknowns, m.force_rows, True)
    gaps.look(tile, m.gaps, z, zdot, w.gaps, w.element)


@njit(cache=True, error_model="numpy")
def _respond(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, wanted: Array) -> None:
    """Gradients and responses of the gaps that are wanted in some lane, and the values and rates of all."""
    look(tile, m, w, z, zdot)
    g, width, n, c = w.gaps, len(tile), m.unknowns, m.constraints.size
    rows, first = 3 * m.dimensions, 3 * m.dimensions
    for i in range(c * width):
        g.reaction[(m.gaps.size + 1) * c * width + i] = w.gauss.multiplier[i]
    for row in range(m.rows):
        clear(tile, g.none, row)
    if c > 0:
        _project(tile, m, w, t, z, zdot, tolerance, g.none)
        for i in range(c * width):
            g.reaction[i] = w.gauss.multiplier[i]
    for number in range(m.gaps.size):
        some = False
        for lane in range(width):
            some = some or wanted[number * width + lane] != 0.0
        if not some:
            continue
        measures = m.gaps.measures
        look_at = number * n * width
        for row in range(m.rows):
            clear(tile, g.unit, row)
        forces.measure(tile, measures, number, z, g.memory, w.element)
        for k in range(rows):
            row = measures.rows[rows * number + k]
            for lane in range(width):
                g.unit[row * width + lane] += m.gaps.sign[number * width + lane] * w.element[(first + k) * width + lane]
        fold(tile, m.derived, g.unit, m.force_rows)
        for i in range(n * width):
            g.gradient[look_at + i] = g.unit[i]
        _project(tile, m, w, t, z, zdot, tolerance, g.unit)
        for i in range(n * width):
            g.response[look_at + i] = g.unit[i] - g.none[i]
        for i in range(c * width):
            g.reaction[(number + 1) * c * width + i] = w.gauss.multiplier[i] - g.reaction[i]
    for i in range(c * width):
        w.gauss.multiplier[i] = g.reaction[(m.gaps.size + 1) * c * width + i]


@njit(cache=True, error_model="numpy", forceinline=True)
def _project(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, f: Array) -> None:
    """Turn a force into the acceleration that the joints leave of it."""
    if m.constraints.size > 0:
        function_pointers.call(m.table.least, (tile, m, w, t, z, zdot, tolerance, f))
    else:
        dynamics.solve(tile, m, w, f)


@njit(cache=True, error_model="numpy")
def _matrix(tile: Tile, m: Arrays, w: Work, lane: int, wanted: Array) -> None:
    """G of the contacts wanted in one lane into w.gaps.matrix, 1 on the diagonal of the others."""
    g, width, n, size = w.gaps, len(tile), m.unknowns, m.gaps.size
    for i in range(size):
        for j in range(size):
            total = 1.0 if i == j else 0.0
            if wanted[i * width + lane] != 0.0 and wanted[j * width + lane] != 0.0:
                total = 0.0
                for k in range(n):
                    total += g.gradient[(i * n + k) * width + lane] * g.response[(j * n + k) * width + lane]
            g.matrix[i * size + j] = total


@njit(cache=True, error_model="numpy", forceinline=True)
def _along(tile: Tile, m: Arrays, w: Work, number: int, lane: int, x: Array) -> float:
    """Return g_q x."""
    width, n, total = len(tile), m.unknowns, 0.0
    for k in range(n):
        total += w.gaps.gradient[(number * n + k) * width + lane] * x[k * width + lane]
    return total


@njit(cache=True, error_model="numpy", forceinline=True)
def _push(tile: Tile, m: Arrays, w: Work, lane: int, x: Array) -> None:
    """Change x by the responses to the forces in w.gaps.found."""
    g, width, n = w.gaps, len(tile), m.unknowns
    for number in range(m.gaps.size):
        if g.found[number] != 0.0:
            for k in range(n):
                x[k * width + lane] += g.found[number] * g.response[(number * n + k) * width + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _some(tile: Tile, m: Arrays, flags: Array) -> bool:
    found = False
    for i in range(m.gaps.size * len(tile)):
        found = found or flags[i] != 0.0
    return found


@njit(cache=True, error_model="numpy")
def accelerate(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """Add what the forces of closed contacts do to an acceleration that knows none of them."""
    g, width, c = w.gaps, len(tile), m.constraints.size
    if not _some(tile, m, g.closed):
        return
    _respond(tile, m, w, t, z, zdot, tolerance, g.closed)
    for lane in range(width):
        _matrix(tile, m, w, lane, g.closed)
        for number in range(m.gaps.size):
            at = number * width + lane
            g.load[number] = 0.0
            if g.closed[at] != 0.0:
                g.load[number] = _along(tile, m, w, number, lane, a) + gaps.bias(tile, m.gaps, number, lane, z, zdot)
        _hold(m.gaps.size, w, width, lane)
        for number in range(m.gaps.size):
            g.force[number * width + lane] = g.found[number]
            for k in range(c):
                more = g.found[number] * g.reaction[((number + 1) * c + k) * width + lane]
                w.gauss.multiplier[k * width + lane] += more
        _push(tile, m, w, lane, a)


@njit(cache=True, error_model="numpy", forceinline=True)
def _hold(size: int, w: Work, width: int, lane: int) -> None:
    """Solve G p = -load for the closed contacts of a lane."""
    g, active = w.gaps, np.zeros(size)
    for number in range(size):
        active[number] = g.closed[number * width + lane]
    complementarity.solve(size, g.matrix, g.load, active, g.found)


@njit(cache=True, error_model="numpy")
def settle(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Take the drift of closed contacts out of places and rates, by the least change in the mass metric."""
    g, width = w.gaps, len(tile)
    if not _some(tile, m, g.closed):
        return
    _respond(tile, m, w, t, w.z, w.zdot, tolerance, g.closed)
    for lane in range(width):
        _matrix(tile, m, w, lane, g.closed)
        for part in range(2):
            for number in range(m.gaps.size):
                at = number * width + lane
                drift = g.value[at] if part == 0 else g.rate[at]
                g.load[number] = drift if g.closed[at] != 0.0 else 0.0
            _hold(m.gaps.size, w, width, lane)
            _push(tile, m, w, lane, w.z if part == 0 else w.zdot)


@njit(cache=True, error_model="numpy")
def decide(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Decide on the contacts that are marked in w.gaps.hit: impacts first, then which contacts are closed.

    Leaves the rates after the impacts in w.zdot, and the acceleration in w.a.
    """
    g, width, size = w.gaps, len(tile), m.gaps.size
    wanted = np.zeros(size * width)
    for at in range(size * width):
        wanted[at] = 1.0 if g.hit[at] == HIT or g.closed[at] != 0.0 else 0.0
    _respond(tile, m, w, t, w.z, w.zdot, tolerance, wanted)
    for lane in range(width):
        if _concerns(size, width, lane, g.hit):
            _impact(tile, m, w, t, lane, wanted)
    # The acceleration without contacts decides which of those that do not separate press.
    for at in range(size * width):
        if _concerns(size, width, at % width, g.hit):
            g.closed[at] = 0.0
            if g.hit[at] == LIFT or wanted[at] == 2.0:
                wanted[at] = 0.0
    function_pointers.call(m.table.motion, (tile, m, w, t, w.z, w.zdot, tolerance, w.a, ACCELERATION))
    _respond(tile, m, w, t, w.z, w.zdot, tolerance, wanted)
    for lane in range(width):
        if not _concerns(size, width, lane, g.hit):
            continue
        _matrix(tile, m, w, lane, wanted)
        for number in range(size):
            at = number * width + lane
            g.load[number] = 0.0
            if wanted[at] != 0.0:
                g.load[number] = _along(tile, m, w, number, lane, w.a) + gaps.bias(
                    tile, m.gaps, number, lane, w.z, w.zdot
                )
        complementarity.complementary(size, g.matrix, g.load, g.found)
        for number in range(size):
            g.closed[number * width + lane] = 1.0 if g.found[number] > 0.0 else 0.0
    for at in range(size * width):
        g.hit[at] = 0.0
        g.force[at] = 0.0
    settle(tile, m, w, t, tolerance)
    function_pointers.call(m.table.motion, (tile, m, w, t, w.z, w.zdot, tolerance, w.a, ACCELERATION))


@njit(cache=True, error_model="numpy", forceinline=True)
def _concerns(size: int, width: int, lane: int, hit: Array) -> bool:
    found = False
    for number in range(size):
        found = found or hit[number * width + lane] != 0.0
    return found


@njit(cache=True, error_model="numpy")
def _impact(tile: Tile, m: Arrays, w: Work, t: float, lane: int, wanted: Array) -> None:
    """Change the rates of one lane by the impulses of its contacts; those that separate are marked by 2 in `wanted`."""
    g, width, size = w.gaps, len(tile), m.gaps.size
    _matrix(tile, m, w, lane, wanted)
    fastest = 0.0
    for number in range(size):
        at = number * width + lane
        g.load[number] = 0.0
        if wanted[at] == 0.0:
            continue
        rate, restitution = g.rate[at], m.gaps.restitution[at]
        fastest = max(fastest, abs(rate))
        falling = -(_along(tile, m, w, number, lane, w.a) + gaps.bias(tile, m.gaps, number, lane, w.z, w.zdot))
        hop = restitution * rate
        if falling > 0.0 and hop * hop < 2.0 * falling * m.gaps.resolution:
            restitution = 0.0
        g.load[number] = (1.0 + restitution) * rate
    complementarity.complementary(size, g.matrix, g.load, g.found)
    _push(tile, m, w, lane, w.zdot)
    for number in range(size):
        at = number * width + lane
        if wanted[at] == 0.0:
            continue
        after = g.rate[at]
        for other in range(size):
            if wanted[other * width + lane] != 0.0:
                after += g.matrix[number * size + other] * g.found[other]
        if after > STILL * fastest:
            wanted[at] = 2.0
    for number in range(size):
        if g.hit[number * width + lane] != 0.0:
            g.number[lane] += 1.0
            count = int(g.number[lane])
            if count > MOST:
                w.gauss.ended[lane] = t
                for i in range(lane, m.unknowns * width, width):
                    w.zdot[i] = np.nan
            if lane == 0 and count <= LOGGED:
                g.log[3 * (count - 1)], g.log[3 * (count - 1) + 1] = t, number
                g.log[3 * (count - 1) + 2] = g.found[number] if g.hit[number * width + lane] == HIT else -1.0
