"""Signals: loads that follow formulas of time and of measures of the machine, which a tape evaluates.

    evaluate ─ measures, places, functions of time ─ tape.run
    act      ─ every load with the value of its register as its strength

Registers hold the value and the rate of every measure, positions, velocities, functions of time, constants, and the
results of the tape, in this order.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers
from shoal.compile.pointers import raw_type, shift
from shoal.compile.structures import Reference
from shoal.compile.vector import add_product, copy
from shoal.mechanics import applied, forces, functions, tape
from shoal.mechanics.applied import Applied
from shoal.mechanics.forces import Forces
from shoal.mechanics.numerics.tile import Array, Index, Tile

ACT, REMEMBER = range(2)
"""What the kernel does: evaluate all and add the loads to the forces, or count the turns of angles."""


class Signals(NamedTuple):
    """Measures, tape and loads of one tile.

    measures: without any law. positions, velocities: rows of the state, and how many. functions: of time, by number.
    constant: (constants, lanes). code: of the tape, `size` instructions, whose results are the registers from `first`
    on. applied, torques: loads, in whose lists of functions registers stand; torques of the plane act along their
    measure.
    """

    measures: Forces
    position: Index
    positions: int
    velocity: Index
    velocities: int
    function: Index
    functions: int
    constant: Array
    constants: int
    code: Index
    size: int
    first: int
    applied: Applied
    torques: Forces


def registers(signals: Signals) -> int:
    """Return the number of registers."""
    return signals.first + signals.size


def room(signals: Any, width: int) -> Array:
    """Return the room of the signals of a tile: the continuous angles of measures, then the registers."""
    return np.zeros((signals.measures.size + registers(signals)) * width if signals else 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def _registers(tile: Tile, s: Signals, own: Array) -> Array:
    return shift(own, s.measures.size * len(tile))  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def evaluate(tile: Tile, s: Signals, m: Any, w: Any, t: float, z: Array, zdot: Array) -> None:
    """All registers at a state whose derived rows are filled. Uses w.element."""
    width, register, at = len(tile), _registers(tile, s, w.signals), 0
    value = forces.value_row(s.measures)
    for k in range(s.measures.size):
        forces.measure(tile, s.measures, k, z, w.signals, w.element)
        forces.slip(tile, s.measures, k, zdot, w.element)
        copy(tile, register, at, w.element, value)
        copy(tile, register, at + 1, w.element, value + 1)
        at += 2
    for k in range(s.positions):
        copy(tile, register, at + k, z, s.position[k])
    at += s.positions
    for k in range(s.velocities):
        copy(tile, register, at + k, zdot, s.velocity[k])
    at += s.velocities
    for k in range(s.functions):
        number = functions.evaluate(m.functions, s.function[k], t, 0)
        for lane in range(width):
            register[(at + k) * width + lane] = number
    at += s.functions
    for k in range(s.constants):
        copy(tile, register, at + k, s.constant, k)
    tape.run(tile, s.code, s.size, s.first, register)


@njit(cache=True, error_model="numpy")
def act(tile: Tile, s: Signals, w: Any, z: Array, zdot: Array, f: Array) -> None:
    """Add the loads to f (rows, lanes), and take the power [W] they supply from w.power. Uses w.element."""
    width, register = len(tile), _registers(tile, s, w.signals)
    applied.add_forces(tile, s.applied, register, z, zdot, f, w.power)
    value = forces.value_row(s.torques)
    for k in range(s.torques.size):
        forces.gradient(tile, s.torques, k, z, w.element)
        forces.slip(tile, s.torques, k, zdot, w.element)
        copy(tile, w.element, value, register, s.torques.drive[k])
        for lane in range(width):
            w.power[lane] -= w.element[value * width + lane] * w.element[(value + 1) * width + lane]
        rows = forces.side(s.torques)
        for row in range(rows):
            add_product(tile, f, s.torques.rows[rows * k + row], w.element, value, w.element, rows + row)


@njit(cache=True, error_model="numpy")
def _signals(tile, s, m, w, t, z, zdot, f, part):  # type: ignore[no-untyped-def]
    if part == REMEMBER:
        forces.remember(tile, s.measures, z, w.signals)
    else:
        evaluate(tile, s, m, w, t, z, zdot)
        act(tile, s, w, z, zdot, f)


def kernel(tile: Tile, signals: Signals, m: Any, w: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the kernel of signals with the types of its arguments; m, w: what kernels see."""
    parts = (Reference(raw_type(typeof(part))) for part in (signals, m, w))
    rows = types.CPointer(types.float64)
    return _signals, (typeof(tile), *parts, types.float64, rows, rows, rows, types.int64)


@njit(cache=True, error_model="numpy", forceinline=True)
def follow(tile: Tile, m: Any, w: Any, t: float, z: Array, zdot: Array, f: Array, part: int) -> None:
    """Call the kernel of a machine that has signals."""
    function_pointers.call(m.table.signals, (tile, m.signals, m, w, t, z, zdot, f, part))
