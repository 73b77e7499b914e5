"""The tangent stiffness of a model in one sparse pattern, for implicit steps and for the stability limit."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from shoal.mechanics import dynamics, forces, model
from shoal.mechanics.dynamics import Work
from shoal.mechanics.elements import ancf_cable, ancf_full, beam
from shoal.mechanics.model import Arrays, Gates, Model, scatter
from shoal.mechanics.numerics import gate, sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile, pack
from shoal.mechanics.numerics.vector import add_product, pointer, shift


class Tangent(NamedTuple):
    """Pattern of H = c_M M + c_D D + K and the lists that assemble it, for one tile.

    Contribution k adds coefficient[k] * block[source[k]] to slot[k]; `block` holds the square tangents of all
    elements, family by family, then those of the force elements: `blocks` rows. Curvature k adds
    bend[k] * multiplier[owner[k]] to curvature[k].
    """

    pattern: sparse.Pattern
    mass: Array
    blocks: int
    contributions: int
    source: Index
    slot: Index
    coefficient: Array
    curvatures: int
    curvature: Index
    owner: Index
    bend: Array


def tangent_tile(model: Model, tile: Tile, lanes: slice) -> Tangent:
    """Analyse the tangent of a model and pack its numbers for one tile of lanes."""
    found, blocks = _contributions(model)
    entries = {key for key, *_ in found} | set(model.mass_entries)
    curved = _curvatures(model)
    entries |= {key for key, *_ in curved}
    pattern, slot = sparse.analyse(model.unknowns, entries)
    return Tangent(
        pattern,
        pack(scatter(pattern, slot, model.mass_entries), lanes, tile),
        blocks,
        len(found),
        np.array([source for _, source, _ in found], dtype=np.int64),
        np.array([slot[key] for key, *_ in found], dtype=np.int64),
        pack(_stack(found), lanes, tile),
        len(curved),
        np.array([slot[key] for key, *_ in curved], dtype=np.int64),
        np.array([owner for _, owner, _ in curved], dtype=np.int64),
        pack(_stack(curved), lanes, tile),
    )


def _stack(found: list[tuple[tuple[int, int], int, Array]]) -> Array:
    values = np.empty((len(found), max((np.size(c) for *_, c in found), default=1)))
    for row, (*_, c) in enumerate(found):
        values[row] = c
    return values


def _expand(model: Model, row: int) -> list[tuple[int, Array]]:
    """The unknowns that a row depends on, with their factors."""
    if row < model.unknowns:
        return [(row, np.ones(1))]
    d, r = model.derived, row - model.unknowns
    return [(int(d.source[t]), d.coefficient[t]) for t in range(d.start[r], d.start[r + 1])]


def _curvatures(model: Model) -> list[tuple[tuple[int, int], int, Array]]:
    """((row, column), constraint, second derivative) for the lower triangle."""
    c = model.constraints
    found = []
    for k in range(c.size):
        for p in range(c.start[k], c.start[k + 1]):
            if c.left[p] < 0:
                continue
            for i, ci in _expand(model, int(c.left[p])):
                for j, cj in _expand(model, int(c.right[p])):
                    value = c.factor[p] * ci * cj
                    found.append(((max(i, j), min(i, j)), k, 2.0 * value if i == j else value))
    return found


def _contributions(model: Model) -> tuple[list[tuple[tuple[int, int], int, Array]], int]:
    """((row, column), position in the stored blocks, coefficient) for the lower triangle, and the blocks' length."""
    found = []
    position = 0
    for family in (*model.elements, model.forces):
        size = len(family.rows) // family.size if family.size else 0
        for rows in family.rows.reshape(family.size, size).tolist():
            for a in range(size):
                for b in range(size):
                    for i, ci in _expand(model, rows[a]):
                        for j, cj in _expand(model, rows[b]):
                            if i >= j:
                                found.append(((i, j), position + a * size + b, ci * cj))
            position += size * size
    return found, position


@njit(cache=True, error_model="numpy")
def raw(t: Tangent) -> Tangent:
    """The same lists with pointers in place of arrays."""
    return Tangent(
        sparse.raw(t.pattern),
        pointer(t.mass),
        t.blocks,
        t.contributions,
        pointer(t.source),
        pointer(t.slot),
        pointer(t.coefficient),
        t.curvatures,
        pointer(t.curvature),
        pointer(t.owner),
        pointer(t.bend),
    )


