"""The tangent stiffness of a model in one sparse pattern, for implicit steps and for the stability limit."""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers, simd
from shoal.compile.pointers import pointer, raw, raw_type, shift
from shoal.compile.structures import Reference
from shoal.compile.vector import add, add_product
from shoal.mechanics import forces, kernels, saddle
from shoal.mechanics.dynamics import Work, derived_rows, rows_kernel, work_space
from shoal.mechanics.elements.families import LAID
from shoal.mechanics.model import Arrays, Model, scatter, seen
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile, index, pack, stacked

_ONE = np.ones(1)


class Held(NamedTuple):
    """[H C_q'; C_q 0] in one pattern: what `saddle.Saddle` says of it. Without constraints nothing.

    place: position of every coordinate, then of every multiplier; slot: of every entry of the Jacobian; multiplier:
    whether a position is that of a multiplier.
    """

    place: Index
    slot: Index
    multiplier: Index


class Tangent(NamedTuple):
    """Pattern of H = c_M M + c_D D + K and the lists that assemble it, for one tile.

    mass: the regularised M: iterations converge all the same, and a nearly flat body does not limit the stable
    step.
    `block` holds the square tangents of all elements, family by family, then those of the force elements: `blocks`
    rows. Its row source[s] adds to slot s, where none does, a row of zeros behind two such blocks; row more[k] adds to
    slot also[k], too. Share k adds part[k] * block[shared[k]] to slot[k], for elements whose rows are sums of
    coordinates. Curvature k adds bend[k] * multiplier[owner[k]] to
    curvature[k]. By family: sizes, rows of its blocks; stiffness, the address of its kernel; damped, 1 or 0. assemble:
    address of the kernel of `assemble`, see `assembled`. held: where the constraints' rows are.
    """

    pattern: sparse.Pattern
    mass: Array
    blocks: int
    source: Index
    extra: int
    more: Index
    also: Index
    shares: int
    shared: Index
    slot: Index
    part: Array
    curvatures: int
    curvature: Index
    owner: Index
    bend: Array
    sizes: Index
    stiffness: Index
    damped: Index
    assemble: int
    held: Held


def tangent_tile(model: Model, tile: Tile, lanes: slice, *, held: bool = False) -> Tangent:
    """Analyse the tangent of a model, and pack its numbers for one tile of lanes; held: with room for constraints."""
    found, blocks = _contributions(model)
    entries = {key for key, *_ in found} | set(model.metric_entries)
    curved = _curvatures(model)
    entries |= {key for key, *_ in curved}
    if held and model.constraints.size:
        rows = np.arange(model.constraints.size)
        pattern, slot, place, jacobian = saddle.analyse(model.unknowns, entries, model.constraints, rows)
        multiplier = np.zeros(pattern.size, dtype=np.int64)
        multiplier[place[model.unknowns :]] = 1
        constrained = Held(place, jacobian, multiplier)
    else:
        pattern, slot = sparse.analyse(model.unknowns, entries)
        constrained = Held(*(np.zeros(0, dtype=np.int64),) * 3)
    source: Index = np.full(pattern.slots, 2 * blocks)
    extra = []
    for key, row, c in found:
        if _is_one(c):
            if source[slot[key]] < 2 * blocks:
                extra.append((slot[key], row))
            else:
                source[slot[key]] = row
    shares = [(slot[key], source, c) for key, source, c in found if not _is_one(c)]
    return Tangent(
        pattern,
        pack(scatter(pattern, slot, model.metric_entries), lanes, tile),
        blocks,
        source,
        len(extra),
        np.array([row for _, row in extra], dtype=np.int32),
        np.array([place for place, _ in extra], dtype=np.int32),
        len(shares),
        index([source for _, source, _ in shares]),
        index([place for place, *_ in shares]),
        pack(stacked([c for *_, c in shares]), lanes, tile),
        len(curved),
        index([slot[key] for key, *_ in curved]),
        index([owner for _, owner, _ in curved]),
        pack(stacked([c for *_, c in curved]), lanes, tile),
        index([family.side * family.side * family.size for family in model.elements]),
        kernels.family_pointers("stiffness", tile, model.elements),
        index([1 if family.damped else 0 for family in model.elements]),
        0,
        constrained,
    )


