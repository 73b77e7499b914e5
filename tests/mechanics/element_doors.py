"""Doors into the kernels of the elements, and derivatives to compare what they give with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from shoal.compile.function_pointers import call
from shoal.compile.pointers import pointer
from shoal.mechanics import kernels
from shoal.mechanics.elements.families import lay


def force(tile, family, z, zdot, f, w, power):
    _force(_kernel("force", tile, family), tile, lay((family,)), z, zdot, f, w, power)


def energy(tile, family, z, w, out):
    _rows(_kernel("energy", tile, family), tile, lay((family,)), z, w, out)


def tangent(tile, family, z, w, out):
    matrix(tile, family, False, z, w, out)


def matrix(tile, family, viscous, z, w, out):
    _matrix(_kernel("stiffness", tile, family), tile, lay((family,)), viscous, z, w, out)


def _kernel(name, tile, family):
    """The address of a kernel that machines of such elements call."""
    return kernels._address(name, tile, family)


@njit(cache=True)
def _force(address, tile, family, z, zdot, f, w, power):
    call(address, (tile, pointer(family), pointer(z), pointer(zdot), pointer(f), pointer(w), pointer(power), True))


@njit(cache=True)
def _rows(address, tile, family, z, w, out):
    call(address, (tile, pointer(family), pointer(z), pointer(w), pointer(out), 0))


@njit(cache=True)
def _matrix(address, tile, family, viscous, z, w, out):
    call(address, (tile, pointer(family), pointer(z), pointer(w), pointer(out), 0, viscous))


def differences(function: Any, z: Any, h: float) -> Any:
    """Derivatives by central differences of order four, exact for quartics; last axis: the coordinate."""
    columns = []
    for unit in h * np.eye(z.size):
        near, far = function(z + unit) - function(z - unit), function(z + 2 * unit) - function(z - 2 * unit)
        columns.append((8 * near - far) / (12 * h))
    return np.array(columns).T
