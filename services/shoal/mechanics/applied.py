"""Applied loads: forces of fixed direction, and forces that turn with a body; constant or functions of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics.functions import Functions, evaluate
from shoal.mechanics.numerics.tile import Array, Index, Tile


class Applied(NamedTuple):
    """Applied loads of one tile; a function's number is -1 for the constant 1.

    fixed: coefficient * function(t) on one row each (a force [N] on a point's row, or whatever is dual to the
    row); coefficient: (fixed, lanes). following: four rows each, those of the point and of the direction d that
    it turns with, and factor fx, fy [N], (2 * following, lanes): the force (fx + i fy) d/|d| * function(t).
    """

    fixed: int
    row: Index
    coefficient: Array
    fixed_function: Index
    following: int
    rows: Index
    factor: Array
    following_function: Index


@njit(cache=True, error_model="numpy")
def _strength(functions: Functions, number: int, t: float) -> float:
    return 1.0 if number < 0 else evaluate(functions, number, t, 0)


@njit(cache=True, error_model="numpy")
def add_force(
    tile: Tile, loads: Applied, functions: Functions, t: float, z: Array, zdot: Array, f: Array, power: Array
) -> None:
    """Add the loads to f (rows, lanes), and take the power [W] they supply from power (lanes,). Pointers."""
    width = len(tile)
    for number in range(loads.fixed):
        row = loads.row[number] * width
        strength = _strength(functions, loads.fixed_function[number], t)
        for lane in range(width):
            load = loads.coefficient[number * width + lane] * strength
            f[row + lane] += load
            power[lane] -= load * zdot[row + lane]
    for number in range(loads.following):
        px, py = loads.rows[4 * number] * width, loads.rows[4 * number + 1] * width
        dx, dy = loads.rows[4 * number + 2] * width, loads.rows[4 * number + 3] * width
        strength = _strength(functions, loads.following_function[number], t)
        for lane in range(width):
            x, y = z[dx + lane], z[dy + lane]
            scale = strength / np.sqrt(x * x + y * y)
            fx = loads.factor[2 * number * width + lane] * scale
            fy = loads.factor[(2 * number + 1) * width + lane] * scale
            f[px + lane] += fx * x - fy * y
            f[py + lane] += fx * y + fy * x
            power[lane] -= (fx * x - fy * y) * zdot[px + lane] + (fx * y + fy * x) * zdot[py + lane]
