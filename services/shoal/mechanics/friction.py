"""Viscous friction of a revolute joint: torque -c (omega_2 - omega_1) on the second body.

The rate of a direction d (not necessarily of unit length, as a cable's slope) is (d x d')/|d|^2.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from shoal.mechanics.tile import Array, Index, Tile
from shoal.mechanics.vector import add_product, pointer


class Frictions(NamedTuple):
    """rows: four a joint, those of both directions; coefficient c [N m s/rad]: (joints, lanes)."""

    size: int
    rows: Index
    coefficient: Array


@njit(cache=True, error_model="numpy")
def raw(frictions: Frictions) -> Frictions:
    """The same joints with pointers in place of arrays."""
    return Frictions(frictions.size, pointer(frictions.rows), pointer(frictions.coefficient))


@njit(cache=True, error_model="numpy")
def levers(tile: Tile, frictions: Frictions, joint: int, z: Array, out: Array) -> None:
    """d(omega_2 - omega_1)/d(zdot) on the joint's four rows; out: (4, lanes)."""
    width = len(tile)
    for side in range(2):
        sign = -1.0 if side == 0 else 1.0
        x = frictions.rows[4 * joint + 2 * side] * width
        y = frictions.rows[4 * joint + 2 * side + 1] * width
        for lane in range(width):
            square = z[x + lane] * z[x + lane] + z[y + lane] * z[y + lane]
            out[2 * side * width + lane] = -sign * z[y + lane] / square
            out[(2 * side + 1) * width + lane] = sign * z[x + lane] / square


@njit(cache=True, error_model="numpy")
def add_force(tile: Tile, frictions: Frictions, z: Array, zdot: Array, f: Array, w: Array, power: Array) -> None:
    """Add the friction torques to f (rows, lanes) and set the dissipated power [W] (lanes,).

    w is work space of 5 rows: the levers and the relative rate. Pointers.
    """
    width = len(tile)
    for lane in range(width):
        power[lane] = 0.0
    for joint in range(frictions.size):
        levers(tile, frictions, joint, z, w)
        for lane in range(width):
            w[4 * width + lane] = 0.0
        for k in range(4):
            add_product(tile, w, 4, w, k, zdot, frictions.rows[4 * joint + k])
        for k in range(4):
            row = frictions.rows[4 * joint + k] * width
            for lane in range(width):
                f[row + lane] -= frictions.coefficient[joint * width + lane] * w[4 * width + lane] * w[k * width + lane]
        for lane in range(width):
            power[lane] += frictions.coefficient[joint * width + lane] * w[4 * width + lane] ** 2
