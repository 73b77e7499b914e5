"""The gates between the integrators and the mechanics: kernels that are compiled once and called by their addresses.

Each function here does what the one of the same name does that its gate calls, a few lines below; `numerics.gate` says
why. `ready` compiles the gates of one width, or takes them from the cache.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit, typeof, types

from shoal.mechanics import dynamics
from shoal.mechanics.dynamics import ACCELERATION, ALL, ELASTIC, SIMPLE, Work, instant
from shoal.mechanics.least import drift
from shoal.mechanics.least.principle import SOUGHT
from shoal.mechanics.model import Arrays, Gates
from shoal.mechanics.numerics import gate
from shoal.mechanics.numerics.pointers import raw_type
from shoal.mechanics.numerics.tile import Array, Tile

Seek = Callable[[float, Array], None]
"""Seeks the acceleration of a single lane in place of the kernels: (time [s], the forces Q (unknowns,), which it
replaces by the acceleration). The state, C_q and eta are in the work space, where it leaves the multipliers."""

_CALLED = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.POINTER(ctypes.c_double))


@njit(cache=True, error_model="numpy")
def enter(m: Arrays, w: Work) -> None:
    """Store both structures where the gates find them; at the beginning of a compiled loop."""
    gate.store(m.home, m)
    gate.store(w.home, w)


@njit(cache=True, error_model="numpy", forceinline=True)
def force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array) -> None:
    """All of `dynamics.force`."""
    t = instant(w, t)
    gate.call(m.gates.motion, (tile, gate.typed(m.home, m), gate.typed(w.home, w), t, z, zdot, 0.0, f, ALL))


@njit(cache=True, error_model="numpy", forceinline=True)
def elastic_force(tile: Tile, m: Arrays, w: Work, z: Array, f: Array, exact: bool) -> None:
    """The elastic part of `dynamics.force`; exact: without the elements of `dynamics.add_mean_force`."""
    part = SIMPLE if exact else ELASTIC
    gate.call(m.gates.motion, (tile, gate.typed(m.home, m), gate.typed(w.home, w), 0.0, z, z, 0.0, f, part))


@njit(cache=True, error_model="numpy", forceinline=True)
def acceleration(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """All of `dynamics.force`, then `dynamics.accelerate`; z, zdot, a: (rows, lanes)."""
    t = instant(w, t)
    arguments = (gate.typed(m.home, m), gate.typed(w.home, w), t, z, zdot, tolerance, a, ACCELERATION)
    gate.call(m.gates.motion, (tile, *arguments))


@njit(cache=True, error_model="numpy")
def _motion(tile, pm, pw, t, z, zdot, tolerance, a, part):  # type: ignore[no-untyped-def]
    m, w = gate.load(pm), gate.load(pw)
    dynamics.force(tile, m, w, t, z, zdot, a, part)
    if part == ACCELERATION:
        dynamics.accelerate(tile, m, w, t, z, zdot, tolerance, a)


@njit(cache=True, error_model="numpy", forceinline=True)
def settle(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, iterations: int = 3) -> None:
    """Remove the drift of a constrained model (nothing to do where sharing expressed every joint)."""
    if m.constraints.size > 0 and m.projects:
        t = instant(w, t)
        gate.call(m.gates.settle, (tile, gate.typed(m.home, m), gate.typed(w.home, w), t, tolerance, iterations))


@njit(cache=True, error_model="numpy", forceinline=True)
def meet(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Let driven constraints take up their new rates at once: a plastic impact, the least change in the mass metric."""
    gate.call(m.gates.settle, (tile, gate.typed(m.home, m), gate.typed(w.home, w), t, tolerance, 3))


@njit(cache=True, error_model="numpy")
def _settle(tile, pm, pw, t, tolerance, iterations):  # type: ignore[no-untyped-def]
    m, w = gate.load(pm), gate.load(pw)
    drift.project(tile, m, w.gauss, t, w.z, w.zdot, tolerance, iterations)


@njit(cache=True, error_model="numpy", forceinline=True)
def energies(tile: Tile, m: Arrays, w: Work) -> None:
    """`dynamics.energies`."""
    gate.call(m.gates.energies, (tile, gate.typed(m.home, m), gate.typed(w.home, w)))


@njit(cache=True, error_model="numpy")
def _energies(tile, pm, pw):  # type: ignore[no-untyped-def]
    dynamics.energies(tile, gate.load(pm), gate.load(pw))


@njit(cache=True, error_model="numpy", forceinline=True)
def tangents(tile: Tile, m: Arrays, w: Work, z: Array, damping_factor: float, block: Array, size: int) -> None:
    """`dynamics.tangents`."""
    arguments = (gate.typed(m.home, m), gate.typed(w.home, w), z, damping_factor, block, size)
    gate.call(m.gates.tangents, (tile, *arguments))


@njit(cache=True, error_model="numpy")
def _tangents(tile, pm, pw, z, damping_factor, block, size):  # type: ignore[no-untyped-def]
    dynamics.tangents(tile, gate.load(pm), gate.load(pw), z, damping_factor, block, size)


_NUMBER, _COUNT, _ROWS = types.float64, types.int64, types.CPointer(types.float64)
_GATES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "motion": (_motion, (_NUMBER, _ROWS, _ROWS, _NUMBER, _ROWS, _COUNT)),
    "settle": (_settle, (_NUMBER, _NUMBER, _COUNT)),
    "energies": (_energies, ()),
    "tangents": (_tangents, (_ROWS, _NUMBER, _ROWS, _COUNT)),
}
"""Every gate, and the types of its arguments after the tile and the two structures."""

_READY: dict[int, Gates] = {}


def ready(tile: Tile, arrays: Arrays, room: Work) -> Arrays:
    """The same arrays with a home of their own and the gates for this width."""
    if len(tile) not in _READY:
        shared = (typeof(tile), *(types.CPointer(raw_type(typeof(part))) for part in (arrays, room)))
        addresses = {name: gate.address(kernel, (*shared, *own)) for name, (kernel, own) in _GATES.items()}
        _READY[len(tile)] = Gates(**addresses)
    return arrays._replace(home=gate.home(), gates=_READY[len(tile)])


class Sought:
    """A `Seek` behind an address that compiled code can call; it must outlive the calls."""

    def __init__(self, seek: Seek, unknowns: int) -> None:
        self._seek, self._unknowns = seek, unknowns
        self._called = _CALLED(self._call)
        self.error: Exception | None = None

    def joined(self, arrays: Arrays) -> Arrays:
        """The arrays with accelerations that are sought."""
        where = ctypes.cast(self._called, ctypes.c_void_p).value or 0
        return arrays._replace(method=SOUGHT, gates=arrays.gates._replace(sought=where))

    def _call(self, t: float, place: Any) -> None:
        a = np.ctypeslib.as_array(place, (self._unknowns,))
        try:
            self._seek(t, a)
        except Exception as error:  # no exception passes through compiled code
            self.error = error
            a[:] = np.nan
