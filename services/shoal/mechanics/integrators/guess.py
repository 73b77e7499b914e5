"""Predictor of implicit steps: that of the method, or extrapolation by backward differences, whichever erred less.

A method's own predictor overestimates fast vibrations of stiff parts, as h^2 times their acceleration is large. A
polynomial of degree k through the coordinates q of the last steps extrapolates to q + D q + ... + D^k q with backward
differences D, and its error is D^(k+1) q (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I,
section III.1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import add_scaled, assign
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile

DEGREE = 3
STEP, BEST, SEEN = range(3)
"""Memory: the length of the last step [s], the degree with the least error (0: the method's predictor), and the number
of steps of that length in a row."""


class Guess(NamedTuple):
    """Work space. memory: see above. last: q, D q, ..., D^3 q, (4 * unknowns, lanes); own: the method's prediction."""

    memory: Array
    last: Array
    own: Array


def guess_room(model: Model, tile: Tile) -> Guess:
    """Return the work space of one tile of lanes."""
    end = model.unknowns * len(tile)
    return Guess(np.zeros(3), np.zeros((DEGREE + 1) * end), np.zeros(end))


@njit(cache=True, error_model="numpy")
def start(tile: Tile, m: Arrays, g: Guess, z: Array, h: float) -> None:
    """Begin a step of h [s] at z: forget the differences unless the last steps had that length and ended at z."""
    end = m.unknowns * len(tile)
    known = g.memory[STEP] == h
    for i in range(end):
        known = known and (g.last[i] == z[i] or z[i] != z[i])
    if not known:
        g.memory[STEP], g.memory[BEST], g.memory[SEEN] = h, 0.0, 0.0
        assign(g.last, z, end)


@njit(cache=True, error_model="numpy")
def improve(tile: Tile, m: Arrays, g: Guess, z: Array, change: Array) -> None:
    """Replace the method's prediction z by that of least error before; change: the difference of the two."""
    end = m.unknowns * len(tile)
    assign(g.own, z, end)
    if g.memory[BEST] > 0.0:
        assign(z, g.last, end)
        for k in range(1, int(g.memory[BEST]) + 1):
            add_scaled(z, 1.0, shift(g.last, k * end), end)
    assign(change, z, end)
    add_scaled(change, -1.0, g.own, end)


@njit(cache=True, error_model="numpy")
def learn(tile: Tile, m: Arrays, g: Guess, z: Array) -> None:
    """Update the differences by the end z of a step, and choose the degree with the least error there."""
    end = m.unknowns * len(tile)
    nearest, best = 0.0, 0
    for i in range(end):
        away = abs(z[i] - g.own[i])
        nearest = away if away > nearest else nearest
    g.memory[SEEN] = min(g.memory[SEEN] + 1.0, DEGREE + 1.0)
    for k in range(DEGREE + 1):
        # The new difference of this degree, and how far it is from the last one of the same: the next degree's.
        farthest, row = 0.0, k * end
        for i in range(end):
            new = z[i] if k == 0 else g.own[i]
            g.own[i] = new - g.last[row + i]
            g.last[row + i] = new
            away = abs(g.own[i])
            farthest = away if away > farthest else farthest
        if 0 < k < g.memory[SEEN] and farthest < nearest:
            nearest, best = farthest, k
    g.memory[BEST] = best
