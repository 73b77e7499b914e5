"""Least constraint as one sparse saddle point problem, of linear cost, for regular positions.

[M C_q'; C_q 0] [a; lambda] = [Q; -eta] is factored as L D L' in an order of least fill in which every multiplier
comes after its coordinates. The pivot of a multiplier is then minus the square of the remainder of its row, in the
mass metric, after elimination of the rows before it; one that vanishes against its first value marks a row that
depends on the others. Its distance from singular enters squared. So machines with few constraints take the orthogonal
projection near singular positions; with many, the row is left out, and a position counts as singular earlier than
with the projection. Implicit steps solve [H C_q'; C_q 0] in the same way, with the
tangent H of the step and any number of constraints.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.compile import simd
from shoal.compile.vector import copy
from shoal.mechanics.constraints import Constraints
from shoal.mechanics.numerics import sparse
from shoal.mechanics.numerics.tile import Array, Index, Tile

SMALL = 16
"""Up to so many constraints the orthogonal projection is used near singular positions, where it is more accurate."""
FEW = 64
"""Up to so many those that depend on others are left out of the problem, see `independent`."""
REGULAR = 1e-4
"""Pivot against its first value, the square of a distance from singular, above which factors lose at most four digits;
what they leave of a gap is closed with them again."""
SINGULAR = 1e-10
"""Pivot against its first value below which a row counts as dependent in an acceleration: 1e-5 from singular."""
SETTLED = 1e-6
"""The same for the removal of drift."""


class Saddle(NamedTuple):
    """Pattern of the factor and where its numbers come from; empty (size 0) where rows depend on others at the start.

    many: whether there are too many constraints for the projection, even near singular positions. rows: number of
    constraints in the problem; row: their numbers. place: position of every coordinate, then of the multipliers of
    these. base: the mass matrix in the pattern, (slots, lanes). entries: number of the Jacobian's entries in the
    problem; entry: their numbers; slot: their slots. multiplier: whether a position is that of a multiplier.
    """

    size: int
    slots: int
    many: bool
    pattern: sparse.Pattern
    rows: int
    row: Index
    place: Index
    base: Array
    entries: int
    entry: Index
    slot: Index
    multiplier: Index


class SaddleWork(NamedTuple):
    """Work space: the factor (slots, lanes), a right-hand side (size, lanes) and numbers.

    weak: see `factor`. opened: whether a constraint that was left out as redundant has turned out not to be.
    """

    values: Array
    x: Array
    weak: Array
    opened: Array


def order(unknowns: int, entries: Iterable[tuple[int, int]], rows: list[list[int]]) -> list[int]:
    """An order of elimination: greedily of least degree, multipliers (from `unknowns` on) after their coordinates."""
    neighbours: list[set[int]] = [set() for _ in range(unknowns + len(rows))]
    for i, j in entries:
        if i != j:
            neighbours[i].add(j)
            neighbours[j].add(i)
    for k, columns in enumerate(rows):
        for j in columns:
            neighbours[unknowns + k].add(j)
            neighbours[j].add(unknowns + k)
    missing = [len(columns) for columns in rows]
    owners: list[list[int]] = [[] for _ in range(unknowns)]
    for k, columns in enumerate(rows):
        for j in columns:
            owners[j].append(k)
    heap = [(len(neighbours[node]), node) for node in range(unknowns)]
    heap += [(len(neighbours[unknowns + k]), unknowns + k) for k in range(len(rows)) if not rows[k]]
    heapq.heapify(heap)
    done: set[int] = set()
    found = []
    while heap:
        degree, node = heapq.heappop(heap)
        if node in done or degree != len(neighbours[node]):
            continue
        done.add(node)
        found.append(node)
        around = neighbours[node]
        for other in around:
            neighbours[other] |= around
            neighbours[other] -= {node, other}
        ready = set(around)
        if node < unknowns:
            for k in owners[node]:
                missing[k] -= 1
                if missing[k] == 0:
                    ready.add(unknowns + k)
        for other in ready:
            if other < unknowns or missing[other - unknowns] == 0:
                heapq.heappush(heap, (len(neighbours[other]), other))
    return found


def analyse(
    unknowns: int, mass: Collection[tuple[int, int]], constraints: Constraints, numbers: Index
) -> tuple[sparse.Pattern, dict[tuple[int, int], int], Index, Index]:
    """Pattern, slots of the mass matrix's entries, places of all unknowns and slots of the Jacobian's entries.

    numbers: of the constraints in the problem
    """
    rows = [constraints.column[constraints.entry[k] : constraints.entry[k + 1]].tolist() for k in numbers]
    place = np.empty(unknowns + len(rows), dtype=np.int64)
    place[order(unknowns, mass, rows)] = np.arange(len(place))

    def key(i: int, j: int) -> tuple[int, int]:
        a, b = int(place[i]), int(place[j])
        return max(a, b), min(a, b)

    pairs = [(unknowns + k, j) for k, columns in enumerate(rows) for j in columns]
    pattern, slot = sparse.analyse(len(place), [key(i, j) for i, j in [*mass, *pairs]])
    masses = {(i, j): slot[key(i, j)] for i, j in mass}
    return pattern, masses, place, np.array([slot[key(i, j)] for i, j in pairs], dtype=np.int64)


@njit(cache=True, error_model="numpy")
def factor(tile: Tile, s: Saddle, jacobian: Array, w: SaddleWork, tolerance: float, closeness: Array) -> int:
    """Factor the problem for a Jacobian (entries, lanes); returns how many rows were left out in some lane.

    The factors are solved with by `sparse.solve`, the right-hand side ordered by place. They serve for the removal of
    drift as well, unless some row is left out, now or by its tolerance: w.weak[0] is how many are. For closeness see
    `eliminate`.
    """
    simd.assign(w.values, s.base, s.slots * len(tile))
    for e in range(s.entries):
        copy(tile, w.values, s.slot[e], jacobian, s.entry[e])
    dropped, weak = eliminate(tile, s.pattern, s.multiplier, w.values, tolerance, closeness)
    w.weak[0] = max(dropped, weak)
    return dropped  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def eliminate(
    tile: Tile, p: sparse.Pattern, multiplier: Index, values: Array, tolerance: float, closeness: Array
) -> tuple[int, int]:
    """Replace a matrix with multipliers (slots, lanes) by its factors. Pointers.

    The pivot of a multiplier is compared with what it is when only its coordinates are taken out. Returns how many rows
    were left out, and how many would be by the tolerance SETTLED. closeness: inverse square of the distance from
    singular, (lanes,), which rows that are not left out raise to their own.
    """
    width, dropped, weak = len(tile), 0, 0
    closest = simd.load(tile, closeness, 0)
    for k in range(p.size):
        first = _by_coordinates(tile, p, multiplier, values, k)
        pivot = sparse.finish_row(tile, p, values, k)
        if multiplier[k]:
            inverse = simd.inverse_below(pivot, -tolerance * first)
            closest = simd.larger(closest, first * inverse)
            simd.store(values, k * width, inverse)
            dropped += simd.zeros(simd.load(tile, values, k * width))
            weak += simd.zeros(simd.inverse_below(pivot, -SETTLED * first))
        else:
            simd.store(values, k * width, 1.0 / pivot)
        sparse.start_column(tile, p, values, k)
    simd.store(closeness, 0, closest)
    return dropped, weak


@njit(error_model="numpy", forceinline=True)
def _by_coordinates(tile: Tile, p: sparse.Pattern, multiplier: Index, values: Array, k: int) -> Any:
    """Return the part of the pivot of a multiplier that its coordinates eliminate; its row is not finished yet."""
    taken = simd.spread(tile, 0.0)
    for e in range(p.across[k], p.across[k + 1] if multiplier[k] else p.across[k]):
        if not multiplier[p.other[e]]:
            entry = simd.load(tile, values, p.slot[e] * len(tile))
            taken = taken + entry * entry * simd.load(tile, values, p.other[e] * len(tile))
    return taken


def room(size: int, slots: int, width: int) -> SaddleWork:
    """Work space as arrays."""
    return SaddleWork(np.zeros(slots * width), np.zeros(size * width), np.zeros(1), np.zeros(1))
