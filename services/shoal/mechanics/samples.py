"""Samples: registers of signals that keep their values between the instants of a clock (zero-order hold).

At an instant the whole tape has been evaluated as the machine is just before; then the samples are made one after the
other, in the order in which they depend on each other, commands that are due take the place of the ones before, and
sampled states take their next values.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.mechanics import tape
from shoal.mechanics.numerics.tile import Array, Index, Tile

NEAREST, WHEN, WHICH, CODES, FIRST_PENDING = range(5)
"""Rows of the room: 1/2 less the smallest distance of a measured value from a tie between two roundings, in quanta; the
time of that sample [s] and its number; and a number that differs where any rounding does."""
FIELDS = 7


class Samples(NamedTuple):
    """Sampled signals and states, `size` of them.

    rows: of each the end of its instructions on the tape, the register of its value, the one that keeps it, its clock,
    where its room begins, how many values may be on their way (0 of signals without delay), and whether they are
    delayed. quantum: 0 of none, (size, lanes); held: registers that keep values, and begin: what they begin with,
    (held, lanes). pending: rows of the room.
    """

    size: int
    rows: Index
    quantum: Array
    held: int
    begin: Array
    pending: int


@njit(cache=True, error_model="numpy")
def take(
    tile: Tile, s: Samples, code: Index, begin: int, first: int, register: Array, room: Array, due: int, t: float
) -> None:
    """Take the samples that are due at the time t; begin: the instruction with which those of samples begin."""
    width = len(tile)
    for k in range(s.size):
        end, source, target = s.rows[FIELDS * k], s.rows[FIELDS * k + 1] * width, s.rows[FIELDS * k + 2] * width
        clock, own, flying = s.rows[FIELDS * k + 3], s.rows[FIELDS * k + 4], s.rows[FIELDS * k + 5]
        tape.run(tile, shift(code, tape.ENTRIES * begin), end - begin, first + begin, register, room, False)
        begin = end
        if not (due >> (2 * clock)) & 1:
            continue
        for lane in range(width):
            x, quantum = register[source + lane], s.quantum[k * width + lane]
            if quantum > 0.0:
                x = _rounded(width, room, x, quantum, lane, k, t)
            if flying > 0:
                room[(own + flying + 1) * width + lane] = x
            else:
                register[target + lane] = x
    for k in range(s.size):
        target, clock = s.rows[FIELDS * k + 2] * width, s.rows[FIELDS * k + 3]
        own, flying, late = s.rows[FIELDS * k + 4], s.rows[FIELDS * k + 5], s.rows[FIELDS * k + 6]
        ticks, arrives = (due >> (2 * clock)) & 1, (due >> (2 * clock + 1)) & 1
        for lane in range(width if flying > 0 else 0):
            queue, last = (own + 1) * width + lane, (own + flying + 1) * width + lane
            if late and arrives:
                register[target + lane] = room[queue]
                for place in range(flying - 1):
                    room[queue + place * width] = room[queue + (place + 1) * width]
                room[own * width + lane] -= 1.0
            if late and ticks:
                room[queue + int(room[own * width + lane]) * width] = room[last]
                room[own * width + lane] += 1.0
            elif ticks:
                register[target + lane] = room[last]


@njit(cache=True, error_model="numpy")
def _rounded(width: int, room: Array, x: float, quantum: float, lane: int, number: int, t: float) -> float:
    """Return the nearest multiple of a quantum, and keep how near to another one the value is."""
    raised = x / quantum + 0.5
    near, code = 0.5 - abs(raised - np.rint(raised)), np.floor(raised)
    if near > room[NEAREST * width + lane]:
        room[NEAREST * width + lane], room[WHEN * width + lane], room[WHICH * width + lane] = near, t, number
    # By irrational factors, so that no rounding makes up for another one.
    mixed = room[CODES * width + lane] * 0.7548776662466927 + code * 0.5698402909980532
    room[CODES * width + lane] = mixed - np.floor(mixed)
    return quantum * float(code)
