"""The tangent stiffness of a model in one sparse pattern, for implicit steps and for the stability limit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import forces, gates
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays, Model, scatter
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.pointers import pointer, raw
from shoal.mechanics.numerics.tile import Array, Index, Tile, index, pack, stacked
from shoal.mechanics.numerics.vector import add_product


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
        index([source for _, source, _ in found]),
        index([slot[key] for key, *_ in found]),
        pack(stacked([c for *_, c in found]), lanes, tile),
        len(curved),
        index([slot[key] for key, *_ in curved]),
        index([owner for _, owner, _ in curved]),
        pack(stacked([c for *_, c in curved]), lanes, tile),
    )


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
    counts = [(family, family.side) for family in model.elements]
    for family, size in (*counts, (model.forces, forces.side(model.forces))):
        for rows in family.rows[: family.size * size].reshape(family.size, size).tolist():
            for a in range(size):
                for b in range(size):
                    for i, ci in _expand(model, rows[a]):
                        for j, cj in _expand(model, rows[b]):
                            if i >= j:
                                found.append(((i, j), position + a * size + b, ci * cj))
            position += size * size
    return found, position


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
    gates.tangents(tile, m, w, z, damping_factor, block, t.blocks)
    width = len(tile)
    for i in range(slots * width):
        values[i] = mass_factor * t.mass[i]
    for k in range(t.contributions):
        add_product(tile, values, t.slot[k], t.coefficient, k, block, t.source[k])
    for k in range(t.curvatures):
        add_product(tile, values, t.curvature[k], t.bend, k, multiplier, t.owner[k])


@njit(cache=True, error_model="numpy")
def stiffness_at(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work, damping_factor: float) -> Array:
    """K + damping_factor D at the state in `room`, without constraints; (slots, lanes)."""
    width = len(tile)
    m, t, w = raw(arrays), raw(tangent), raw(room)
    gates.enter(m, w)
    derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
    derive(tile, m.derived, w.zdot, m.unknowns, m.force_rows, True)
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
