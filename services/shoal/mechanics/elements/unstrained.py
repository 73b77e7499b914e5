"""The unstrained shape of a rod in space: its axis and its sections, from curvatures and twist over the arc length."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg

from shoal.mechanics.numerics.tile import Array, Number
from shoal.scene import Rod

STEPS = 200
"""Along a rod whose curvatures change; the error of fourth order is below 1e-10 of its length, for a turn or so."""


def unstrained(rod: Rod, s: Number) -> tuple[Array, Array]:
    """Place [m] (3, lanes) at the arc length s [m] in the rod's own frame, and the axes of the section as columns.

    The frame (place, axes) obeys g' = g W(s) with the screw W of (twist, -side_curvature, curvature) and of a unit
    speed along x; by Magnus' expansion with two points of Gauss a step, which is exact where W is constant.
    Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.7.
    """
    polynomials = rod.twist, tuple(-1.0 * np.asarray(k) for k in rod.side_curvature), rod.curvature
    lanes = np.broadcast_shapes((1,), np.shape(s), *(np.shape(k) for one in polynomials for k in one))
    steps = 1 if all(len(one) <= 1 for one in polynomials) else STEPS
    length = np.broadcast_to(np.asarray(s, dtype=float), lanes) / steps
    middle = (np.arange(steps)[:, None] + 0.5) * length
    apart = length * np.sqrt(3.0) / 6.0
    first, second = _screw(polynomials, middle - apart), _screw(polynomials, middle + apart)
    h = length[..., None, None]
    change = 0.5 * h * (first + second) + np.sqrt(3.0) / 12.0 * h**2 * (first @ second - second @ first)
    total = np.broadcast_to(np.eye(4), (*lanes, 4, 4))
    for move in scipy.linalg.expm(change):
        total = total @ move
    return total[:, :3, 3].T.copy(), total[:, :3, :3].transpose(1, 2, 0).copy()


def _screw(polynomials: tuple[Any, ...], s: Array) -> Array:
    """W at arc lengths (steps, lanes), (steps, lanes, 4, 4)."""
    x, y, z = (sum((k * s**power for power, k in enumerate(one)), 0.0 * s) for one in polynomials)
    found = np.zeros((*s.shape, 4, 4))
    found[..., 0, 1], found[..., 1, 0] = -z, z
    found[..., 0, 2], found[..., 2, 0] = y, -y
    found[..., 1, 2], found[..., 2, 1] = -x, x
    found[..., 0, 3] = 1.0
    return found
