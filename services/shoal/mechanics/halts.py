"""Where a march may not step across: times at which functions of time are not smooth, and narrow parts of force laws.

A function is smooth between its jumps and kinks, where every step ends; but it may also be so narrow there that a step
would pass over it unseen. How narrow it is shows in the widths of the pieces that were needed to fit it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import forces
from shoal.mechanics.forces import Forces
from shoal.mechanics.functions import Piecewise
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Index, Tile

NARROW = 0.25
"""Pieces narrower than this fraction of the longest step are not left to a step that sees its error, ..."""
PARTS = 8
"""... and fixed steps pass pieces narrower than themselves in so many, and in no fewer what is short beside its
neighbours."""
GRADED = 1.9
"""Neighbouring pieces whose widths differ by more than this factor lead to something narrow."""
CROSSED = 0.5
"""Largest fraction of an interval between two marks of a force law that one step may cross."""
RESOLUTION = 1e-14
"""Times closer than this fraction of the run are one."""
EDGE = 1e-9
"""A fixed step that would end later than the run by more than this fraction of itself ends with it."""


class Halts(NamedTuple):
    """Times [s], increasing, that steps end at; of force element k the marks start[k]:start[k+1] on its elongation."""

    times: Array
    start: Index
    marks: Array


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
    if found and not adaptive and np.ceil(end / longest - EDGE) * longest > end * (1 + EDGE):
        # Functions of time are known up to the end of the run.
        times = np.append(times[times < end * (1 - RESOLUTION)], end)
    found = [marks(model.function(int(number))) if number >= 0 else np.zeros(0) for number in model.forces.table]
    start = np.cumsum([0, *(len(part) for part in found)], dtype=np.int64)
    return Halts(times, start, np.concatenate([np.zeros(0), *found]))


def narrow(breaks: Array, longest: float, adaptive: bool) -> Array:
    """Places at narrow pieces: for steps that see their error where widths change, for fixed ones PARTS to a piece."""
    widths = np.diff(breaks)
    least, most = np.minimum(widths[1:], widths[:-1]), np.maximum(widths[1:], widths[:-1])
    uneven = most > GRADED * least
    if not adaptive:
        near = np.convolve(np.pad(uneven, 2), np.ones(4), "valid") > 0  # a change of width at most two pieces away
        chosen = np.flatnonzero(widths < longest * np.where(near, PARTS, 1.0))
        inside = breaks[chosen, None] + widths[chosen, None] * np.linspace(0.0, 1.0, PARTS + 1)
        return np.unique(np.concatenate([inside[:, 1:].ravel(), breaks[chosen]]))
    return breaks[1:-1][(least < NARROW * longest) & uneven]


def marks(law: Piecewise) -> Array:
    """Places on the elongation between which a force law is smooth and of one width.

    Pieces that get narrower towards a kink and the force with them, as those of max(t, 0)**1.5, are no places to stop.
    """
    breaks, coefficients, kinks = law
    widths, sizes = np.diff(breaks), np.abs(coefficients).sum(axis=1)
    fading = np.zeros(len(breaks), dtype=bool)
    for kink in np.searchsorted(breaks, kinks):
        for step, first in ((1, kink), (-1, kink - 1)):
            k = first
            while 0 <= k + step < len(widths) and widths[k + step] >= widths[k] and sizes[k + step] >= sizes[k]:
                k += step
                fading[k if step > 0 else k + 1] = True
    chosen = narrow(breaks, np.inf, True)
    return np.union1d(kinks, chosen[~fading[np.searchsorted(breaks, chosen)]])


@njit(cache=True, error_model="numpy")
def leapt(tile: Tile, held: Forces, halts: Halts, before: Array, z: Array, memory: Array, room: Array) -> bool:
    """Whether a step went too far across a part of a force law; before: elongations at its beginning, (forces, lanes).

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
