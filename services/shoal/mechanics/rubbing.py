"""Dry friction in proportion to the force of its joint, F = mu |N| tanh(g'/v_s) along a slip g; see `forces`.

The force of the joint is that of its constraints' multipliers, which depend on the friction in turn. So the
acceleration by Gauss's principle is found again with the friction of the last one until the forces stay what they are,
beginning with those of the instant before. Where they do not, as friction that jams may have no solution or several
(Painleve 1895), there is no acceleration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.vector import add_product, clear, copy
from shoal.mechanics import forces
from shoal.mechanics.derived import Derived, fold
from shoal.mechanics.forces import LAW, SPEED, Forces
from shoal.mechanics.numerics.tile import Array, Index, Tile

ROUNDS = 200
"""At most so many accelerations."""
SETTLED = 1e-13
"""Change of the joints' forces, over the largest, that ends the search."""
LOST = 1e-9
"""Change after the last round beyond which there is no acceleration."""


class Rubbing(NamedTuple):
    """Joints whose friction depends on their force.

    force: number of the friction's element among the forces. first, parts: the joint's constraints, whose multipliers
    make up its force. share: coefficient of friction, of a pin times its radius [1 or m], (size, lanes).
    """

    size: int
    force: Index
    first: Index
    parts: Index
    share: Array


def room(width: int, rows: int, size: int) -> Array:
    """Work space: the other forces and the friction of a unit force of each joint (rows, lanes), then three numbers of
    each joint (size, lanes): its force, that of the last round, and its power a unit force.
    """
    return np.zeros((rows * (size + 1) + 3 * size) * width if size else 0)


@njit(cache=True, error_model="numpy")
def prepare(
    tile: Tile,
    r: Rubbing,
    f: Forces,
    d: Derived,
    rows: int,
    force_rows: int,
    z: Array,
    zdot: Array,
    memory: Array,
    w: Array,
    a: Array,
    out: Array,
) -> None:
    """Keep the other forces Q in `a`, and find the friction of a unit force of each joint. w: room for one element."""
    width, end = len(tile), (r.size + 1) * rows
    for row in range(d.first):
        copy(tile, out, row, a, row)
    side, value = forces.side(f), forces.value_row(f)
    for k in range(r.size):
        number, unit = r.force[k], shift(out, (k + 1) * rows * width)
        for row in range(force_rows):
            clear(tile, unit, row)
        forces.measure(tile, f, number, z, memory, w)
        forces.slip(tile, f, number, zdot, w)
        for lane in range(width):
            speed = f.law[(LAW * number + SPEED) * width + lane]
            slip = w[(value + 1) * width + lane]
            level = np.tanh(slip / speed)
            w[(value + 2) * width + lane] = -level
            out[(end + 2 * r.size + k) * width + lane] = level * slip
        for row in range(side):
            add_product(tile, unit, f.rows[side * number + row], w, value + 2, w, side + row)
        fold(tile, d, unit, force_rows)


@njit(cache=True, error_model="numpy", forceinline=True)
def _held(tile: Tile, r: Rubbing, k: int, lane: int, multiplier: Array) -> float:
    """The force of a joint in a lane, by its multipliers."""
    square = 0.0
    for c in range(r.first[k], r.first[k] + r.parts[k]):
        square += multiplier[c * len(tile) + lane] * multiplier[c * len(tile) + lane]
    return np.sqrt(square)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def load(tile: Tile, r: Rubbing, unknowns: int, rows: int, multiplier: Array, out: Array, a: Array) -> None:
    """All forces into `a`, with the friction by the joints' forces as the multipliers say them."""
    width, end = len(tile), (r.size + 1) * rows
    for row in range(unknowns):
        copy(tile, a, row, out, row)
    for k in range(r.size):
        for lane in range(width):
            held = _held(tile, r, k, lane, multiplier)
            if not np.isfinite(held):
                held = 0.0
            out[(end + k) * width + lane] = held
            out[(end + r.size + k) * width + lane] = held * r.share[k * width + lane]
        for row in range(unknowns):
            add_product(tile, a, row, out, end + r.size + k, out, (k + 1) * rows + row)


@njit(cache=True, error_model="numpy")
def _change(tile: Tile, r: Rubbing, lane: int, rows: int, multiplier: Array, out: Array) -> float:
    """Return the relative change of the joints' forces in a lane since the friction was computed."""
    end = (r.size + 1) * rows
    most, largest = 0.0, 0.0
    for k in range(r.size):
        held = _held(tile, r, k, lane, multiplier)
        most = max(most, abs(held - out[(end + k) * len(tile) + lane]))
        largest = max(largest, held)
    return most / largest if largest > 0.0 else most


@njit(cache=True, error_model="numpy")
def away(tile: Tile, r: Rubbing, rows: int, multiplier: Array, out: Array) -> float:
    """The largest `_change` of all lanes."""
    most = 0.0
    for lane in range(len(tile)):
        most = max(most, _change(tile, r, lane, rows, multiplier, out))
    return most


@njit(cache=True, error_model="numpy")
def finish(tile: Tile, r: Rubbing, rows: int, multiplier: Array, out: Array, a: Array, power: Array) -> None:
    """No acceleration where the forces did not settle; what the friction takes up [W] is added to power (lanes,)."""
    width, end = len(tile), (r.size + 1) * rows
    for lane in range(width):
        if not _change(tile, r, lane, rows, multiplier, out) <= LOST:
            a[lane] = np.nan
        for k in range(r.size):
            power[lane] += out[(end + r.size + k) * width + lane] * out[(end + 2 * r.size + k) * width + lane]
