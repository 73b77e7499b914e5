"""Events of contacts in the lanes of a tile: a lane that comes near one takes the step again in a loop of its own.

A tile takes common steps, which the events of all its lanes would cut: 16 lanes with an event each in ten steps would
take three times as many. So the tile steps as if there were no contacts, and a lane in which one is closed or could
close within a step is marched by itself from its beginning to its end, with all events in it, and goes on in the tile
from there. Contacts of a lane in the tile are open.
"""

from __future__ import annotations

from typing import Any

from numba import njit, typeof, types

from shoal.compile import function_pointers
from shoal.compile.pointers import pointed, raw_type
from shoal.compile.structures import Reference
from shoal.mechanics import constraints, contact_events, kernels
from shoal.mechanics.contact import motion
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import KEPT
from shoal.mechanics.integrators.scheme import restart
from shoal.mechanics.marched import (
    BEGUN,
    CUTS,
    DONE,
    ENDING,
    EVENT,
    HALT,
    NOW,
    NUMBER,
    ROOM,
    SAMPLE,
    TAKEN,
    WHOLE,
    Frame,
    LoopRoom,
    Marched,
    frame_type,
    sampled,
)
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index, Tile

IN_TILE, JOINS, ALONE = 0.0, 1.0, 2.0
"""Whether a lane takes the steps of its tile, or one by itself: the first in a row, or another."""
VISIT, LOOP, FRAME, SAMPLES, CONTACTS = range(5)
"""Addresses of a lane's own march: of `visit` and of the loop, and where its frame and its samples lie."""
ADDRESSES = 5
ENDLESS = 1e15
"""Steps of a lane by itself within one of its tile, before which its loop does not pause."""


@njit(cache=True, error_model="numpy")
def approach(tile: Tile, m: Arrays, w: Work, taken: float) -> None:
    """Mark the lanes of a tile of several in which a contact is closed or could close in the last step.

    By the rule of `contact_events.first`. taken: length of the step [s]
    """
    g, width = w.gaps, len(tile)
    count = m.gaps.size * width
    kernels.look(tile, m, w, w.z, w.zdot)
    rate = contact_events.RATE * count
    for lane in range(width):
        near = False
        for at in range(lane, count, width):
            fastest = max(abs(g.before[rate + at]), abs(g.rate[at]))
            near = near or g.closed[at] != 0.0 or not contact_events.is_far(g.before[at] + g.value[at], fastest, taken)
            g.before[at], g.before[rate + at] = g.value[at], g.rate[at]
        g.alone[lane] = IN_TILE if not near else (JOINS if g.alone[lane] == IN_TILE else ALONE)


@njit(cache=True, error_model="numpy")
def lacks(w: Work, own: Index, lanes: int) -> bool:
    """Return whether a lane that is marked has no march of its own yet; own: `ADDRESSES` of each lane."""
    found = False
    for lane in range(lanes):
        found = found or (w.gaps.alone[lane] != IN_TILE and own[ADDRESSES * lane] == 0)
    return found


@njit(cache=True, error_model="numpy")
def meet(
    tile: Tile, m: Arrays, w: Work, k: LoopRoom, record: Marched, own: Index, lanes: int, begin: float, end: float,
    number: int, whole: bool, sample: int, halt: int, jumps: bool,
) -> None:  # fmt: skip
    """March the lanes that are marked by themselves, from the beginning of the last step to its end [s].

    number, whole, sample, halt: progress of the tile at its beginning; jumps: whether forces jumped there. What repeats
    the last lane, to fill the tile, does so here.
    """
    width, last = len(tile), lanes - 1
    for lane in range(lanes):
        if w.gaps.alone[lane] != IN_TILE:
            first = ADDRESSES * lane
            arguments = (w, k, record, lane, width, begin, end, number, whole, sample, halt, jumps)
            function_pointers.call(own[first + VISIT], (own[first + FRAME], own[first + LOOP], *arguments))
    for lane in range(lanes, width if w.gaps.alone[last] != IN_TILE else 0):
        for at in range(0, m.unknowns * width, width):
            for x in (w.z, w.zdot, w.a):
                x[at + lane] = x[at + last]
        for at in range(0, m.gaps.size * width, width):
            w.gaps.closed[at + lane] = w.gaps.closed[at + last]
            for row in (at, at + m.gaps.size * width):
                w.gaps.before[row + lane] = w.gaps.before[row + last]


