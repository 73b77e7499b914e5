"""From a state to its acceleration: derived rows, forces, constraints. The time loop comes here through `kernels`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers, simd, structures
from shoal.compile.pointers import pointer, raw, shift
from shoal.compile.vector import clear
from shoal.mechanics import applied, constraints, forces, gaps, rubbing, signals
from shoal.mechanics.derived import Derived, derive, fold
from shoal.mechanics.elements.families import LAID
from shoal.mechanics.least import principle
from shoal.mechanics.least import work as least
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics import alike, sparse
from shoal.mechanics.numerics.tile import Array, Tile

ELEMENT_ROWS = 64
ELEMENT_ROOM = 2336
"""Numbers of room at least: `beam_table` keeps 292 numbers for each of eight elements that are computed at once."""
ALL, ELASTIC, SIMPLE, ACCELERATION = 0, 1, 2, 3
"""Parts of the force: everything, the elastic part, the elastic part but for elements that know their mean force; or
the acceleration that follows from everything."""


class Work(NamedTuple):
    """The state of one tile and the room to compute its change.

    z, zdot, a: coordinates, rates and accelerations, (rows, lanes). before: z, zdot and a at the
    beginning of the step. stage: room of four states for integrators. element: room of 64 rows and
    of `ELEMENT_ROOM` numbers at least. memory: the
    continuous angle of every force element, (forces, lanes). power: dissipated minus supplied power
    [W], (lanes,). energy: kinetic, elastic, potential, elastic of the bodies alone [J], (4, lanes). until: the last
    instant [s] before functions of time may jump, (1,); later times are replaced by it. rubbing: of
    friction by joint forces. signals: see `signals.room`.
    """

    storage: Array
    z: Array
    zdot: Array
    a: Array
    before: Array
    stage: Array
    element: Array
    memory: Array
    power: Array
    energy: Array
    until: Array
    gauss: least.GaussWork
    rubbing: Array
    gaps: gaps.GapWork
    signals: Array


def work_space(tile: Tile, m: Arrays) -> Work:
    """Room for the motion of one tile."""
    width = len(tile)
    rows = m.rows * width
    sizes = (
        rows,
        rows,
        rows,
        3 * rows,
        4 * rows,
        max(ELEMENT_ROWS * width, ELEMENT_ROOM),
        m.forces.size * width,
        width,
        4 * width,
    )
    z, zdot, a, before, stage, element, memory, power, energy = (np.zeros(size) for size in sizes)
    return Work(
        structures.storage(),
        z,
        zdot,
        a,
        before,
        stage,
        element,
        memory,
        power,
        energy,
        np.full(1, np.inf),
        least.work_space(width, m),
        rubbing.room(width, m.rows, m.rubbing.size),
        gaps.room(width, m.gaps, m.unknowns, m.rows, m.constraints.size),
        signals.room(m.followed, width, m.force_rows),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def instant(w: Work, t: float) -> float:
    """The time [s] at which functions of time are to be asked: a step that ends at a jump knows its left side only."""
    return min(t, w.until[0])  # type: ignore[no-any-return]


def derived_rows(tile: Tile, arrays: Arrays, room: Work) -> None:
    """Fill all derived rows of the state in `room`. Arrays, not pointers."""
    _derived_rows(tile, arrays.derived, room.z, arrays.unknowns, arrays.rows, False)
    _derived_rows(tile, arrays.derived, room.zdot, arrays.unknowns, arrays.rows, True)


def rows_kernel(tile: Tile, arrays: Arrays, room: Work) -> tuple[Any, tuple[Any, ...]]:
    """Return the kernel of `derived_rows` with the types of its arguments."""
    number = types.int64
    return _derived_rows, (typeof(tile), typeof(arrays.derived), typeof(room.z), number, number, types.boolean)


@njit(cache=True, error_model="numpy")
def _derived_rows(tile: Tile, derived: Derived, z: Array, begin: int, end: int, moving: bool) -> None:
    derive(tile, raw(derived), pointer(z), begin, end, moving)


@njit(cache=True, error_model="numpy", forceinline=True)
def loaded(m: Arrays) -> bool:
    """Return whether forces depend on rates or on time, so that they take up or supply power."""
    a = m.applied
    return (
        m.driven
        or m.forces.size + a.fixed + a.following + a.turning + a.twisting > 0
        or m.damped
        or m.table.signals != 0
        or m.gaps.tangents > 0
        or m.gives
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array, part: int) -> None:
    """A part of the generalised forces Q on the unknowns; z, zdot, f: (rows, lanes).

    Fills the derived rows of z and zdot that forces act on, and the dissipated minus supplied power.
    """
    moving = part in (ALL, ACCELERATION)
    _add_weight(tile, m, z, f, moving)
    if loaded(m):
        for lane in range(len(tile)):
            w.power[lane] = 0.0
        if moving:
            derive(tile, m.derived, zdot, m.unknowns, m.force_rows, True)
            applied.add_force(tile, m.applied, m.functions, t, z, zdot, f, w.power)
            if m.table.signals != 0:
                signals.follow(tile, m, w, t, z, zdot, f, signals.ACT)
        forces.add_force(tile, m.forces, m.functions, t, z, zdot, w.memory, f, w.element, w.power, moving)
    _add_elements(tile, m, w, z, zdot, f, part)


@njit(cache=True, error_model="numpy", forceinline=True)
def free(m: Arrays) -> bool:
    """Return whether nothing acts on the machine but weight and undamped elements, and no constraint: as fast ones
    are.
    """
    return m.constraints.size == 0 and m.table.sought == 0 and m.gaps.size == 0 and not loaded(m)


@njit(cache=True, error_model="numpy", forceinline=True)
def free_acceleration(tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array, a: Array) -> None:
    """`force` and `accelerate` of a free machine: they look at few members of the structures."""
    _add_weight(tile, m, z, a, True)
    _add_elements(tile, m, w, z, zdot, a, ACCELERATION)
    solve(tile, m, w, a)


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_weight(tile: Tile, m: Arrays, z: Array, f: Array, moving: bool) -> None:
    """Fill the derived rows of z that forces act on; the force begins as the weight or, if not moving, as none."""
    derive(tile, m.derived, z, m.unknowns, m.force_rows, False)
    if moving:
        simd.assign(f, m.weight, m.unknowns * len(tile))
    for row in range(m.unknowns if moving else 0, m.force_rows):
        clear(tile, f, row)


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_elements(tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array, f: Array, part: int) -> None:
    """Add the force of the elements, and pass all that is on derived rows to the unknowns."""
    table, moving = m.table, part in (ALL, ACCELERATION)
    for kind in range(table.families):
        if table.force[kind] != 0 and not (part == SIMPLE and table.mean[kind] != 0):
            family = shift(m.families, LAID * kind)
            function_pointers.call(table.force[kind], (tile, family, z, zdot, f, w.element, w.power, moving))
    fold(tile, m.derived, f, m.force_rows)


@njit(cache=True, error_model="numpy")
def add_mean_force(tile: Tile, m: Arrays, w: Work, before: Array, after: Array, f: Array) -> None:
    """Add the force of those elements whose mean over a step does exactly the work of their energy (Simo, Tarnow)."""
    for kind in range(m.table.families):
        if m.table.mean[kind] != 0:
            family = shift(m.families, LAID * kind)
            function_pointers.call(m.table.mean[kind], (tile, family, before, after, f, w.element))


@njit(cache=True, error_model="numpy", forceinline=True)
def accelerate(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """Turn all of the force in `a` into the acceleration by Gauss's principle, valid on the unknowns."""
    if m.constraints.size > 0 or m.table.sought != 0:
        arguments = (m, w, t, z, zdot, tolerance, a)
        function_pointers.call(m.table.constrain, (tile, *arguments))
    else:
        solve(tile, m, w, a)
        if m.gaps.size > 0 and len(tile) == 1:
            function_pointers.call(m.table.contact, (tile, m, w, t, z, zdot, tolerance, a))