@njit(cache=True, error_model="numpy")
def _stiffness_blocks(tile: Tile, m: Arrays, w: Work, z: Array, block: Array) -> None:
    """The tangents of all elements, family by family, then of the forces."""
    e = m.elements
    first = 0
    ancf_cable.tangent(tile, e.cables_full, ancf_cable.FULL_AXIAL, ancf_cable.FULL_BENDING, z, w.element, block, first)
    first += 64 * e.cables_full.size
    ancf_cable.tangent(
        tile, e.cables_reduced, ancf_cable.REDUCED_AXIAL, ancf_cable.REDUCED_BENDING, z, w.element, block, first
    )
    first += 64 * e.cables_reduced.size
    beam.tangent(tile, e.cubics, z, w.element, block, first)
    first += 64 * e.cubics.size
    beam.tangent(tile, e.quintics, z, w.element, block, first)
    first += 144 * e.quintics.size
    ancf_full.tangent(tile, e.solids, z, w.element, block, first)
    first += 144 * e.solids.size
    ancf_full.tangent(tile, e.two_point_solids, z, w.element, block, first)
    first += 144 * e.two_point_solids.size
    forces.tangent(tile, m.forces, m.functions, z, w.memory, w.element, block, first)


@njit(cache=True, error_model="numpy")
def _damping_blocks(tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array, block: Array, size: int) -> None:
    """The same of the damping."""
    e = m.elements
    for i in range(size * len(tile)):
        block[i] = 0.0
    first = 64 * (e.cables_full.size + e.cables_reduced.size)
    if e.cubics.damped:
        beam.damping(tile, e.cubics, z, w.element, block, first)
    first += 64 * e.cubics.size
    if e.quintics.damped:
        beam.damping(tile, e.quintics, z, w.element, block, first)
    first += 144 * (e.quintics.size + e.solids.size + e.two_point_solids.size)
    forces.damping(tile, m.forces, z, zdot, w.element, block, first)


@njit(cache=True, error_model="numpy")
def assemble(
    tile: Tile,
    m: Arrays,
    t: Tangent,
    w: Work,
    z: Array,
    multiplier: Array,
    mass_factor: float,
    damping_factor: float,
    block: Array,
    values: Array,
    slots: int,
) -> None:
    """values = mass_factor M + damping_factor D + K(z) + curvature of the constraints; (slots, lanes).

    multiplier: one lambda per constraint, (constraints, lanes); block: work space of 2 t.blocks rows.
    The derived rows of z, and those of w.zdot where anything is damped, must be filled. Pointers.
    """
    arguments = (gate.typed(m.home, m), gate.typed(w.home, w), z, damping_factor, block, t.blocks)
    gate.call(m.gates.assemble, (tile, *arguments))
    width = len(tile)
    for i in range(slots * width):
        values[i] = mass_factor * t.mass[i]
    for k in range(t.contributions):
        add_product(tile, values, t.slot[k], t.coefficient, k, block, t.source[k])
    for k in range(t.curvatures):
        add_product(tile, values, t.curvature[k], t.bend, k, multiplier, t.owner[k])


@njit(cache=True, error_model="numpy")
def _assemble_gate(tile, pm, pw, z, damping_factor, block, blocks):  # type: ignore[no-untyped-def]
    """K + damping_factor D of every element and force, block by block."""
    m, w = gate.load(pm), gate.load(pw)
    width = len(tile)
    _stiffness_blocks(tile, m, w, z, block)
    if damping_factor != 0.0 and (m.forces.size > 0 or m.elements.cubics.damped or m.elements.quintics.damped):
        other = shift(block, blocks * width)
        _damping_blocks(tile, m, w, z, w.zdot, other, blocks)
        for i in range(blocks * width):
            block[i] += damping_factor * other[i]


_GATES: dict[int, Gates] = {}


def ready(tile: Tile, arrays: Arrays, room: Work) -> Arrays:
    """The same arrays with a home of their own and the gates for this width, compiled or taken from the cache."""
    if len(tile) not in _GATES:
        _GATES[len(tile)] = dynamics.gates(tile, arrays, room, _assemble_address)
    return arrays._replace(home=gate.home(), gates=_GATES[len(tile)])


def _assemble_address(width: Any, m: Any, w: Any) -> int:
    """The gate of the element tangents for one width."""
    rows = types.CPointer(types.float64)
    return gate.address(_assemble_gate, (width, m, w, rows, types.float64, rows, types.int64))


@njit(cache=True, error_model="numpy")
def stiffness_at(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work, damping_factor: float) -> Array:
    """K + damping_factor D at the state in `room`, without constraints; (slots, lanes)."""
    width = len(tile)
    m, t, w = model.raw(arrays), raw(tangent), dynamics.raw(room)
    dynamics.enter(m, w)
    dynamics.derive(tile, m, w.z, m.force_rows, False)
    dynamics.derive(tile, m, w.zdot, m.force_rows, True)
    block = np.empty(2 * tangent.blocks * width + 1)
    values = np.empty(tangent.mass.size)
    multiplier = np.zeros(m.constraints.size * width + 1)
    assemble(
        tile,
        m,
        t,
        w,
        w.z,
        pointer(multiplier),
        0.0,
        damping_factor,
        pointer(block),
        pointer(values),
        tangent.mass.size // width,
    )
    # The work arrays are used once more so that they live as long as their pointers.
    return values + 0.0 * (block.size + multiplier.size)
