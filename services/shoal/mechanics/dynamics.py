"""From a state to its acceleration: derived rows, forces, free acceleration, constraints."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.mechanics import applied, forces, model
from shoal.mechanics.elements import ancf_cable, ancf_full, beam
from shoal.mechanics.least import constraints, gauss
from shoal.mechanics.model import Arrays, Gates
from shoal.mechanics.numerics import gate, sparse
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.mechanics.numerics.vector import add_product, clear, copy, pointer

ELEMENT_ROWS = 64
ALL, ELASTIC, SIMPLE, ACCELERATION = 0, 1, 2, 3
"""Parts of the force: everything, the elastic part, the elastic part but for elements that know their mean
force; or the acceleration that follows from everything."""


class Work(NamedTuple):
    """The state of one tile and the room to compute its change.

    z, zdot, a: coordinates, rates and accelerations, (rows, lanes). before: z, zdot and a at the
    beginning of the step. stage: room of four states for integrators. element: 64 rows. memory: the
    continuous angle of every force element, (forces, lanes). power: dissipated minus supplied power
    [W], (lanes,). energy: kinetic, elastic, potential [J], (3, lanes). until: the last instant [s] before
    functions of time may jump, (1,); what is asked for later, is asked for then.
    """

    home: Array
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
    gauss: gauss.GaussWork


def work_space(tile: Tile, m: Arrays) -> Work:
    """Room for the motion of one tile."""
    width = len(tile)
    rows = m.rows * width
    sizes = (rows, rows, rows, 3 * rows, 4 * rows, ELEMENT_ROWS * width, m.forces.size * width, width, 3 * width)
    z, zdot, a, before, stage, element, memory, power, energy = (np.zeros(size) for size in sizes)
    return Work(
        gate.home(),
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
        gauss.work_space(width, m),
    )


@njit(cache=True, error_model="numpy")
def raw(w: Work) -> Work:
    """The same room as pointers."""
    return Work(
        pointer(w.home),
        pointer(w.z),
        pointer(w.zdot),
        pointer(w.a),
        pointer(w.before),
        pointer(w.stage),
        pointer(w.element),
        pointer(w.memory),
        pointer(w.power),
        pointer(w.energy),
        pointer(w.until),
        gauss.raw(w.gauss),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def instant(w: Work, t: float) -> float:
    """The time [s] at which functions of time are to be asked: a step that ends at a jump knows its left side only."""
    return min(t, w.until[0])  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy", forceinline=True)
def derive(tile: Tile, m: Arrays, z: Array, last: int, moving: bool) -> None:
    """Fill the derived rows of z up to row `last`; for rates (moving) the constants do not count."""
    gauss.derive(tile, m, z, m.unknowns, last, moving)


@njit(cache=True, error_model="numpy")
def derived_rows(tile: Tile, arrays: Arrays, room: Work) -> None:
    """Fill all derived rows of the state in `room`. Arrays, not pointers."""
    m, w = model.raw(arrays), raw(room)
    derive(tile, m, w.z, m.rows, False)
    derive(tile, m, w.zdot, m.rows, True)


@njit(cache=True, error_model="numpy")
def _fold(tile: Tile, m: Arrays, f: Array) -> None:
    """Pass the forces on derived rows to the unknowns they depend on (transpose of `derive`)."""
    for row in range(m.unknowns, m.force_rows):
        d = row - m.unknowns
        for t in range(m.derived.start[d], m.derived.start[d + 1]):
            add_product(tile, f, m.derived.source[t], m.derived.coefficient, t, f, row)


@njit(cache=True, error_model="numpy", forceinline=True)
def loaded(m: Arrays) -> bool:
    """Whether forces depend on rates or on time."""
    e = m.elements
    return m.driven or m.forces.size + m.applied.fixed + m.applied.following > 0 or e.cubics.damped or e.quintics.damped


@njit(cache=True, error_model="numpy")
def enter(m: Arrays, w: Work) -> None:
    """Store both structures where the gates find them; at the beginning of a compiled loop."""
    gate.store(m.home, m)
    gate.store(w.home, w)


@njit(cache=True, error_model="numpy", forceinline=True)
def force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array) -> None:
    """Applied and elastic generalised forces Q on the unknowns; z, zdot, f: (rows, lanes).

    Fills the derived rows of z and zdot that forces act on, and the dissipated minus supplied power.
    """
    t = instant(w, t)
    gate.call(m.gates.motion, (tile, gate.typed(m.home, m), gate.typed(w.home, w), t, z, zdot, 0.0, f, ALL))


@njit(cache=True, error_model="numpy", forceinline=True)
def elastic_force(tile: Tile, m: Arrays, w: Work, z: Array, f: Array, exact: bool) -> None:
    """The elastic part of Q; exact: without the elements of `add_mean_force`. Fills the derived rows of z."""
    part = SIMPLE if exact else ELASTIC
    gate.call(m.gates.motion, (tile, gate.typed(m.home, m), gate.typed(w.home, w), 0.0, z, z, 0.0, f, part))


@njit(cache=True, error_model="numpy")
def add_mean_force(tile: Tile, m: Arrays, w: Work, before: Array, after: Array, f: Array) -> None:
    """Add the force of those elements whose mean over a step does exactly the work of their energy (Simo, Tarnow)."""
    ancf_full.add_mean_force(tile, m.elements.solids, before, after, f, w.element)
    ancf_full.add_mean_force(tile, m.elements.two_point_solids, before, after, f, w.element)


@njit(cache=True, error_model="numpy", forceinline=True)
def _force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array, part: int) -> None:
    derive(tile, m, z, m.force_rows, False)
    for row in range(m.force_rows):
        clear(tile, f, row)
    e = m.elements
    moving = part in (ALL, ACCELERATION)
    if moving:
        for row in range(m.unknowns):
            copy(tile, f, row, m.weight, row)
    if loaded(m):
        for lane in range(len(tile)):
            w.power[lane] = 0.0
        if moving:
            derive(tile, m, zdot, m.force_rows, True)
            applied.add_force(tile, m.applied, m.functions, t, z, zdot, f, w.power)
        forces.add_force(tile, m.forces, m.functions, t, z, zdot, w.memory, f, w.element, w.power, moving)
    ancf_cable.add_force_full(tile, e.cables_full, z, f, w.element)
    ancf_cable.add_force_reduced(tile, e.cables_reduced, z, f, w.element)
    if e.cubics.size + e.quintics.size > 0:
        beam.add_force(tile, e.cubics, z, zdot, f, w.element, w.power, moving)
        beam.add_force(tile, e.quintics, z, zdot, f, w.element, w.power, moving)
    if part != SIMPLE and e.solids.size + e.two_point_solids.size > 0:
        ancf_full.add_force(tile, e.solids, z, f, w.element)
        ancf_full.add_force(tile, e.two_point_solids, z, f, w.element)
    _fold(tile, m, f)


@njit(cache=True, error_model="numpy", forceinline=True)
def acceleration(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """The acceleration by Gauss's principle; z, zdot, a: (rows, lanes), a valid on the unknowns."""
    t = instant(w, t)
    arguments = (gate.typed(m.home, m), gate.typed(w.home, w), t, z, zdot, tolerance, a, ACCELERATION)
    gate.call(m.gates.motion, (tile, *arguments))


