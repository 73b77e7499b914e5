"""Doors into the kernels of the elements, and derivatives to compare what they give with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from shoal.compile.pointers import pointer, raw
from shoal.mechanics.elements import families


@njit(cache=True)
def force(tile, family, z, zdot, f, w, power):
    families.add_force(tile, raw(family), pointer(z), pointer(zdot), pointer(f), pointer(w), pointer(power), True)


@njit(cache=True)
def energy(tile, family, z, w, out):
    families.add_energy(tile, raw(family), pointer(z), pointer(w), pointer(out), 0)


@njit(cache=True)
def tangent(tile, family, z, w, out):
    families.tangent(tile, raw(family), pointer(z), pointer(w), pointer(out), 0)


@njit(cache=True)
def matrix(tile, family, viscous, z, w, out):
    if viscous:
        families.damping(tile, raw(family), pointer(z), pointer(w), pointer(out), 0)
    else:
        families.tangent(tile, raw(family), pointer(z), pointer(w), pointer(out), 0)


def differences(function: Any, z: Any, h: float) -> Any:
    """Derivatives by central differences of order four, exact for quartics; last axis: the coordinate."""
    columns = []
    for unit in h * np.eye(z.size):
        near, far = function(z + unit) - function(z - unit), function(z + 2 * unit) - function(z - 2 * unit)
        columns.append((8 * near - far) / (12 * h))
    return np.array(columns).T
