"""From a state to its acceleration: derived rows, forces, free acceleration, constraints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import friction, gauss, sparse
from shoal.mechanics.elements import ancf_cable
from shoal.mechanics.model import Arrays
from shoal.mechanics.tile import Array, Tile
from shoal.mechanics.vector import add_product, clear, copy, pointer


class Work(NamedTuple):
    """The state of one tile and the room to compute its change.

    z, zdot, a: coordinates, rates and accelerations, (rows, lanes). before: z and zdot at the
    beginning of the step. stage: room of four states for integrators. element: 24 rows.
    power: dissipated power [W], (lanes,). energy: kinetic, elastic, potential [J], (3, lanes).
    """

    z: Array
    zdot: Array
    a: Array
    before: Array
    stage: Array
    element: Array
    power: Array
    energy: Array
    gauss: gauss.GaussWork


def work_space(tile: Tile, m: Arrays) -> Work:
    """Room for the motion of one tile."""
    width = len(tile)
    rows = m.rows * width
    sizes = (rows, rows, rows, 2 * rows, 4 * rows, 24 * width, width, 3 * width)
    z, zdot, a, before, stage, element, power, energy = (np.zeros(size) for size in sizes)
    return Work(z, zdot, a, before, stage, element, power, energy, gauss.work_space(width, m))


@njit(cache=True, error_model="numpy")
def raw(w: Work) -> Work:
    """The same room as pointers."""
    return Work(
        pointer(w.z),
        pointer(w.zdot),
        pointer(w.a),
        pointer(w.before),
        pointer(w.stage),
        pointer(w.element),
        pointer(w.power),
        pointer(w.energy),
        gauss.raw(w.gauss),
    )


@njit(cache=True, error_model="numpy")
def derive(tile: Tile, m: Arrays, z: Array, last: int, moving: bool) -> None:
    """Fill the derived rows of z up to row `last`; for rates (moving) the constants do not count."""
    for row in range(m.unknowns, last):
        d = row - m.unknowns
        if moving:
            clear(tile, z, row)
        else:
            copy(tile, z, row, m.derived.constant, d)
        for t in range(m.derived.start[d], m.derived.start[d + 1]):
            add_product(tile, z, row, m.derived.coefficient, t, z, m.derived.source[t])


@njit(cache=True, error_model="numpy")
def _fold(tile: Tile, m: Arrays, f: Array) -> None:
    """Pass the forces on derived rows to the unknowns they depend on (transpose of `derive`)."""
    for row in range(m.unknowns, m.force_rows):
        d = row - m.unknowns
        for t in range(m.derived.start[d], m.derived.start[d + 1]):
            add_product(tile, f, m.derived.source[t], m.derived.coefficient, t, f, row)


@njit(cache=True, error_model="numpy")
def force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array) -> None:
    """Applied and elastic generalised forces Q on the unknowns; z, zdot, f: (rows, lanes).

    Fills the derived rows of z and zdot that forces act on, and the dissipated power.
    """
    derive(tile, m, z, m.force_rows, False)
    for row in range(m.unknowns):
        copy(tile, f, row, m.weight, row)
    for row in range(m.unknowns, m.force_rows):
        clear(tile, f, row)
    ancf_cable.add_force_full(tile, m.cables_full, z, f, w.element)
    ancf_cable.add_force_reduced(tile, m.cables_reduced, z, f, w.element)
    if m.frictions.size > 0:
        derive(tile, m, zdot, m.force_rows, True)
        friction.add_force(tile, m.frictions, z, zdot, f, w.element, w.power)
    _fold(tile, m, f)


@njit(cache=True, error_model="numpy")
def acceleration(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """The acceleration by Gauss's principle; z, zdot, a: (rows, lanes), a valid on the unknowns."""
    force(tile, m, w, t, z, zdot, a)
    sparse.solve(tile, m.pattern, m.mass_factor, a, 0)
    if m.constraints.size > 0:
        gauss.constrain(tile, m, w.gauss, t, z, zdot, a, tolerance)


@njit(cache=True, error_model="numpy")
def settle(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, iterations: int = 3) -> None:
    """Remove the drift of a constrained model (nothing to do where sharing expressed every joint)."""
    if m.constraints.size > 0:
        gauss.project(tile, m, w.gauss, t, w.z, w.zdot, tolerance, iterations)


@njit(cache=True, error_model="numpy")
def energies(tile: Tile, m: Arrays, w: Work) -> None:
    """Kinetic, elastic and gravitational energy [J] of the state, into w.energy; uses w.stage."""
    width = len(tile)
    sparse.multiply(tile, m.pattern, m.mass, w.zdot, w.stage)
    for kind in range(3):
        clear(tile, w.energy, kind)
    for i in range(m.unknowns):
        for lane in range(width):
            w.energy[lane] += 0.5 * w.zdot[i * width + lane] * w.stage[i * width + lane]
            w.energy[2 * width + lane] -= m.weight[i * width + lane] * w.z[i * width + lane]
    derive(tile, m, w.z, m.force_rows, False)
    ancf_cable.add_energy(
        tile, m.cables_full, ancf_cable.FULL_AXIAL, ancf_cable.FULL_BENDING, w.z, w.element, w.energy, 1
    )
    ancf_cable.add_energy(
        tile, m.cables_reduced, ancf_cable.REDUCED_AXIAL, ancf_cable.REDUCED_BENDING, w.z, w.element, w.energy, 1
    )