def _is_one(c: Array) -> bool:
    return c is _ONE or bool(np.all(c == 1.0))


def _expand(model: Model, row: int) -> list[tuple[int, Array]]:
    """The unknowns that a row depends on, with their factors."""
    if row < model.unknowns:
        return [(row, _ONE)]
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
    for family, size in (*counts, (model.forces, 3 * model.forces.dimensions)):
        for rows in family.rows[: family.size * size].reshape(family.size, size).tolist():
            expanded = [_expand(model, row) for row in rows]
            for a, b in itertools.product(range(size), repeat=2):
                for i, ci in expanded[a]:
                    for j, cj in expanded[b]:
                        if i >= j:
                            found.append(((i, j), position + a * size + b, ci if cj is _ONE else ci * cj))
            position += size * size
    return found, position


def assembled(model: Model, tile: Tile, lanes: slice, tangent: Tangent) -> Tangent:
    """Return a tangent with the kernel of `assemble`, compiled or from the cache."""

    def kernel() -> kernels.Kernel:
        arrays = model.tile(tile, lanes)
        return assembly(tile, arrays, work_space(tile, arrays), tangent)

    return tangent._replace(assemble=kernels.address(("assemble", len(tile)), kernel))


def assembly(tile: Tile, arrays: Arrays, room: Work, tangent: Tangent) -> kernels.Kernel:
    """Return the kernel of `assemble` with the types of its arguments."""
    m, t, w = (Reference(raw_type(typeof(part))) for part in (seen(arrays), tangent, room))
    number, rows = types.float64, types.CPointer(types.float64)
    return _assemble, (typeof(tile), m, t, w, rows, rows, number, number, rows, rows, types.int64)


