"""Signals: loads that follow formulas of time and of measures of the machine, which a tape evaluates.

    evaluate ─ measures, places, functions of time ─ tape.run
    sample   ─ samples.take ─ what is held until the next one
    act      ─ every load with the value of its register as its strength
    linearise ─ tape.reverse ─ derivatives of the strengths by coordinates and rates

Registers hold the value and the rate of every measure, positions, velocities, functions of time, samples, constants,
and the results of the tape, in this order.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers
from shoal.compile.pointers import raw_type, shift
from shoal.compile.structures import Reference
from shoal.compile.vector import add, add_product, copy
from shoal.mechanics import applied, forces, functions, samples, tape
from shoal.mechanics.applied import Applied
from shoal.mechanics.derived import derive, fold
from shoal.mechanics.forces import Forces
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.samples import Samples

ACT, REMEMBER, LINEARISE, DERIVE, SETTLE, TURN, RECORD, SAMPLE = range(8)
"""What the kernel does: evaluate all and add the loads to the forces; count the turns of angles; evaluate all and
`linearise`; `linearise` what was evaluated last; set all switches that are held by their arguments; turn those that
are marked; evaluate all and copy what is recorded to f; or take the samples due, of which part // PARTS tells."""
PARTS = 8
FORCE, BY_PLACE, BY_RATE = range(3)
"""What `linearise` makes of every strength."""
BLOCKS = 3


class Signals(NamedTuple):
    """Measures, tape and loads of one tile.

    always: how many measures, positions, velocities, functions and instructions are evaluated at all times; what
    follows them is for samples. measures: without any law. positions, velocities, accelerations: rows of the state, and
    how many. functions: of time, by number. constant: (constants, lanes). code: of the tape, `size` instructions, whose
    results are the registers from `first` on. strength: registers that loads follow, and how many; switch: instructions
    that switch; output: registers that are recorded. applied, torques: loads, in whose lists of functions registers
    stand; torques of the plane act along their measure, times the amplitude of its law.
    """

    measures: Forces
    position: Index
    positions: int
    velocity: Index
    velocities: int
    function: Index
    functions: int
    acceleration: Index
    accelerations: int
    constant: Array
    constants: int
    code: Index
    size: int
    first: int
    strength: Index
    strengths: int
    switch: Index
    switches: int
    output: Index
    outputs: int
    always: Index
    samples: Samples
    applied: Applied
    torques: Forces


def registers(signals: Signals) -> int:
    """Return the number of registers."""
    return signals.first + signals.size


def room(signals: Any, width: int, rows: int) -> Array:
    """Return the room of the signals of a tile.

    The continuous angles of measures; whether switches are held, in every lane, their branches, marks, largest
    arguments and margins at the beginning of the step; what samples keep; the registers, their adjoints, one row of
    power, and what `linearise` finds: the blocks of every strength, then its derivatives by the constants.
    """
    if not signals:
        return np.zeros(0)
    by_strength = BLOCKS * rows + signals.constants
    return np.zeros((_before.py_func(signals) + 2 * registers(signals) + 1 + by_strength * signals.strengths) * width)


@njit(cache=True, error_model="numpy", forceinline=True)
def _before(s: Signals) -> int:
    """Rows of the room before the registers."""
    return s.measures.size + 1 + 4 * s.switches + s.samples.pending


SMALL = 1e-12
"""Arguments of a switch below this part of the largest one that it has had are zero."""
CHATTERS = -2.0
"""Mark of a motion that ends in switches without end, beside the troubles of contacts."""


def switches_held(arrays: Any, tile: Tile) -> bool:
    """Return whether steps end where signals switch: of single lanes, but for machines with contacts."""
    return bool(arrays.followed) and arrays.followed.switches > 0 and len(tile) == 1 and arrays.gaps.size == 0


def hold(signals: Signals, own: Array) -> None:
    """Let the switches of one lane be held from now on."""
    own[signals.measures.size] = 1.0


def register(signals: Signals, own: Array) -> Array:
    """Return the registers in the room of one lane, (registers,)."""
    return own[_before.py_func(signals) :][: registers(signals)]


