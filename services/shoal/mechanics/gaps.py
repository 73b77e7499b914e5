"""Gaps g(q) >= 0: a measure of `forces` against a limit, its rate, and the bias of its second derivative."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import forces
from shoal.mechanics.forces import ANGLE, DISTANCE, Forces
from shoal.mechanics.numerics.tile import Array, Tile


class Gaps(NamedTuple):
    """One-sided limits of one tile.

    measures: what is limited, with the limit for its natural value. sign: 1 of a lower limit, -1 of an upper one, and
    restitution: rate after an impact over the rate before, with the opposite sign (Newton), both (gaps, lanes).
    resolution: gaps below this are closed, [m or rad].
    """

    size: int
    measures: Forces
    sign: Array
    restitution: Array
    resolution: float


class GapWork(NamedTuple):
    """Work space of one tile, by gap and lane unless stated.

    memory: the continuous angles of angular gaps. value, rate: g [m or rad] and its rate; value_before, rate_before,
    force_before: at the beginning of a step. closed: whether the contact is closed; hit: whether it is to be decided
    on at the event that a step has ended at. force: multiplier of a closed contact, not negative [N or N m].
    gradient, response: sign * g_q and the acceleration by a unit force, (gaps * unknowns, lanes). none: the
    acceleration without forces, unit: a unit force, (rows, lanes). reaction: multipliers of the constraints: without
    forces, by a unit force of each contact, and as they are, ((gaps + 2) * constraints, lanes). matrix, load, found:
    of one lane, (gaps * gaps,) and (gaps,). log: time, gap and impulse of each event of the first lane, (3 * LOGGED,);
    number: of events, (lanes,).
    """

    memory: Array
    value: Array
    rate: Array
    value_before: Array
    rate_before: Array
    force_before: Array
    closed: Array
    hit: Array
    force: Array
    gradient: Array
    response: Array
    none: Array
    unit: Array
    reaction: Array
    matrix: Array
    load: Array
    found: Array
    log: Array
    number: Array


LOGGED = 4096
"""So many events of the first lane are kept."""


def room(width: int, size: int, unknowns: int, rows: int, constraints: int) -> GapWork:
    """Work space as arrays."""
    each, vectors = (size * width,) * 9, (size * unknowns * width,) * 2
    whole, reaction = rows * width if size else 0, (size + 2) * constraints * width if size else 0
    small, log = (size * size, size, size), (3 * LOGGED, width) if size else (0, 0)
    sizes = *each, *vectors, whole, whole, reaction, *small, *log
    return GapWork._make([np.zeros(one) for one in sizes])


@njit(cache=True, error_model="numpy")
def look(tile: Tile, gaps: Gaps, z: Array, zdot: Array, g: GapWork, room: Array) -> None:
    """Values and rates of all gaps; derived rows of z and zdot must be filled. room: of 6 d + 3 rows. Pointers."""
    width = len(tile)
    value = forces.value_row(gaps.measures) * width
    for number in range(gaps.size):
        forces.measure(tile, gaps.measures, number, z, g.memory, room)
        forces.slip(tile, gaps.measures, number, zdot, room)
        for lane in range(width):
            at = number * width + lane
            g.value[at] = gaps.sign[at] * room[value + lane]
            g.rate[at] = gaps.sign[at] * room[value + width + lane]


@njit(cache=True, error_model="numpy")
def bias(tile: Tile, gaps: Gaps, number: int, lane: int, z: Array, zdot: Array) -> float:
    """Return the second derivative of a gap by time for accelerations of zero, zdot' g_qq zdot, in one lane."""
    width, d, first = len(tile), gaps.measures.dimensions, 3 * gaps.measures.dimensions * number
    rows, kind = gaps.measures.rows, gaps.measures.kind[number]
    sign = gaps.sign[number * width + lane]
    if kind == ANGLE and d == 2:
        total = 0.0
        for end in range(2):
            x, y = rows[first + d * end] * width + lane, rows[first + d * end + 1] * width + lane
            square = z[x] * z[x] + z[y] * z[y]
            along, across = z[x] * zdot[x] + z[y] * zdot[y], z[x] * zdot[y] - z[y] * zdot[x]
            total += (1.0 if end == 0 else -1.0) * 2.0 * along * across / (square * square)
        return sign * total  # type: ignore[no-any-return]
    # Products of vectors and of their rates, by component.
    rr, ru, uu, dd, de, ee, rd, turning, ue = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x, y, xr, yr, xb, yb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(d):
        a, b, c = (
            rows[first + k] * width + lane,
            rows[first + d + k] * width + lane,
            rows[first + 2 * d + k] * width + lane,
        )
        if kind == ANGLE:
            x, y = x + z[b] * z[a], y + z[b] * z[c]
            xr, yr = xr + zdot[b] * z[a] + z[b] * zdot[a], yr + zdot[b] * z[c] + z[b] * zdot[c]
            xb, yb = xb + 2.0 * zdot[b] * zdot[a], yb + 2.0 * zdot[b] * zdot[c]
        else:
            r, u = z[b] - z[a], zdot[b] - zdot[a]
            rr, ru, uu = rr + r * r, ru + r * u, uu + u * u
            dd, de, ee = dd + z[c] * z[c], de + z[c] * zdot[c], ee + zdot[c] * zdot[c]
            rd, turning, ue = rd + r * z[c], turning + r * zdot[c] + u * z[c], ue + u * zdot[c]
    if kind == ANGLE:
        square, turn = x * x + y * y, x * yr - y * xr
        return sign * ((x * yb - y * xb) / square - 2.0 * turn * (x * xr + y * yr) / (square * square))  # type: ignore[no-any-return]
    if kind == DISTANCE:
        return sign * (uu - ru * ru / rr) / np.sqrt(rr)  # type: ignore[no-any-return]
    # r.d / |d|, the second derivative of a quotient.
    size = np.sqrt(dd)
    slope = de / size
    bend = (ee - slope * slope) / size
    place, rate = rd / size, turning
    first_rate = (rate - place * slope) / size
    return sign * (2.0 * ue - place * bend - 2.0 * first_rate * slope) / size  # type: ignore[no-any-return]
