"""Step control of the adaptive integrators: what is an error, how long is the next step, when is a lane given up.

The lanes of a tile march in lockstep, so the worst lane sets the step. A lane that is no number is left out; one
that would need a step below the resolution of the time becomes nan, so that it can neither stop nor mislead the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver

SAFETY = 0.9
SHRINK, GROW = 0.2, 6.0
RESOLUTION = 1e-14
"""Shortest step as a fraction of the instant at which the run ends."""


class Control(NamedTuple):
    """Tolerances, and what the control remembers.

    largest, suggestion: largest and next step [s], the latter (1,). Per lane: alive (0 or 1), weight_q and weight_v,
    one over the error that is allowed in coordinates and in rates, and the error of the last trial, in units of these.
    """

    relative_tolerance: float
    absolute_tolerance: float
    largest: float
    suggestion: Array
    alive: Array
    weight_q: Array
    weight_v: Array
    error: Array


def control_room(solver: Solver, tile: Tile) -> Control:
    """Step control for one tile; the solver's step is the first."""
    width = len(tile)
    largest = solver.max_step if solver.max_step is not None else np.inf
    first = np.full(1, min(solver.step, largest))
    lanes = (np.ones(width), np.zeros(width), np.zeros(width), np.zeros(width))
    return Control(solver.relative_tolerance, solver.absolute_tolerance, largest, first, *lanes)


@njit(cache=True, error_model="numpy")
def begin(tile: Tile, m: Arrays, w: Work, c: Control, t: float) -> bool:
    """Keep the state in w.before and see which lanes are numbers at the time t; false if none is."""
    width = len(tile)
    end = m.unknowns * width
    for i in range(end):
        w.before[i], w.before[end + i] = w.z[i], w.zdot[i]
    any_alive = False
    for lane in range(width):
        nothing = 0.0
        for i in range(lane, end, width):
            nothing += 0.0 * (w.z[i] + w.zdot[i] + w.a[i])
        c.alive[lane] = 1.0 if nothing == 0.0 else 0.0
        if nothing != 0.0 and w.gauss.ended[lane] < 0.0:
            w.gauss.ended[lane] = t
        any_alive = any_alive or c.alive[lane] > 0.0
    return any_alive


@njit(cache=True, error_model="numpy")
def first_trial(c: Control, rest: float) -> float:
    """Return the step to try [s]: the suggestion, or all of the rest if little more is left."""
    suggested: float = c.suggestion[0]
    return rest if suggested * 1.01 >= rest else suggested


@njit(cache=True, error_model="numpy")
def weigh(tile: Tile, m: Arrays, w: Work, c: Control) -> None:
    """Allowed errors between w.before and w.z, w.zdot; one number for all coordinates of a lane, one for all rates.

    An entry that passes through zero is thus measured by the size of its neighbours.
    """
    width = len(tile)
    end = m.unknowns * width
    for lane in range(width):
        q, v = 0.0, 0.0
        for i in range(lane, end, width):
            q = max(q, max(abs(w.before[i]), abs(w.z[i])))
            v = max(v, max(abs(w.before[end + i]), abs(w.zdot[i])))
        c.weight_q[lane] = 1.0 / (c.absolute_tolerance + c.relative_tolerance * q)
        c.weight_v[lane] = 1.0 / (c.absolute_tolerance + c.relative_tolerance * v)


@njit(cache=True, error_model="numpy")
def worst(tile: Tile, c: Control) -> float:
    """Largest error of a living lane; infinite if one has none that is a number."""
    largest = 0.0
    for lane in range(len(tile)):
        if c.alive[lane] > 0.0:
            if not np.isfinite(c.error[lane]):
                return np.inf
            largest = max(largest, c.error[lane])
    return largest


@njit(cache=True, error_model="numpy")
def shorter(error: float, h: float, order: int) -> float:
    """The next trial after a rejected step; order: that of the error in one step."""
    factor: float = SAFETY * error ** (-1.0 / order) if np.isfinite(error) else SHRINK
    return h * max(SHRINK, factor)


@njit(cache=True, error_model="numpy")
def accept(c: Control, error: float, h: float, order: int, rejected: bool) -> None:
    """Suggest the step after an accepted one. One that was cut short leaves what had been suggested."""
    growth = GROW if error == 0.0 else min(GROW, max(SHRINK, SAFETY * error ** (-1.0 / order)))
    least = c.suggestion[0] if not rejected and h < c.suggestion[0] else 0.0
    c.suggestion[0] = min(c.largest, max(least, h * (min(1.0, growth) if rejected else growth)))


@njit(cache=True, error_model="numpy")
def give_up(tile: Tile, m: Arrays, w: Work, c: Control, t: float) -> bool:
    """End the lanes whose error is not allowed at the instant t [s]: they become nan; false if no lane is left."""
    width = len(tile)
    end = m.unknowns * width
    left = False
    for lane in range(width):
        if c.alive[lane] > 0.0 and not c.error[lane] <= 1.0:
            c.alive[lane], w.gauss.ended[lane] = 0.0, t
            for i in range(lane, end, width):
                w.before[i], w.before[end + i], w.z[i], w.zdot[i] = np.nan, np.nan, np.nan, np.nan
        left = left or c.alive[lane] > 0.0
    return left
