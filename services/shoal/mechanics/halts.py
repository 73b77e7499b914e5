"""Breakpoints of the time loop: times at which functions of time are not smooth, and narrow parts of force laws.

A function is smooth between its jumps and kinks, where every step ends; but it may also be so narrow there (`narrow`)
that a step would pass over it unseen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import forces
from shoal.mechanics.forces import Forces
from shoal.mechanics.model import Model
from shoal.mechanics.narrow import narrow
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.scene.sampled import merged_instants

CROSSED = 0.5
"""Largest fraction of an interval between two marks of a force law that one step may cross."""
RESOLUTION = 1e-14
"""Times closer than this fraction of the run are one."""
EDGE = 1e-9
"""A fixed step that would end later than the run by more than this fraction of itself ends with it."""


class Halts(NamedTuple):
    """Times [s], increasing, that steps end at; of force element k the marks start[k]:start[k+1] on its elongation.

    due: which samples are due at each of the times, see `sampled.merged_instants`, and `first` at time 0.
    """

    times: Array
    start: Index
    marks: Array
    due: Index
    first: int


def halts(model: Model, end: float, longest: float, adaptive: bool) -> Halts:
    """For a run up to `end` [s] in steps of at most, or exactly, `longest` [s]."""
    laws = {int(number) for kind in (model.forces.table, model.forces.energy) for number in kind}
    found = []
    for number in (k for k in range(model.functions.size) if k not in laws):
        function = model.function(number)
        found += [function.kinks, narrow(function.breaks, longest, adaptive)]
    times = np.unique(np.concatenate([np.zeros(0), *found]))
    times = times[(times > RESOLUTION * end) & (times <= end)]
    times = times[np.diff(times, prepend=0.0) > RESOLUTION * end]
    clocked, due = merged_instants(model.clocks, end)
    first = int(due[0]) if len(due) and clocked[0] == 0.0 else 0
    times, asked = _together(times, clocked[clocked > 0.0], due[clocked > 0.0], RESOLUTION * end)
    if (found or model.clocks) and not adaptive and np.ceil(end / longest - EDGE) * longest > end * (1 + EDGE):
        # Functions of time are known up to the end of the run.
        inside = times < end * (1 - RESOLUTION)
        times, asked = np.append(times[inside], end), np.append(asked[inside], 0)
    found = [model.function(int(number)).kinks if number >= 0 else np.zeros(0) for number in model.forces.table]
    start = np.cumsum([0, *(len(part) for part in found)], dtype=np.int64)
    return Halts(times, start, np.concatenate([np.zeros(0), *found]), asked, first)


def _together(times: Array, clocked: Array, due: Index, least: float) -> tuple[Array, Index]:
    """Merge instants of samples into breakpoints, and what is due then; those that are closer than `least` are one."""
    if not len(clocked):
        return times, np.zeros(len(times), dtype=np.int64)
    at = np.searchsorted(times, clocked)
    for side in (at - 1, at):
        near = times[np.clip(side, 0, len(times) - 1)] if len(times) else np.full(len(clocked), np.inf)
        clocked = np.where(abs(near - clocked) <= least, near, clocked)
    merged, where = np.unique(np.concatenate([times, clocked]), return_inverse=True)
    found = np.zeros(len(merged), dtype=np.int64)
    np.bitwise_or.at(found, where[len(times) :], due)
    return merged, found


@njit(cache=True, error_model="numpy")
def leapt(tile: Tile, held: Forces, halts: Halts, before: Array, z: Array, memory: Array, room: Array) -> bool:
    """Return whether a step went too far across a part of a force law; before: elongations at its beginning, (forces,
    lanes).

    z: coordinates at its end, derived rows filled. Pointers but for halts and before.
    """
    width = len(tile)
    for number in range(held.size):
        first, last = halts.start[number], halts.start[number + 1]
        if last - first < 2:
            continue
        forces.measure(tile, held, number, z, memory, room)
        for lane in range(width):
            one, other = before[number * width + lane], room[forces.value_row(held) * width + lane]
            low, high = min(one, other), max(one, other)
            if not (np.isfinite(low) and np.isfinite(high)):
                continue
            k = first + np.searchsorted(halts.marks[first:last], low, side="right")
            while k < last and (k == first or halts.marks[k - 1] <= high):
                if k > first and high - low > CROSSED * (halts.marks[k] - halts.marks[k - 1]):
                    return True
                k += 1
    return False


@njit(cache=True, error_model="numpy")
def elongations(tile: Tile, held: Forces, z: Array, memory: Array, room: Array, out: Array) -> None:
    """Elongations of all force elements, (forces, lanes). Pointers but for out."""
    width = len(tile)
    for number in range(held.size):
        forces.measure(tile, held, number, z, memory, room)
        for lane in range(width):
            out[number * width + lane] = room[forces.value_row(held) * width + lane]