def begin_samples(signals: Signals, own: Array, lanes: int) -> None:
    """Put what samples keep to its beginning; own: (rows, lanes) as numbers in a row."""
    rows = signals.samples.pending
    end = _before.py_func(signals) * lanes
    own[end - rows * lanes : end] = 0.0
    first = (signals.first - signals.constants - signals.samples.held) * lanes
    own[end + first :][: signals.samples.begin.size] = signals.samples.begin


def nearest_tie(signals: Signals, own: Array) -> tuple[float, float, int, float]:
    """Return what the room of one lane keeps of roundings, see `samples.NEAREST`."""
    end = _before.py_func(signals)
    near, time, number, codes = own[end - signals.samples.pending :][: samples.FIRST_PENDING].tolist()
    return near, time, int(number), codes


def feedback(signals: Signals, own: Array, rows: int) -> Array:
    """Return what `linearise` left in the room of one lane, (strengths, BLOCKS, rows)."""
    size = BLOCKS * rows * signals.strengths
    return own[_before.py_func(signals) + 2 * registers(signals) + 1 :][:size].reshape(signals.strengths, BLOCKS, rows)


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
    return shift(own, _before(s) * len(tile))  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def _branches(tile: Tile, s: Signals, own: Array) -> Array:
    return shift(own, (s.measures.size + 1) * len(tile))  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def _held(tile: Tile, s: Signals, own: Array) -> bool:
    return own[s.measures.size * len(tile)] > 0.0  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def evaluate(tile: Tile, s: Signals, m: Any, w: Any, t: float, z: Array, zdot: Array) -> None:
    """The registers that are evaluated at all times, at a state whose derived rows are filled. Uses w.element."""
    counts = (s.always[0], s.always[1], s.always[2], s.always[3])
    _enter(tile, s, m, w, t, z, zdot, counts)
    register, branch, held = _registers(tile, s, w.signals), _branches(tile, s, w.signals), _held(tile, s, w.signals)
    tape.run(tile, s.code, s.always[4], s.first, register, branch, held)


@njit(cache=True, error_model="numpy")
def _enter(
    tile: Tile, s: Signals, m: Any, w: Any, t: float, z: Array, zdot: Array, counts: tuple[int, int, int, int]
) -> None:
    """Enter measures, places, rates, functions of time, so many of each, and constants into their registers."""
    width, register, at = len(tile), _registers(tile, s, w.signals), 0
    value = forces.value_row(s.measures)
    for k in range(counts[0]):
        forces.measure(tile, s.measures, k, z, w.signals, w.element)
        forces.slip(tile, s.measures, k, zdot, w.element)
        copy(tile, register, at, w.element, value)
        copy(tile, register, at + 1, w.element, value + 1)
        at += 2
    at = 2 * s.measures.size
    for k in range(counts[1]):
        copy(tile, register, at + k, z, s.position[k])
    at += s.positions
    for k in range(counts[2]):
        copy(tile, register, at + k, zdot, s.velocity[k])
    at += s.velocities
    for k in range(counts[3]):
        number = functions.evaluate(m.functions, s.function[k], t, 0)
        for lane in range(width):
            register[(at + k) * width + lane] = number
    at += s.functions + s.accelerations + s.samples.held
    for k in range(s.constants):
        copy(tile, register, at + k, s.constant, k)


@njit(cache=True, error_model="numpy")
def _sample(tile: Tile, s: Signals, m: Any, w: Any, t: float, z: Array, zdot: Array, due: int) -> None:
    """Evaluate all registers, and take the samples that are due, for which switches are as their arguments are."""
    derive(tile, m.derived, z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, zdot, m.unknowns, m.force_rows, True)
    _enter(tile, s, m, w, t, z, zdot, (s.measures.size, s.positions, s.velocities, s.functions))
    register, branch = _registers(tile, s, w.signals), _branches(tile, s, w.signals)
    if s.accelerations > 0:
        derive(tile, m.derived, w.a, m.unknowns, m.force_rows, True)
        first = s.first - s.constants - s.samples.held - s.accelerations
        for k in range(s.accelerations):
            copy(tile, register, first + k, w.a, s.acceleration[k])
    tape.run(tile, s.code, s.always[4], s.first, register, branch, due == 0 and _held(tile, s, w.signals))
    room = shift(w.signals, (_before(s) - s.samples.pending) * len(tile))
    samples.take(tile, s.samples, s.code, s.always[4], s.first, register, room, due, t)