@njit(cache=True, error_model="numpy")
def visit(
    frame: Any, loop: int, w: Work, k: LoopRoom, record: Marched, lane: int, width: int, begin: float, end: float,
    number: int, whole: bool, sample: int, halt: int, jumps: bool,
) -> None:  # fmt: skip
    """March a lane of a tile in its own frame, from the beginning of the tile's last step to its end; see `meet`.

    w, k, record: of the tile, which is given back the state at the end, and what it records but for samples.
    """
    tile, m, room, own, progress = frame.tile, frame.arrays, frame.room, frame.own, frame.own.progress
    n, joins = m.unknowns, w.gaps.alone[lane] == JOINS
    for i in range(n):
        at = i * width + lane
        room.z[i], room.zdot[i] = k.past[at], k.past[n * width + at]
        room.a[i] = k.past[2 * n * width + at] if joins else room.a[i]
    room.until[0] = w.until[0]
    _copy(m.forces.size, w.memory, lane, width, room.memory, 0, 1)
    _copy(m.gaps.measures.size, w.gaps.memory, lane, width, room.gaps.memory, 0, 1)
    markers = frame.directed // (2 * m.dimensions)
    _copy(markers, k.turns, lane, width, own.turns, 0, 1)
    _copy(markers, k.above, lane, width, own.above, 0, 1)
    own.start[0], own.dissipated[0], own.last_power[0] = k.start[lane], k.dissipated[lane], k.last_power[lane]
    progress[EVENT] = 0.0
    if joins:
        restart(frame.scheme)
        frame.scheme.suggestion[0] = end - begin
        contact_events.begin(tile, m, room)
        if begin == 0.0:
            progress[EVENT] = contact_events.touching(tile, m, room)
    elif jumps:
        restart(frame.scheme)
        kernels.look(tile, m, room, room.z, room.zdot)
        kernels.acceleration(tile, m, room, begin, room.z, room.zdot, frame.tolerance, room.a)
        own.last_power[0] = room.power[0]
        progress[EVENT] = contact_events.jumped(tile, m, room)
    progress[BEGUN], progress[DONE], progress[ROOM], progress[CUTS] = 1.0, 0.0, ENDLESS, 0.0
    progress[NOW], progress[ENDING], progress[TAKEN] = begin, end, end - begin
    progress[NUMBER], progress[WHOLE], progress[SAMPLE], progress[HALT] = number, 1.0 if whole else 0.0, sample, halt
    function_pointers.call(loop, (frame,))
    some = motion.some(tile, m, room.gaps.closed)
    if some:  # the tile goes on as if it were open, from an acceleration of that motion
        for contact in range(m.gaps.size):
            room.gaps.looked[contact], room.gaps.closed[contact] = room.gaps.closed[contact], 0.0
        kernels.acceleration(tile, m, room, end, room.z, room.zdot, frame.tolerance, own.a)
        for contact in range(m.gaps.size):
            room.gaps.closed[contact] = room.gaps.looked[contact]
    for i in range(n):
        at = i * width + lane
        w.z[at], w.zdot[at], w.a[at] = room.z[i], room.zdot[i], own.a[i] if some else room.a[i]
    _copy(m.gaps.size, room.gaps.closed, 0, 1, w.gaps.closed, lane, width)
    _copy(m.gaps.size, room.gaps.value, 0, 1, w.gaps.before, lane, width)
    _copy(m.gaps.size, room.gaps.rate, 0, 1, w.gaps.before, m.gaps.size * width + lane, width)
    if room.gauss.ended[0] >= 0.0 and w.gauss.ended[lane] < 0.0:
        _copy(3, room.gauss.ended, 0, 1, w.gauss.ended, lane, width)
    alone = frame.record
    if begin == 0.0 and sample > 0:  # an event at the start is seen in what was sampled there
        kept = m.gaps.size * KEPT
        first = kept * (sample - 1)
        _copy(kept, alone.contacts, first, 1, record.contacts, first * width + lane, width)
    w.gaps.apart[lane], w.gaps.apart[width + lane] = own.dissipated[0], own.last_power[0]
    for one, other in ((record.energy_error, alone.energy_error), (record.energy_scale, alone.energy_scale)):
        one[lane] = other[0] if not other[0] <= one[lane] else one[lane]
    for power in range(constraints.POWERS):
        at = power * width + lane
        record.drift[at] = max(record.drift[at], alone.drift[power])


@njit(cache=True, error_model="numpy", forceinline=True)
def _copy(count: int, one: Array, first: int, step: int, other: Array, begin: int, stride: int) -> None:
    for i in range(count):
        other[begin + i * stride] = one[first + i * step]


@njit(cache=True, error_model="numpy")
def account(tile: Tile, w: Work, k: LoopRoom) -> None:
    """Take up what was dissipated [J], and the power [W] at the end, of the lanes that were by themselves."""
    width = len(tile)
    for lane in range(width):
        if w.gaps.alone[lane] != IN_TILE:
            k.dissipated[lane], k.last_power[lane] = w.gaps.apart[lane], w.gaps.apart[width + lane]


@njit(cache=True, error_model="numpy")
def take_samples(
    tile: Tile, m: Arrays, w: Work, record: Marched, own: Index, lanes: int, marker_rows: Index, first: int, last: int
) -> None:
    """Take samples from `first` up to `last` of the lanes that took the step by themselves from their own records."""
    width, rows = len(tile), sampled(m.dimensions) * (marker_rows.size // (2 * m.dimensions))
    for lane in range(lanes):
        if w.gaps.alone[lane] != IN_TILE:
            samples, contacts = pointed(own[ADDRESSES * lane + SAMPLES]), pointed(own[ADDRESSES * lane + CONTACTS])
            kept = m.gaps.size * KEPT
            for at in range(first * rows, last * rows):
                record.samples[at * width + lane] = samples[at]
            for at in range(first * kept, last * kept):
                record.contacts[at * width + lane] = contacts[at]


def visit_kernel(frame: Frame) -> kernels.Kernel:
    """Return the kernel that marches a lane of a tile in its own frame, with its types."""
    parts = (Reference(raw_type(typeof(part))) for part in (frame.room, frame.own, frame.record))
    count, number, flag = types.int64, types.float64, types.boolean
    return visit, (frame_type(frame), count, *parts, count, count, number, number, count, flag, count, count, flag)
