"""Signals: loads that follow formulas of time and of measures of the machine, which a tape evaluates.

    evaluate ─ measures, places, functions of time ─ tape.run
    act      ─ every load with the value of its register as its strength
    linearise ─ tape.reverse ─ derivatives of the strengths by coordinates and rates

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
from shoal.compile.vector import add, add_product, copy
from shoal.mechanics import applied, forces, functions, tape
from shoal.mechanics.applied import Applied
from shoal.mechanics.derived import fold
from shoal.mechanics.forces import Forces
from shoal.mechanics.numerics.tile import Array, Index, Tile

ACT, REMEMBER, LINEARISE, DERIVE = range(4)
"""What the kernel does: evaluate all and add the loads to the forces; count the turns of angles; evaluate all and
`linearise`; or `linearise` what was evaluated last."""
FORCE, BY_PLACE, BY_RATE = range(3)
"""What `linearise` makes of every strength."""
BLOCKS = 3


class Signals(NamedTuple):
    """Measures, tape and loads of one tile.

    measures: without any law. positions, velocities: rows of the state, and how many. functions: of time, by number.
    constant: (constants, lanes). code: of the tape, `size` instructions, whose results are the registers from `first`
    on. strength: registers that loads follow, and how many. applied, torques: loads, in whose lists of functions
    registers stand; torques of the plane act along their measure, times the amplitude of its law.
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
    strength: Index
    strengths: int
    applied: Applied
    torques: Forces


def registers(signals: Signals) -> int:
    """Return the number of registers."""
    return signals.first + signals.size


def room(signals: Any, width: int, rows: int) -> Array:
    """Return the room of the signals of a tile.

    The continuous angles of measures, the registers, their adjoints, one row of power, and what `linearise` finds: the
    blocks of every strength, then its derivatives by the constants.
    """
    if not signals:
        return np.zeros(0)
    by_strength = BLOCKS * rows + signals.constants
    return np.zeros((signals.measures.size + 2 * registers(signals) + 1 + by_strength * signals.strengths) * width)


def register(signals: Signals, own: Array) -> Array:
    """Return the registers in the room of one lane, (registers,)."""
    return own[signals.measures.size :][: registers(signals)]


def feedback(signals: Signals, own: Array, rows: int) -> Array:
    """Return what `linearise` left in the room of one lane, (strengths, BLOCKS, rows)."""
    size = BLOCKS * rows * signals.strengths
    return own[signals.measures.size + 2 * registers(signals) + 1 :][:size].reshape(signals.strengths, BLOCKS, rows)


def by_constants(signals: Signals, own: Array) -> Array:
    """Return the derivatives of all strengths by the constants that `linearise` left, (strengths, constants)."""
    size = signals.strengths * signals.constants
    return own[len(own) - size :].reshape(signals.strengths, signals.constants)


def on_a_kink(signals: Signals, own: Array) -> bool:
    """Return whether an operation of the tape is where its value or its derivative jumps, but for round-off."""
    numbers = register(signals, own)
    for operation, a, b, _ in signals.code.reshape(-1, tape.ENTRIES).tolist():
        x, y = float(numbers[a]), float(numbers[b])
        if operation in (tape.MINIMUM, tape.MAXIMUM) and abs(x - y) <= tape.ROUND * (abs(x) + abs(y)):
            return True
        if operation in (tape.ABSOLUTE, tape.STEP) and abs(x) <= tape.ROUND:
            return True
    return False


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
def act(tile: Tile, s: Signals, register: Array, z: Array, zdot: Array, f: Array, power: Array, room: Array) -> None:
    """Add the loads to f (rows, lanes), and take the power [W] they supply from power (lanes,); room: w.element."""
    width, value, rows = len(tile), forces.value_row(s.torques), forces.side(s.torques)
    applied.add_forces(tile, s.applied, register, z, zdot, f, power)
    for k in range(s.torques.size):
        forces.gradient(tile, s.torques, k, z, room)
        forces.slip(tile, s.torques, k, zdot, room)
        amplitude, strength = (forces.LAW * k + forces.AMPLITUDE) * width, s.torques.drive[k] * width
        for lane in range(width):
            torque = s.torques.law[amplitude + lane] * register[strength + lane]
            room[value * width + lane] = torque
            power[lane] -= torque * room[(value + 1) * width + lane]
        for row in range(rows):
            add_product(tile, f, s.torques.rows[rows * k + row], room, value, room, rows + row)