# Of a single lane:


@njit(cache=True, error_model="numpy")
def floor(tile: Tile, s: Signals, w: Any, number: int) -> float:
    """Return the margin below which a switch turns: 0, or where it began if its last turn came a little early."""
    return min(_branches(tile, s, w.signals)[3 * s.switches + number], 0.0)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def margin(tile: Tile, s: Signals, w: Any, number: int) -> float:
    """Return by how much the argument of a switch is on the side on which it is held; below zero it is beyond."""
    register, k = _registers(tile, s, w.signals), s.switch[number]
    x = register[s.code[tape.ENTRIES * k + 1]]
    if s.code[tape.ENTRIES * k] >= tape.MINIMUM:
        x -= register[s.code[tape.ENTRIES * k + 2]]
    return x if _branches(tile, s, w.signals)[number] > 0.0 else -x  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def is_far(tile: Tile, s: Signals, w: Any) -> bool:
    """Return whether every switch is farther from its turn, at both ends of a step, than the step has moved it."""
    for number in range(s.switches):
        begin, end = _branches(tile, s, w.signals)[3 * s.switches + number], margin(tile, s, w, number)
        if not min(begin, end) > abs(end - begin):
            return False
    return True


@njit(cache=True, error_model="numpy")
def mark(tile: Tile, s: Signals, w: Any, number: int, turns: bool) -> None:
    """Mark a switch as one that turns, or as none."""
    _branches(tile, s, w.signals)[s.switches + number] = 1.0 if turns else 0.0


@njit(cache=True, error_model="numpy")
def largest(tile: Tile, s: Signals, w: Any, number: int) -> float:
    """Return the largest argument that a switch has had."""
    return _branches(tile, s, w.signals)[2 * s.switches + number]  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def learn(tile: Tile, s: Signals, w: Any) -> None:
    """Keep the arguments of the switches as they are evaluated, at the beginning of a step."""
    branch = _branches(tile, s, w.signals)
    for number in range(s.switches):
        now = margin(tile, s, w, number)
        branch[2 * s.switches + number] = max(branch[2 * s.switches + number], abs(now))
        branch[3 * s.switches + number] = now


@njit(cache=True, error_model="numpy")
def _settle(tile: Tile, s: Signals, m: Any, w: Any, t: float, z: Array, zdot: Array, turning: bool) -> None:
    """Set switches by their arguments at a state, in the order in which they depend on each other.

    turning: those that are marked turn, whatever their arguments, which are zero but for round-off; the others may
    depend on them.
    """
    branch = _branches(tile, s, w.signals)
    derive(tile, m.derived, z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, zdot, m.unknowns, m.force_rows, True)
    for number in range(s.switches):
        if not turning:  # where an argument is zero the switch is above, as step(0) is 1
            branch[number] = 1.0
        evaluate(tile, s, m, w, t, z, zdot)
        turns = margin(tile, s, w, number) < -SMALL * largest(tile, s, w, number)
        if turns or (turning and branch[s.switches + number] > 0.0):
            branch[number] = 1.0 - branch[number]
    evaluate(tile, s, m, w, t, z, zdot)
    learn(tile, s, w)


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
    rows = _before(s) + 2 * (s.first + s.size) + 1 + BLOCKS * k * m.force_rows
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
        branch, held = _branches(tile, s, w.signals), _held(tile, s, w.signals)
        tape.reverse(tile, s.code, s.always[4], s.first, register, branch, held, adjoint)
        for number in range(s.always[0]):
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
    if part >= SAMPLE:
        _sample(tile, s, m, w, t, z, zdot, part // PARTS)
        return
    if part in (SETTLE, TURN):
        if _held(tile, s, w.signals):
            _settle(tile, s, m, w, t, z, zdot, part == TURN)
        return
    if part != DERIVE:
        evaluate(tile, s, m, w, t, z, zdot)
    if part == RECORD:
        if s.samples.size > 0:
            _sample(tile, s, m, w, t, z, zdot, 0)
        for k in range(s.outputs):
            copy(tile, f, k, _registers(tile, s, w.signals), s.output[k])
    elif part in (LINEARISE, DERIVE):
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