@njit(cache=True, error_model="numpy", forceinline=True)
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

    multiplier: one lambda per constraint, (constraints, lanes); block: work space of 2 t.blocks rows and one of zeros.
    The derived rows of z, and those of w.zdot where anything is damped, must be filled. Pointers.
    """
    function_pointers.call(
        t.assemble, (tile, m, t, w, z, multiplier, mass_factor, damping_factor, block, values, slots)
    )


@njit(cache=True, error_model="numpy")
def _assemble(tile, m, t, w, z, multiplier, mass_factor, damping_factor, block, values, slots):  # type: ignore[no-untyped-def]
    width, end = len(tile), t.blocks * len(tile)
    damped = damping_factor != 0.0 and (m.forces.size > 0 or m.damped)
    for part in range(2 if damped else 1):
        _fill(tile, m, t, w, z, shift(block, part * end), part == 1)
    if damped:
        for i in range(end):
            block[i] += damping_factor * block[end + i]
    for slot in range(slots):
        first = simd.load(tile, block, t.source[slot] * width)
        simd.store(values, slot * width, mass_factor * simd.load(tile, t.mass, slot * width) + first)
    for k in range(t.extra):
        add(tile, values, t.also[k], block, t.more[k])
    for k in range(t.shares):
        add_product(tile, values, t.slot[k], t.part, k, block, t.shared[k])
    for k in range(t.curvatures):
        add_product(tile, values, t.curvature[k], t.bend, k, multiplier, t.owner[k])


@njit(cache=True, error_model="numpy")
def _fill(tile: Tile, m: Arrays, t: Tangent, w: Work, z: Array, block: Array, viscous: bool) -> None:
    """The stiffness of all elements, or their damping, family by family, then of the forces."""
    first = 0
    for i in range(t.blocks * len(tile) if viscous else 0):
        block[i] = 0.0
    for kind in range(m.table.families):
        if t.stiffness[kind] != 0 and (t.damped[kind] != 0 or not viscous):
            family = shift(m.families, LAID * kind)
            function_pointers.call(t.stiffness[kind], (tile, family, z, w.element, block, first, viscous))
        first += t.sizes[kind]
    if viscous:
        forces.damping(tile, m.forces, z, w.zdot, w.element, block, first)
    else:
        forces.tangent(tile, m.forces, m.functions, z, w.memory, w.element, block, first)


def stiffness_at(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work) -> Array:
    """K at the state in `room`, without constraints; (slots, lanes)."""
    block, first = _of_elements(tile, arrays, tangent, room, viscous=False)
    if arrays.forces.size > 0:
        _of_forces(tile, arrays.forces, arrays.functions, room.z, room.memory, room.element, block, first)
    return _assembled(tile, tangent, block)


def damping_at(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work) -> Array:
    """D at the state in `room`, (slots, lanes)."""
    block, first = _of_elements(tile, arrays, tangent, room, viscous=True)
    if arrays.forces.size > 0:
        _of_dampers(tile, arrays.forces, room.z, room.zdot, room.element, block, first)
    return _assembled(tile, tangent, block)


def _of_elements(tile: Tile, arrays: Arrays, tangent: Tangent, room: Work, *, viscous: bool) -> tuple[Array, int]:
    """Blocks of all elements at the state in `room`, (blocks, lanes), and the number of their rows."""
    derived_rows(tile, arrays, room)
    block, first = np.zeros(tangent.blocks * len(tile)), 0
    for kind, family in enumerate(arrays.elements):
        if family.size > 0 and (family.damped or not viscous):
            place, address = arrays.families[LAID * kind :], int(tangent.stiffness[kind])
            _of_family(tile, address, place, room.z, room.element, block, first, viscous)
        first += int(tangent.sizes[kind])
    return block, first


def _assembled(tile: Tile, t: Tangent, block: Array) -> Array:
    width = len(tile)
    rows = np.concatenate([block, np.zeros((t.blocks + 1) * width)]).reshape(-1, width)
    values = rows[t.source]
    np.add.at(values, t.also, rows[t.more])
    np.add.at(values, t.slot, t.part.reshape(-1, width) * rows[t.shared])
    return values.ravel()


def signatures(tile: Tile, arrays: Arrays, room: Work) -> list[kernels.Kernel]:
    """Return the kernels of `stiffness_at` and `damping_at`, with the types of their arguments.

    Of lanes the stability limit needs those of the stiffness.
    """
    lanes, rows, number = typeof(tile), typeof(room.z), types.int64
    springs, functions = typeof(arrays.forces), typeof(arrays.functions)
    of_family = _of_family, (lanes, number, *(rows,) * 4, number, types.boolean)
    of_forces = _of_forces, (lanes, springs, functions, rows, rows, rows, rows, number)
    of_dampers = _of_dampers, (lanes, springs, rows, rows, rows, rows, number)
    found = [rows_kernel(tile, arrays, room), of_family, of_forces]
    return [*found, of_dampers] if len(tile) == 1 else found


# These take the structures that they need and no others: a kernel takes seconds to compile that is handed them all.


@njit(cache=True, error_model="numpy")
def _of_family(
    tile: Tile, address: int, family: Array, z: Array, w: Array, block: Array, first: int, viscous: bool
) -> None:
    """Run the kernel at an address for a family at its place, see `families.lay`."""
    function_pointers.call(address, (tile, pointer(family), pointer(z), pointer(w), pointer(block), first, viscous))


@njit(cache=True, error_model="numpy")
def _of_forces(
    tile: Tile, springs: Any, functions: Any, z: Array, memory: Array, w: Array, block: Array, first: int
) -> None:
    forces.tangent(tile, raw(springs), raw(functions), pointer(z), pointer(memory), pointer(w), pointer(block), first)


@njit(cache=True, error_model="numpy")
def _of_dampers(tile: Tile, springs: Any, z: Array, zdot: Array, w: Array, block: Array, first: int) -> None:
    forces.damping(tile, raw(springs), pointer(z), pointer(zdot), pointer(w), pointer(block), first)
