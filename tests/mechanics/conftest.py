"""Doors into single kernels, and independent equations of motion to compare with."""

from __future__ import annotations

import types
from typing import Any

import pytest
from numba import njit
from shoal.compile.function_pointers import call
from shoal.compile.pointers import pointer, raw
from shoal.mechanics import constraints
from shoal.mechanics.analysis import evaluations
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


def acceleration(tile, arrays, room, tolerance):
    """The acceleration of the state in `room`, into room.a."""
    evaluations.enter(arrays, room)
    evaluations.accelerate(tile, arrays, room, 0.0, tolerance)


def force(tile, arrays, room):
    """The generalised force of the state in `room`, into room.a."""
    evaluations.enter(arrays, room)
    evaluations.look(tile, arrays, room, 0.0)


def project(tile, arrays, room, tolerance):
    """Make the state in `room` consistent."""
    evaluations.enter(arrays, room)
    _settle(arrays.table.settle, tile, arrays.storage, room.storage, tolerance)


@njit(cache=True)
def _settle(address, tile, arrays, room, tolerance):
    call(address, (tile, pointer(arrays), pointer(room), 0.0, tolerance, 3, False))


@pytest.fixture(scope="session")
def kernels() -> types.SimpleNamespace:
    """Single kernels, callable on plain arrays."""
    names = (
        solve, multiply,
        residual, jacobian, bias, acceleration, force, project,
    )  # fmt: skip
    return types.SimpleNamespace(**{kernel.__name__: kernel for kernel in names})