@njit(cache=True, error_model="numpy")
def _motion_gate(tile, pm, pw, t, z, zdot, tolerance, a, part):  # type: ignore[no-untyped-def]
    """A part of the force, or the acceleration."""
    m, w = gate.load(pm), gate.load(pw)
    _force(tile, m, w, t, z, zdot, a, part)
    if part == ACCELERATION:
        if m.constraints.size > 0:
            gauss.constrain(tile, m, w.gauss, t, z, zdot, a, tolerance)
            if m.driven:
                constraints.add_power(tile, m.constraints, m.functions, t, w.gauss.multiplier, w.power)
        elif m.alike:
            sparse.solve_alike(tile, m.pattern, m.alike_factor, a, 0)
        else:
            sparse.solve(tile, m.pattern, m.mass_factor, a, 0)


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
def _settle_gate(tile, pm, pw, t, tolerance, iterations):  # type: ignore[no-untyped-def]
    m, w = gate.load(pm), gate.load(pw)
    gauss.project(tile, m, w.gauss, t, w.z, w.zdot, tolerance, iterations)


@njit(cache=True, error_model="numpy", forceinline=True)
def remember(tile: Tile, m: Arrays, w: Work) -> None:
    """Count the turns of angle forces after a step."""
    if m.forces.size > 0:
        derive(tile, m, w.z, m.force_rows, False)
        forces.remember(tile, m.forces, w.z, w.memory)


