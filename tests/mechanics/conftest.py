"""Doors into single kernels, and independent equations of motion to compare with."""

from __future__ import annotations

import types
from typing import Any

import pytest
from numba import njit
from shoal.compile.pointers import pointer, raw
from shoal.mechanics import constraints
from shoal.mechanics import kernels as compiled
from shoal.mechanics.least import drift
from shoal.mechanics.numerics import sparse

Array = Any


@njit(cache=True)
def solve(tile, pattern, values, x):
    sparse.factor(tile, raw(pattern), pointer(values))
    sparse.solve(tile, raw(pattern), pointer(values), pointer(x), 0)


@njit(cache=True)
def multiply(tile, pattern, values, x, y):
    sparse.multiply(tile, raw(pattern), pointer(values), pointer(x), pointer(y))


@njit(cache=True)
def residual(tile, held, drives, t, q, out):
    constraints.residual(tile, raw(held), raw(drives), t, pointer(q), pointer(out))


@njit(cache=True)
def jacobian(tile, held, q, linear, out):
    constraints.jacobian(tile, raw(held), pointer(q), linear, pointer(out))


@njit(cache=True)
def bias(tile, held, drives, t, v, out):
    constraints.bias(tile, raw(held), raw(drives), t, pointer(v), pointer(out))


@njit(cache=True)
def acceleration(tile, arrays, room, tolerance):
    """The acceleration of the state in `room`, into room.a."""
    m, w = raw(arrays), raw(room)
    compiled.enter(m, w)
    compiled.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)


@njit(cache=True)
def force(tile, arrays, room):
    """The generalised force of the state in `room`, into room.a."""
    m, w = raw(arrays), raw(room)
    compiled.enter(m, w)
    compiled.force(tile, m, w, 0.0, w.z, w.zdot, w.a)


@njit(cache=True)
def project(tile, arrays, room, tolerance):
    """Make the state in `room` consistent."""
    w = raw(room)
    drift.project(tile, raw(arrays), w.gauss, 0.0, w.z, w.zdot, tolerance, 3, False)


@pytest.fixture(scope="session")
def kernels() -> types.SimpleNamespace:
    """Single kernels, callable on plain arrays."""
    names = (
        solve, multiply,
        residual, jacobian, bias, acceleration, force, project,
    )  # fmt: skip
    return types.SimpleNamespace(**{kernel.__name__: kernel for kernel in names})