@njit(cache=True, error_model="numpy", forceinline=True)
def solve(tile: Tile, m: Arrays, w: Work, a: Array) -> None:
    """Turn a force into the acceleration of a machine without constraints."""
    if m.alike.components > 0:
        alike.solve(tile, m.alike, w.element, a)
    else:
        sparse.solve(tile, m.pattern, m.mass_factor, a, 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def constrain(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """Accelerate with constraints, or where another method finds the acceleration; see `accelerate`."""
    if m.table.sought != 0:
        principle.state(tile, m, w.gauss, t, z, zdot)
        function_pointers.call_back(m.table.sought, t, a)
    else:
        _constrain(tile, m, w, t, z, zdot, tolerance, a)
    if m.gaps.size > 0 and len(tile) == 1:
        function_pointers.call(m.table.contact, (tile, m, w, t, z, zdot, tolerance, a))
    if m.driven:
        constraints.add_power(tile, m.constraints, m.functions, t, w.gauss.multiplier, w.power)
        for lane in range(len(tile)):
            w.power[lane] -= w.gauss.power[lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _constrain(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """By the principle: once, or until friction by the forces of joints agrees with them, see `rubbing`."""
    r, rounds, searching = m.rubbing, 0, True
    if r.size > 0:
        rubbing.prepare(tile, r, m.forces, m.derived, m.rows, m.force_rows, z, zdot, w.memory, w.element, a, w.rubbing)
    while searching:
        if r.size > 0:
            rubbing.load(tile, r, m.unknowns, m.rows, w.gauss.multiplier, w.rubbing, a)
        function_pointers.call(m.table.least, (tile, m, w, t, z, zdot, tolerance, a))
        rounds += 1
        searching = r.size > 0 and rounds < rubbing.ROUNDS
        searching = searching and rubbing.away(tile, r, m.rows, w.gauss.multiplier, w.rubbing) > rubbing.SETTLED
    if r.size > 0:
        rubbing.finish(tile, r, m.rows, w.gauss.multiplier, w.rubbing, a, w.power)


@njit(cache=True, error_model="numpy", forceinline=True)
def multiply_mass(tile: Tile, m: Arrays, x: Array, y: Array) -> None:
    """y = M x; (rows, lanes)."""
    if m.alike.components > 0:
        alike.multiply(tile, m.alike, x, y)
    else:
        sparse.multiply(tile, m.pattern, m.mass, x, y)


@njit(cache=True, error_model="numpy", forceinline=True)
def remember(tile: Tile, m: Arrays, w: Work) -> None:
    """Count the turns of angle forces after a step."""
    if m.forces.size > 0:
        derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
        forces.remember(tile, m.forces, w.z, w.memory)
    if m.table.signals != 0:
        derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
        signals.follow(tile, m, w, 0.0, w.z, w.zdot, w.z, signals.REMEMBER)
    if m.gaps.size > 0:
        derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
        forces.remember(tile, m.gaps.measures, w.z, w.gaps.memory)


@njit(cache=True, error_model="numpy", forceinline=True)
def energies(tile: Tile, m: Arrays, w: Work) -> None:
    """Energies [J] of the state, into w.energy; uses w.stage."""
    width = len(tile)
    multiply_mass(tile, m, w.zdot, w.stage)
    moving = simd.spread(tile, 0.0)
    lifted = moving
    for i in range(m.unknowns):
        moving = moving + simd.load(tile, w.zdot, i * width) * simd.load(tile, w.stage, i * width)
        lifted = lifted - simd.load(tile, m.weight, i * width) * simd.load(tile, w.z, i * width)
    simd.store(w.energy, 0, 0.5 * moving)
    clear(tile, w.energy, 1)
    simd.store(w.energy, 2 * width, lifted)
    derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
    for kind in range(m.table.families):
        if m.table.energy[kind] != 0:
            family = shift(m.families, LAID * kind)
            function_pointers.call(m.table.energy[kind], (tile, family, w.z, w.element, w.energy, 1))
    simd.store(w.energy, 3 * width, simd.load(tile, w.energy, width))
    forces.add_energy(tile, m.forces, m.functions, w.z, w.memory, w.element, w.energy, 1)
    if m.gives and width == 1:
        function_pointers.call(m.table.look, (tile, m, w, w.z, w.zdot, True))
        for contact in range(m.gaps.size):
            if m.gaps.soft[contact] != gaps.RIGID and w.gaps.closed[contact] != 0.0:
                w.energy[1] += gaps.press(m.gaps, w.gaps, contact, 1, 0)[2]
