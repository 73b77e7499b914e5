"""Applied loads: forces of fixed direction, and forces that turn with a body; constant or functions of time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import overload

from shoal.compile.pointers import shift
from shoal.mechanics.functions import Functions, evaluate
from shoal.mechanics.numerics.tile import Array, Index, Tile


class Applied(NamedTuple):
    """Applied loads of one tile; a function's number is -1 for the constant 1.

    fixed: coefficient * function(t) on one row each (a force [N] on a point's row, or the dual of another
    row); coefficient: (fixed, lanes). following: four rows each, those of the point and of the direction d that
    it turns with, and factor fx, fy [N], (2 * following, lanes): the force (fx + i fy) d/|d| * function(t). In space
    twelve rows, of the point and of the body's directors d, and three factors: the sum of f_k d_k. turning: in space,
    a torque n * function(t) [N m] on a body, as n x d/2 on each of its directors; turned: twelve rows each, those of n
    and of the directors. twisting: the same on a node of a director rod, as (n x r')/|r'|^2 on its slope r' and the
    rest along it on its director d; twisted: nine rows each, of n, r' and d. share: how much of
    the torques in space acts. dimensions: of vectors.
    """

    dimensions: int

    fixed: int
    row: Index
    coefficient: Array
    fixed_function: Index
    following: int
    rows: Index
    factor: Array
    following_function: Index
    turning: int
    turned: Index
    turning_function: Index
    twisting: int
    twisted: Index
    twisting_function: Index
    share: float = 1.0


@njit(cache=True, error_model="numpy")
def _strength(functions: Functions, number: int, t: float) -> float:
    return 1.0 if number < 0 else evaluate(functions, number, t, 0)


@njit(cache=True, error_model="numpy")
def add_force(
    tile: Tile, loads: Applied, functions: Functions, t: float, z: Array, zdot: Array, f: Array, power: Array
) -> None:
    """Add the loads to f (rows, lanes), and take the power [W] they supply from power (lanes,). Pointers."""
    for number in range(loads.fixed):
        _add_fixed(tile, loads, number, _strength(functions, loads.fixed_function[number], t), zdot, f, power)
    if loads.dimensions == 3:
        _add_spatial(tile, loads, functions, t, z, zdot, f, power)
        return
    for number in range(loads.following):
        strength = _strength(functions, loads.following_function[number], t)
        _add_following(tile, loads, number, strength, z, zdot, f, power)


@njit(cache=True, error_model="numpy")
def add_forces(tile: Tile, loads: Applied, register: Array, z: Array, zdot: Array, f: Array, power: Array) -> None:
    """Add the loads with strengths by lane, rows of `register` (registers, lanes), in place of functions. Pointers."""
    width = len(tile)
    for number in range(loads.fixed):
        _add_fixed(tile, loads, number, shift(register, loads.fixed_function[number] * width), zdot, f, power)
    for number in range(loads.following):
        strength = shift(register, loads.following_function[number] * width)
        if loads.dimensions == 3:
            _add_following_3(tile, loads, number, strength, z, zdot, f, power)
        else:
            _add_following(tile, loads, number, strength, z, zdot, f, power)
    for number in range(loads.turning):
        _add_turning(tile, loads, number, shift(register, loads.turning_function[number] * width), z, zdot, f, power)
    for number in range(loads.twisting):
        _add_twisting(tile, loads, number, shift(register, loads.twisting_function[number] * width), z, zdot, f, power)


def _of_lane(strength: Any, lane: int) -> float:
    """Return a strength in a lane: one number for all, or a pointer to those of the lanes."""
    raise NotImplementedError(type(strength).__name__)


@overload(_of_lane, jit_options={"forceinline": True, "error_model": "numpy"})
def _strength_of_lane(strength, lane):  # type: ignore[no-untyped-def]
    if isinstance(strength, types.Float):
        return lambda strength, lane: strength
    return lambda strength, lane: strength[lane]


# The arguments of what follows are those of `add_force`; strength: as `_of_lane` takes it.


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_fixed(tile, loads, number, strength, zdot, f, power):  # type: ignore[no-untyped-def]
    width = len(tile)
    row = loads.row[number] * width
    for lane in range(width):
        load = loads.coefficient[number * width + lane] * _of_lane(strength, lane)
        f[row + lane] += load
        power[lane] -= load * zdot[row + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_following(tile, loads, number, strength, z, zdot, f, power):  # type: ignore[no-untyped-def]
    width = len(tile)
    px, py = loads.rows[4 * number] * width, loads.rows[4 * number + 1] * width
    dx, dy = loads.rows[4 * number + 2] * width, loads.rows[4 * number + 3] * width
    for lane in range(width):
        x, y = z[dx + lane], z[dy + lane]
        scale = _of_lane(strength, lane) / np.sqrt(x * x + y * y)
        fx = loads.factor[2 * number * width + lane] * scale
        fy = loads.factor[(2 * number + 1) * width + lane] * scale
        f[px + lane] += fx * x - fy * y
        f[py + lane] += fx * y + fy * x
        power[lane] -= (fx * x - fy * y) * zdot[px + lane] + (fx * y + fy * x) * zdot[py + lane]


@njit(cache=True, error_model="numpy")
def _add_spatial(
    tile: Tile, loads: Applied, functions: Functions, t: float, z: Array, zdot: Array, f: Array, power: Array
) -> None:
    """Forces and torques that turn with bodies in space."""
    for number in range(loads.following):
        strength = _strength(functions, loads.following_function[number], t)
        _add_following_3(tile, loads, number, strength, z, zdot, f, power)
    for number in range(loads.turning):
        _add_turning(tile, loads, number, _strength(functions, loads.turning_function[number], t), z, zdot, f, power)
    for number in range(loads.twisting):
        _add_twisting(tile, loads, number, _strength(functions, loads.twisting_function[number], t), z, zdot, f, power)


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_following_3(tile, loads, number, strength, z, zdot, f, power):  # type: ignore[no-untyped-def]
    width = len(tile)
    for k in range(3):
        row = loads.rows[12 * number + k] * width
        for j in range(3):
            director = loads.rows[12 * number + 3 + 3 * j + k] * width
            for lane in range(width):
                load = _of_lane(strength, lane) * loads.factor[(3 * number + j) * width + lane] * z[director + lane]
                f[row + lane] += load
                power[lane] -= load * zdot[row + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_turning(tile, loads, number, strength, z, zdot, f, power):  # type: ignore[no-untyped-def]
    width, half = len(tile), 0.5 * loads.share
    for j in range(3):
        for k in range(3):
            row = loads.turned[12 * number + 3 + 3 * j + k] * width
            one, other = (k + 1) % 3, (k + 2) % 3
            n1, n2 = loads.turned[12 * number + one] * width, loads.turned[12 * number + other] * width
            d1 = loads.turned[12 * number + 3 + 3 * j + one] * width
            d2 = loads.turned[12 * number + 3 + 3 * j + other] * width
            for lane in range(width):
                across = z[n1 + lane] * z[d2 + lane] - z[n2 + lane] * z[d1 + lane]
                load = half * _of_lane(strength, lane) * across
                f[row + lane] += load
                power[lane] -= load * zdot[row + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_twisting(tile, loads, number, strength, z, zdot, f, power):  # type: ignore[no-untyped-def]
    width, first = len(tile), 9 * number
    for lane in range(width):
        size = loads.share * _of_lane(strength, lane)
        square, along = 0.0, 0.0
        for k in range(3):
            slope = z[loads.twisted[first + 3 + k] * width + lane]
            square += slope * slope
            along += slope * z[loads.twisted[first + k] * width + lane]
        for k in range(3):
            one, other = first + (k + 1) % 3, first + (k + 2) % 3
            n1, n2 = z[loads.twisted[one] * width + lane], z[loads.twisted[other] * width + lane]
            s1, s2 = z[loads.twisted[one + 3] * width + lane], z[loads.twisted[other + 3] * width + lane]
            d1, d2 = z[loads.twisted[one + 6] * width + lane], z[loads.twisted[other + 6] * width + lane]
            row, load = loads.twisted[first + 3 + k] * width, size * (n1 * s2 - n2 * s1) / square
            f[row + lane] += load
            power[lane] -= load * zdot[row + lane]
            row, load = loads.twisted[first + 6 + k] * width, size * along * (s1 * d2 - s2 * d1) / square
            f[row + lane] += load
            power[lane] -= load * zdot[row + lane]
