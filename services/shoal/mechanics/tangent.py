"""The tangent stiffness of a model in one sparse pattern, for implicit steps and for the stability limit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import dynamics, friction, model, sparse
from shoal.mechanics.dynamics import Work
from shoal.mechanics.elements import ancf_cable
from shoal.mechanics.model import Arrays, Model, scatter
from shoal.mechanics.tile import Array, Index, Tile, pack
from shoal.mechanics.vector import add_product, pointer


class Tangent(NamedTuple):
    """Pattern of H = c_M M + c_D D + K and the lists that assemble it, for one tile.

    Contribution t adds coefficient[t] * block[source[t]] to slot[t]; `block` holds the 8 x 8 tangents
    of the full, then the reduced cables. The friction lists do the same for the products of levers.
    curvature[t] is the slot of constraint term t (-1: the term is not quadratic).
    """

    pattern: sparse.Pattern
    mass: Array
    elastic_count: int
    source: Index
    slot: Index
    coefficient: Array
    friction_count: int
    friction_source: Index
    friction_slot: Index
    friction_coefficient: Array
    curvature: Index


def tangent_tile(scene_model: Model, tile: Tile, lanes: slice) -> Tangent:
    """Analyse the tangent of a model and pack its numbers for one tile of lanes."""
    rows = np.concatenate([scene_model.cables_full.rows, scene_model.cables_reduced.rows])
    elastic = _contributions(scene_model, rows.reshape(-1, ancf_cable.ROWS).tolist())
    viscous = _contributions(scene_model, scene_model.frictions.rows.reshape(-1, 4).tolist())
    entries = {key for key, *_ in elastic} | {key for key, *_ in viscous} | set(scene_model.mass_entries)
    quadratic = [
        (max(i, j), min(i, j)) if i >= 0 and j >= 0 else None
        for i, j in zip(scene_model.constraints.first.tolist(), scene_model.constraints.second.tolist(), strict=True)
    ]
    entries |= {key for key in quadratic if key is not None}
    pattern, slot = sparse.analyse(scene_model.unknowns, entries)

    def lists(contributions: list[tuple[tuple[int, int], int, Array]]) -> tuple[int, Index, Index, Array]:
        lane_count = max((c.size for *_, c in contributions), default=1)
        values = np.empty((len(contributions), lane_count))
        for row, (*_, c) in enumerate(contributions):
            values[row] = c
        return (
            len(contributions),
            np.array([source for _, source, _ in contributions], dtype=np.int64),
            np.array([slot[key] for key, *_ in contributions], dtype=np.int64),
            pack(values, lanes, tile),
        )

    return Tangent(
        pattern,
        pack(scatter(pattern, slot, scene_model.mass_entries), lanes, tile),
        *lists(elastic),
        *lists(viscous),
        np.array([-1 if key is None else slot[key] for key in quadratic], dtype=np.int64),
    )


def _contributions(scene_model: Model, blocks: list[list[int]]) -> list[tuple[tuple[int, int], int, Array]]:
    """((row, column), position in the stored blocks, coefficient) for the lower triangle of all blocks."""
    expansions: dict[int, list[tuple[int, Array]]] = {}
    d = scene_model.derived

    def expand(row: int) -> list[tuple[int, Array]]:
        if row not in expansions:
            if row < scene_model.unknowns:
                expansions[row] = [(row, np.ones(1))]
            else:
                r = row - scene_model.unknowns
                terms = range(d.start[r], d.start[r + 1])
                expansions[row] = [(int(d.source[t]), d.coefficient[t]) for t in terms]
        return expansions[row]

    found = []
    for number, rows in enumerate(blocks):
        size = len(rows)
        for a in range(size):
            for b in range(size):
                position = number * size * size + a * size + b
                for i, ci in expand(rows[a]):
                    for j, cj in expand(rows[b]):
                        if i >= j:
                            found.append(((i, j), position, ci * cj))
    return found


@njit(cache=True, error_model="numpy")
def raw(t: Tangent) -> Tangent:
    """The same lists with pointers in place of arrays."""
    return Tangent(
        sparse.raw(t.pattern),
        pointer(t.mass),
        t.elastic_count,
        pointer(t.source),
        pointer(t.slot),
        pointer(t.coefficient),
        t.friction_count,
        pointer(t.friction_source),
        pointer(t.friction_slot),
        pointer(t.friction_coefficient),
        pointer(t.curvature),
    )


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

    multiplier: one lambda per constraint, (constraints, lanes); block: work space, (elements * 64, lanes).
    The derived rows of z must be filled. Pointers.
    """
    width = len(tile)
    for i in range(slots * width):
        values[i] = mass_factor * t.mass[i]
    full = m.cables_full.size
    ancf_cable.tangent(tile, m.cables_full, ancf_cable.FULL_AXIAL, ancf_cable.FULL_BENDING, z, w.element, block, 0)
    ancf_cable.tangent(
        tile,
        m.cables_reduced,
        ancf_cable.REDUCED_AXIAL,
        ancf_cable.REDUCED_BENDING,
        z,
        w.element,
        block,
        64 * full,
    )
    for k in range(t.elastic_count):
        add_product(tile, values, t.slot[k], t.coefficient, k, block, t.source[k])
    previous = -1
    for k in range(t.friction_count):
        joint, a, b = t.friction_source[k] // 16, t.friction_source[k] % 16 // 4, t.friction_source[k] % 4
        if joint != previous:
            friction.levers(tile, m.frictions, joint, z, w.element)
            previous = joint
        for lane in range(width):
            c = damping_factor * m.frictions.coefficient[joint * width + lane]
            values[t.friction_slot[k] * width + lane] += (
                t.friction_coefficient[k * width + lane] * c * w.element[a * width + lane] * w.element[b * width + lane]
            )
    c = m.constraints
    for number in range(c.size):
        for term in range(c.start[number], c.start[number + 1]):
            if t.curvature[term] >= 0:
                scale = 2.0 if c.first[term] == c.second[term] else 1.0
                for lane in range(width):
                    values[t.curvature[term] * width + lane] += (
                        scale * multiplier[number * width + lane] * c.value[term * width + lane]
                    )


@njit(cache=True, error_model="numpy")
def stiffness_at(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work, damping_factor: float) -> Array:
    """K + damping_factor D at the state in `room`, without constraints; (slots, lanes)."""
    width = len(tile)
    m, t, w = model.raw(arrays), raw(tangent), dynamics.raw(room)
    dynamics.derive(tile, m, w.z, m.force_rows, False)
    block = np.empty(64 * (m.cables_full.size + m.cables_reduced.size) * width)
    values = np.empty(tangent.mass.size)
    multiplier = np.zeros(m.constraints.size * width)
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
