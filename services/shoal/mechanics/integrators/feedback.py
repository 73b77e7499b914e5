"""Feedback by signals in implicit steps: a tangent less a few unsymmetric products, by Woodbury's formula.

(H - sum of b_k g_k')^-1 = H^-1 + X (1 - G'X)^-1 G' H^-1 with X = H^-1 B (Golub and Van Loan, Matrix Computations,
2013, section 2.1.4): H stays symmetric and is factored as without signals; every strength that loads follow costs one
more solution for each new factor, and a product for each iteration. b_k, g_k: force of a strength and its derivatives.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.vector import add_product, clear
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.signals import Signals, block


class Feedback(NamedTuple):
    """Room of the formula for one matrix, or for several one after the other.

    address: of an integrator's kernel, 0 of machines without signals. column: X, (strengths * length, lanes); inverse:
    (1 - G'X)^-1, (strengths^2, lanes); part: room of strengths^2 + 2 strengths rows.
    """

    address: int
    column: Array
    inverse: Array
    part: Array


def feedback_room(model: Model, tile: Tile, length: int, matrices: int = 1) -> Feedback:
    """Return room for matrices of a size."""
    count = model.signals.strengths if model.signals else 0
    sizes = matrices * count * length, matrices * count * count, count * count + 2 * count
    return Feedback(0, *(np.zeros(size * len(tile)) for size in sizes))


@njit(cache=True, error_model="numpy")
def project(
    tile: Tile, s: Signals, m: Any, w: Any, place_factor: float, rate_factor: float, x: Array, out: Array
) -> None:
    """Set row k of out to g_k'x, g_k = place_factor dS/dq + rate_factor dS/dv; x: rows of the unknowns."""
    width, end = len(tile), m.force_rows * len(tile)
    for k in range(s.strengths):
        clear(tile, out, k)
        by_place = shift(block(tile, s, m, w, k), end)
        by_rate = shift(by_place, end)
        for i in range(m.unknowns * width):
            slope = place_factor * by_place[i] + rate_factor * by_rate[i]
            out[k * width + i % width] += slope * x[i]


@njit(cache=True, error_model="numpy")
def close(tile: Tile, size: int, inverse: Array, part: Array) -> None:
    """Replace G'X, whose column j is in the rows from j * size on, by (1 - G'X)^-1; part: room of size^2 rows.

    Gauss-Jordan elimination with pivots in each lane. A closed loop without a solution leaves no numbers.
    """
    width = len(tile)
    for lane in range(width):
        for i in range(size):
            for j in range(size):
                one = 1.0 if i == j else 0.0
                part[(i * size + j) * width + lane] = one - inverse[(j * size + i) * width + lane]
        for i in range(size):
            for j in range(size):
                inverse[(i * size + j) * width + lane] = 1.0 if i == j else 0.0
        for k in range(size):
            pivot = k
            for i in range(k + 1, size):
                if abs(part[(i * size + k) * width + lane]) > abs(part[(pivot * size + k) * width + lane]):
                    pivot = i
            for j in range(size):
                a, b = (k * size + j) * width + lane, (pivot * size + j) * width + lane
                part[a], part[b] = part[b], part[a]
                inverse[a], inverse[b] = inverse[b], inverse[a]
            scale = 1.0 / part[(k * size + k) * width + lane]
            for j in range(size):
                part[(k * size + j) * width + lane] *= scale
                inverse[(k * size + j) * width + lane] *= scale
            for i in range(size):
                factor = part[(i * size + k) * width + lane]
                for j in range(size if i != k else 0):
                    part[(i * size + j) * width + lane] -= factor * part[(k * size + j) * width + lane]
                    inverse[(i * size + j) * width + lane] -= factor * inverse[(k * size + j) * width + lane]


@njit(cache=True, error_model="numpy")
def add(tile: Tile, size: int, inverse: Array, column: Array, length: int, part: Array, x: Array) -> None:
    """Add X (1 - G'X)^-1 p to x, of so many rows, with p in the first rows of part; uses its next `size` rows."""
    width = len(tile)
    for k in range(size):
        clear(tile, part, size + k)
        for j in range(size):
            for lane in range(width):
                part[(size + k) * width + lane] += inverse[(k * size + j) * width + lane] * part[j * width + lane]
        for i in range(length):
            add_product(tile, x, i, part, size + k, column, k * length + i)
