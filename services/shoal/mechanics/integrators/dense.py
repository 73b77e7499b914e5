"""The motion inside a step from the states at its ends, by Hermite interpolation (Hairer, Norsett, Wanner, II.6)."""

from __future__ import annotations

from typing import Any

from numba import njit

from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile


@njit(cache=True, error_model="numpy")
def quintic(tile: Tile, scheme: Any, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array) -> None:
    """From coordinates, rates and accelerations at both ends: locally of order 6. See `scheme.interpolate`."""
    end = m.unknowns * len(tile)
    y = 1.0 - x
    # Left and right weights of the coordinates, the rates (times h) and the accelerations (times h^2).
    l0, l1, l2 = y * y * y * (1 + 3 * x + 6 * x * x), h * x * y * y * y * (1 + 3 * x), 0.5 * h * h * x * x * y * y * y
    r0, r1, r2 = x * x * x * (1 + 3 * y + 6 * y * y), -h * y * x * x * x * (1 + 3 * y), 0.5 * h * h * y * y * x * x * x
    # Their derivatives by time.
    d0 = 30.0 * x * x * y * y / h
    dl1, dl2 = y * y * (1 + 2 * x - 15 * x * x), 0.5 * h * x * y * y * (2 - 5 * x)
    dr1, dr2 = x * x * (1 + 2 * y - 15 * y * y), -0.5 * h * y * x * x * (2 - 5 * y)
    for i in range(end):
        q0, v0, a0 = past[i], past[end + i], past[2 * end + i]
        q[i] = l0 * q0 + l1 * v0 + l2 * a0 + r0 * w.z[i] + r1 * w.zdot[i] + r2 * w.a[i]
        v[i] = d0 * (w.z[i] - q0) + dl1 * v0 + dl2 * a0 + dr1 * w.zdot[i] + dr2 * w.a[i]


@njit(cache=True, error_model="numpy")
def cubic(tile: Tile, scheme: Any, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array) -> None:
    """From coordinates and rates at both ends: locally of order 4. See `scheme.interpolate`.

    For implicit methods, whose steps need not resolve the fast vibrations that dominate accelerations.
    """
    end = m.unknowns * len(tile)
    y = 1.0 - x
    l0, l1, r0, r1 = (1 + 2 * x) * y * y, h * x * y * y, (1 + 2 * y) * x * x, -h * y * x * x
    d0, dl1, dr1 = 6.0 * x * y / h, y * (1 - 3 * x), x * (1 - 3 * y)
    for i in range(end):
        q[i] = l0 * past[i] + l1 * past[end + i] + r0 * w.z[i] + r1 * w.zdot[i]
        v[i] = d0 * (w.z[i] - past[i]) + dl1 * past[end + i] + dr1 * w.zdot[i]
