"""Responses of a machine to forces of contacts: G = W P W', P the inverse mass matrix confined to the joints."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile import function_pointers
from shoal.compile.vector import clear
from shoal.mechanics import dynamics, gaps
from shoal.mechanics.derived import derive, fold
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import DRY, PLANE, SLIP, Gaps
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile


@njit(cache=True, error_model="numpy")
def look(tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array, every: bool, whole: bool) -> None:
    """Values, rates and slips of contacts at a state, see `gaps.look`."""
    _derive(tile, m, z, zdot)
    gaps.look(tile, m.gaps, z, zdot, w.gaps, w.element, every, whole)


@njit(cache=True, error_model="numpy", forceinline=True)
def _derive(tile: Tile, m: Arrays, z: Array, zdot: Array) -> None:
    derive(tile, m.derived, z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, zdot, m.unknowns, m.force_rows, True)


@njit(cache=True, error_model="numpy", forceinline=True)
def has(g: Gaps, contact: int, way: int) -> bool:
    """Return whether a contact has a force along a direction: the normal, where it rubs a tangent."""
    if way == 0:
        return g.kind[contact] != DRY  # type: ignore[no-any-return]
    return g.rubs[contact] > 0 and (way == 1 or g.kind[contact] != DRY)


@njit(cache=True, error_model="numpy")
def respond(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, wanted: Array) -> None:
    """Look at the contacts that are wanted in some lane, and find their gradients and responses."""
    _derive(tile, m, z, zdot)
    g, width, n, c, ways = w.gaps, len(tile), m.unknowns, m.constraints.size, 1 + m.gaps.tangents
    last = (m.gaps.size * ways + 1) * c * width
    for i in range(c * width):
        g.reaction[last + i] = w.gauss.multiplier[i]
    for row in range(m.rows):
        clear(tile, g.none, row)
    if c > 0:
        _project(tile, m, w, t, z, zdot, tolerance, g.none)
        for i in range(c * width):
            g.reaction[i] = w.gauss.multiplier[i]
    for contact in range(m.gaps.size):
        some = False
        for lane in range(width):
            some = some or wanted[contact * width + lane] != 0.0
        if some:
            gaps.look_at(tile, m.gaps, contact, z, zdot, g, w.element, True)
        for way in range(ways):
            if not (some and has(m.gaps, contact, way)):
                continue
            direction = contact * ways + way
            first = direction * n * width
            for row in range(m.rows):
                clear(tile, g.unit, row)
            gaps.add_unit(tile, m.gaps, contact, way, z, zdot, g, w.element)
            fold(tile, m.derived, g.unit, m.force_rows)
            for i in range(n * width):
                g.gradient[first + i] = g.unit[i]
            _project(tile, m, w, t, z, zdot, tolerance, g.unit)
            for i in range(n * width):
                g.response[first + i] = g.unit[i] - g.none[i]
            for i in range(c * width):
                g.reaction[(direction + 1) * c * width + i] = w.gauss.multiplier[i] - g.reaction[i]
    for i in range(c * width):
        w.gauss.multiplier[i] = g.reaction[last + i]


@njit(cache=True, error_model="numpy", forceinline=True)
def _project(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, f: Array) -> None:
    """Turn a force into the acceleration that the joints leave of it."""
    if m.constraints.size > 0:
        function_pointers.call(m.table.least, (tile, m, w, t, z, zdot, tolerance, f))
    else:
        dynamics.solve(tile, m, w, f)


@njit(cache=True, error_model="numpy")
def matrix(tile: Tile, m: Arrays, w: Work, lane: int, wanted: Array) -> None:
    """G of the contacts wanted in one lane into w.gaps.matrix, 1 on the diagonal of all other directions."""
    g, width, n, ways = w.gaps, len(tile), m.unknowns, 1 + m.gaps.tangents
    size, known, some = m.gaps.size * ways, np.zeros(m.gaps.size * ways, np.int64), 0
    for i in range(size * size):
        g.matrix[i] = 0.0
    for i in range(size):
        if wanted[i // ways * width + lane] != 0.0 and has(m.gaps, i // ways, i % ways):
            known[some], some = i, some + 1
        else:
            g.matrix[i * size + i] = 1.0
    for i in known[:some]:
        for j in known[:some]:
            total = 0.0
            for k in range(n):
                total += g.gradient[(i * n + k) * width + lane] * g.response[(j * n + k) * width + lane]
            g.matrix[i * size + j] = total


@njit(cache=True, error_model="numpy")
def load_by(tile: Tile, m: Arrays, w: Work, lane: int, wanted: Array, a: Array) -> None:
    """Accelerations of all directions of the wanted contacts at accelerations a into w.gaps.load, 0 of the others."""
    g, width, n, ways = w.gaps, len(tile), m.unknowns, 1 + m.gaps.tangents
    for direction in range(m.gaps.size * ways):
        g.load[direction] = 0.0
        contact = direction // ways
        if wanted[contact * width + lane] != 0.0 and has(m.gaps, contact, direction % ways):
            total = g.bias[direction * width + lane]
            for k in range(n):
                total += g.gradient[(direction * n + k) * width + lane] * a[k * width + lane]
            g.load[direction] = total


@njit(cache=True, error_model="numpy")
def push(tile: Tile, m: Arrays, w: Work, lane: int, x: Array) -> None:
    """Change x by the responses to the forces in w.gaps.found."""
    g, width, n = w.gaps, len(tile), m.unknowns
    for direction in range(m.gaps.size * (1 + m.gaps.tangents)):
        if g.found[direction] != 0.0:
            for k in range(n):
                x[k * width + lane] += g.found[direction] * g.response[(direction * n + k) * width + lane]


@njit(cache=True, error_model="numpy")
def after(tile: Tile, m: Arrays, w: Work, direction: int) -> float:
    """Return the change of the rate of a direction by the forces in w.gaps.found, of the lane of w.gaps.matrix."""
    size, total = m.gaps.size * (1 + m.gaps.tangents), 0.0
    for j in range(size):
        total += w.gaps.matrix[direction * size + j] * w.gaps.found[j]
    return total


@njit(cache=True, error_model="numpy")
def allow(m: Arrays, w: Work, width: int, lane: int) -> float:
    """Find the friction that the forces of joints allow, with the forces of contacts in w.gaps.found.

    Returns its change over the largest, 0 where none depends on them. The multipliers are those without contacts. Of
    one joint that slips, f = mu |N0 + f N1| has one solution where mu |N1| < 1, which this iteration finds; else it has
    none or two, and the iteration diverges.
    """
    g, c, ways, change, largest = w.gaps, m.constraints.size, 1 + m.gaps.tangents, 0.0, 0.0
    for contact in range(m.gaps.size):
        at, square = contact * width + lane, 0.0
        if m.gaps.share[at] == 0.0:
            continue
        for k in range(m.gaps.held[contact], m.gaps.held[contact] + m.gaps.parts[contact]):
            force = w.gauss.multiplier[k * width + lane]
            for direction in range(m.gaps.size * ways):
                if g.found[direction] != 0.0:
                    force += g.found[direction] * g.reaction[((direction + 1) * c + k) * width + lane]
            square += force * force
        last, g.given[at] = g.given[at], m.gaps.given[at] + m.gaps.share[at] * np.sqrt(square)
        if not np.isfinite(g.given[at]):
            return np.inf
        change, largest = max(change, abs(g.given[at] - last)), max(largest, g.given[at])
    return change / largest if largest > 0.0 else change


@njit(cache=True, error_model="numpy")
def tangent_of(m: Arrays, w: Work, contact: int, width: int, lane: int) -> None:
    """The direction of slip of a contact, by its tangents, into w.gaps.way.

    It is that of the slip rate, so far as there is one, on the side of the direction in which it has slipped.
    """
    g, ways = w.gaps, 1 + m.gaps.tangents
    along = gaps.slip_along(m.gaps, g, contact, width, lane)
    square = 0.0
    for k in range(1, ways):
        square += g.slip[(contact * ways + k) * width + lane] ** 2
    speed = np.sqrt(square)
    if not speed > 0.0 or abs(along) < 0.5 * speed:
        along_heading(m, w, contact, width, lane)
        return
    for k in range(1, ways):
        row = contact * ways + k
        g.way[row] = g.slip[row * width + lane] / (speed if along > 0.0 else -speed)


@njit(cache=True, error_model="numpy")
def turn_headings(m: Arrays, w: Work, width: int) -> None:
    """Turn the directions of slip with the surfaces as they have moved since."""
    for at in range(m.gaps.size * width):
        if w.gaps.mode[at] == SLIP and m.gaps.kind[at // width] != DRY:
            tangent_of(m, w, at // width, width, at % width)
            head(m, w, at // width, width, at % width)


@njit(cache=True, error_model="numpy")
def along_heading(m: Arrays, w: Work, contact: int, width: int, lane: int) -> None:
    """Leave the direction in which a contact has slipped, by its tangents, in w.gaps.way."""
    g, ways, square = w.gaps, 1 + m.gaps.tangents, 0.0
    if ways == PLANE:
        g.way[contact * ways + 1] = g.heading[3 * contact * width + lane]
        return
    for k in range(1, ways):
        row = contact * ways + k
        g.way[row] = 0.0
        for axis in range(3):
            part = g.axes[(9 * contact + 3 * k + axis) * width + lane]
            g.way[row] += part * g.heading[(3 * contact + axis) * width + lane]
        square += g.way[row] ** 2
    for k in range(1, ways):
        g.way[contact * ways + k] /= np.sqrt(square)


@njit(cache=True, error_model="numpy")
def head(m: Arrays, w: Work, contact: int, width: int, lane: int) -> None:
    """Keep the direction of slip in w.gaps.way as that in which a contact slips from now on."""
    g, ways = w.gaps, 1 + m.gaps.tangents
    if ways == PLANE:
        g.heading[3 * contact * width + lane] = g.way[contact * ways + 1]
        return
    for axis in range(3):
        total = 0.0
        for k in range(1, ways):
            total += g.way[contact * ways + k] * g.axes[(9 * contact + 3 * k + axis) * width + lane]
        g.heading[(3 * contact + axis) * width + lane] = total
