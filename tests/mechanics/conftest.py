"""Doors into single kernels, and independent equations of motion to compare with."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from shoal.mechanics import gates
from shoal.mechanics.least import constraints, drift
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.pointers import pointer, raw

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
    gates.enter(m, w)
    gates.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)


@njit(cache=True)
def force(tile, arrays, room):
    """The generalised force of the state in `room`, into room.a."""
    m, w = raw(arrays), raw(room)
    gates.enter(m, w)
    gates.force(tile, m, w, 0.0, w.z, w.zdot, w.a)


@njit(cache=True)
def project(tile, arrays, room, tolerance):
    """Make the state in `room` consistent."""
    w = raw(room)
    drift.project(tile, raw(arrays), w.gauss, 0.0, w.z, w.zdot, tolerance, 3)


@pytest.fixture(scope="session")
def kernels() -> types.SimpleNamespace:
    """Single kernels, callable on plain arrays."""
    names = (
        solve, multiply,
        residual, jacobian, bias, acceleration, force, project,
    )  # fmt: skip
    return types.SimpleNamespace(**{kernel.__name__: kernel for kernel in names})


@pytest.fixture(scope="session")
def uniform_rods() -> Callable[..., Any]:
    """Motion of planar uniform rods in absolute angles, integrated by scipy; shares nothing with the package.

    centre[k, j] says how far [m] the centre of rod k lies along rod j, so that r_k = sum_j centre[k, j] e_j
    (from a fixed point), and the virtual work of m r'' = m g gives the textbook equations. friction[k, j] is the
    torque matrix, tau = -friction omega; closure[j]: sum_j closure[j] e_j = const, by multipliers.
    Returns angles and rates, each (rods, times).
    """

    def motion(
        masses: Array,
        inertias: Array,
        centre: Array,
        angles: Array,
        rates: Array,
        times: Array,
        *,
        friction: Array | None = None,
        closure: Array | None = None,
        gravity: complex = -9.81j,
    ) -> tuple[Array, Array]:
        masses, centre = np.asarray(masses, dtype=float), np.asarray(centre, dtype=float)
        count = len(angles)

        def rate(_time: float, y: Array) -> Array:
            angle, omega = y[:count], y[count:]
            e = np.exp(1j * angle)
            levers = 1j * centre * e  # d r_k / d angle_j
            matrix = np.diag(np.asarray(inertias, dtype=float)) + np.real(
                np.einsum("kj,k,ki->ji", np.conj(levers), masses, levers)
            )
            swing = -(centre * e) @ omega**2
            load = np.real(np.conj(levers).T @ (masses * (gravity - swing)))
            if friction is not None:
                load = load - friction @ omega
            if closure is not None:
                gap = np.asarray(closure) * e
                rows = np.array([np.real(1j * gap), np.imag(1j * gap)])
                pull = gap @ omega**2
                full = np.block([[matrix, rows.T], [rows, np.zeros((2, 2))]])
                change = np.linalg.solve(full, np.concatenate([load, [np.real(pull), np.imag(pull)]]))[:count]
            else:
                change = np.linalg.solve(matrix, load)
            return np.concatenate([omega, change])

        start = np.concatenate([angles, rates])
        run = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
        assert run.success
        return run.y[:count], run.y[count:]

    return motion