@njit(cache=True, error_model="numpy", forceinline=True)
def block(tile: Tile, s: Signals, m: Any, w: Any, k: int) -> Array:
    """Return where `linearise` puts what belongs to strength k, BLOCKS times `force_rows` rows."""
    rows = s.measures.size + 2 * (s.first + s.size) + 1 + BLOCKS * k * m.force_rows
    return shift(w.signals, rows * len(tile))  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def linearise(tile: Tile, s: Signals, m: Any, w: Any, z: Array, zdot: Array) -> None:
    """Find of every strength S, evaluated before, the force on the unknowns if it is 1, dS/dq, dS/dv, dS/dconstants.

    What a rate changes with the coordinates, v'd2g/dq2, is left out, as of dampers; at rest it is zero. Uses w.element.
    """
    width, count, end = len(tile), s.first + s.size, m.force_rows * len(tile)
    register = _registers(tile, s, w.signals)
    adjoint, power = shift(register, count * width), shift(register, 2 * count * width)
    value, rows = forces.value_row(s.measures), forces.side(s.measures)
    for k in range(s.strengths):
        force = block(tile, s, m, w, k)
        by_place, by_rate = shift(force, end), shift(force, 2 * end)
        for i in range(BLOCKS * end):
            force[i] = 0.0
        for i in range(count * width):
            adjoint[i] = 1.0 if i // width == s.strength[k] else 0.0
        act(tile, s, adjoint, z, zdot, force, power, w.element)
        tape.reverse(tile, s.code, s.size, s.first, register, adjoint)
        for number in range(s.measures.size):
            forces.gradient(tile, s.measures, number, z, w.element)
            copy(tile, w.element, value, adjoint, 2 * number)
            copy(tile, w.element, value + 1, adjoint, 2 * number + 1)
            for row in range(rows):
                place = s.measures.rows[rows * number + row]
                add_product(tile, by_place, place, w.element, value, w.element, rows + row)
                add_product(tile, by_rate, place, w.element, value + 1, w.element, rows + row)
        at = 2 * s.measures.size
        for number in range(s.positions):
            add(tile, by_place, s.position[number], adjoint, at + number)
        at += s.positions
        for number in range(s.velocities):
            add(tile, by_rate, s.velocity[number], adjoint, at + number)
        for part in range(BLOCKS):
            fold(tile, m.derived, shift(force, part * end), m.force_rows)
        for i in range(s.constants):
            at = (2 * count + 1) * width + BLOCKS * s.strengths * end
            copy(tile, shift(register, at), k * s.constants + i, adjoint, s.first - s.constants + i)


@njit(cache=True, error_model="numpy")
def _signals(tile, s, m, w, t, z, zdot, f, part):  # type: ignore[no-untyped-def]
    if part == REMEMBER:
        forces.remember(tile, s.measures, z, w.signals)
        return
    if part != DERIVE:
        evaluate(tile, s, m, w, t, z, zdot)
    if part in (LINEARISE, DERIVE):
        linearise(tile, s, m, w, z, zdot)
    else:
        act(tile, s, _registers(tile, s, w.signals), z, zdot, f, w.power, w.element)


def kernel(tile: Tile, signals: Signals, m: Any, w: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the kernel of signals with the types of its arguments; m, w: what kernels see."""
    parts = (Reference(raw_type(typeof(part))) for part in (signals, m, w))
    rows = types.CPointer(types.float64)
    return _signals, (typeof(tile), *parts, types.float64, rows, rows, rows, types.int64)


@njit(cache=True, error_model="numpy", forceinline=True)
def follow(tile: Tile, m: Any, w: Any, t: float, z: Array, zdot: Array, f: Array, part: int) -> None:
    """Call the kernel of a machine that has signals."""
    function_pointers.call(m.table.signals, (tile, m.signals, m, w, t, z, zdot, f, part))
