"""Predictor of implicit steps: that of the method, or extrapolation of the last steps, whichever was nearer before.

A method's own guess takes fast vibrations of stiff parts for motion, as h^2 times their acceleration is far. The
coordinates of the last steps q, with their backward differences D q, know them as small as they are: a polynomial of
degree k through the last ones leads to q + D q + ... + D^k q and misses the next one by D^(k+1) q.
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
"""What is remembered: the length of the last step [s], the degree that was best (0: the method's guess), and how many
steps of that length led here."""


class Guess(NamedTuple):
    """Room. memory: see above. last: q, D q, ..., D^3 q, (4 * unknowns, lanes); own: the method's guess of the end."""

    memory: Array
    last: Array
    own: Array


def guess_room(model: Model, tile: Tile) -> Guess:
    """Room for one tile of lanes."""
    end = model.unknowns * len(tile)
    return Guess(np.zeros(3), np.zeros((DEGREE + 1) * end), np.zeros(end))


@njit(cache=True, error_model="numpy")
def start(tile: Tile, m: Arrays, g: Guess, z: Array, h: float) -> None:
    """At the beginning of a step of h [s] at z: whether what is remembered led there, in steps of that length."""
    end = m.unknowns * len(tile)
    known = g.memory[STEP] == h
    for i in range(end):
        known = known and (g.last[i] == z[i] or z[i] != z[i])
    if not known:
        g.memory[STEP], g.memory[BEST], g.memory[SEEN] = h, 0.0, 0.0
        assign(g.last, z, end)


@njit(cache=True, error_model="numpy")
def improve(tile: Tile, m: Arrays, g: Guess, z: Array, change: Array) -> None:
    """Replace the method's guess z by the better one; change: by how much."""
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
    """The step ended at z; which guess was nearest?"""
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