@njit(cache=True, error_model="numpy", forceinline=True)
def energies(tile: Tile, m: Arrays, w: Work) -> None:
    """Kinetic, elastic and gravitational energy [J] of the state, into w.energy; uses w.stage."""
    gate.call(m.gates.energies, (tile, gate.typed(m.home, m), gate.typed(w.home, w)))


@njit(cache=True, error_model="numpy")
def _energies_gate(tile, pm, pw):  # type: ignore[no-untyped-def]
    m, w = gate.load(pm), gate.load(pw)
    width = len(tile)
    sparse.multiply(tile, m.pattern, m.mass, w.zdot, w.stage)
    for kind in range(3):
        clear(tile, w.energy, kind)
    for i in range(m.unknowns):
        for lane in range(width):
            w.energy[lane] += 0.5 * w.zdot[i * width + lane] * w.stage[i * width + lane]
            w.energy[2 * width + lane] -= m.weight[i * width + lane] * w.z[i * width + lane]
    derive(tile, m, w.z, m.force_rows, False)
    _elastic_energy(tile, m, w, w.z, w.energy, 1)


@njit(cache=True, error_model="numpy")
def _elastic_energy(tile: Tile, m: Arrays, w: Work, z: Array, energy: Array, row: int) -> None:
    """Add the elastic energy [J] to a row of energy; the derived rows of z must be filled."""
    e = m.elements
    ancf_cable.add_energy(
        tile, e.cables_full, ancf_cable.FULL_AXIAL, ancf_cable.FULL_BENDING, z, w.element, energy, row
    )
    ancf_cable.add_energy(
        tile, e.cables_reduced, ancf_cable.REDUCED_AXIAL, ancf_cable.REDUCED_BENDING, z, w.element, energy, row
    )
    beam.add_energy(tile, e.cubics, z, w.element, energy, row)
    beam.add_energy(tile, e.quintics, z, w.element, energy, row)
    ancf_full.add_energy(tile, e.solids, z, w.element, energy, row)
    ancf_full.add_energy(tile, e.two_point_solids, z, w.element, energy, row)
    forces.add_energy(tile, m.forces, m.functions, z, w.memory, w.element, energy, row)


def gates(tile: Tile, arrays: Arrays, room: Work, assemble: Any) -> Gates:
    """Compile the kernels for one width, or take them from the cache; assemble: the gate of tangent.py."""
    m = types.CPointer(gate.returned(model.raw, arrays))
    w = types.CPointer(gate.returned(raw, room))
    width, number, rows = typeof(tile), types.float64, types.CPointer(types.float64)
    return Gates(
        gate.address(_motion_gate, (width, m, w, number, rows, rows, number, rows, types.int64)),
        gate.address(_settle_gate, (width, m, w, number, number, types.int64)),
        gate.address(_energies_gate, (width, m, w)),
        assemble(width, m, w),
    )
