"""Nodal vectors of beam elements of any order, in the plane and in space, and the scaled vectors X they make up.

With these a derivative of the centreline is a sum over the table's weights, free of the length: the secant over L, the
slopes, and L times the second derivatives.
"""

from __future__ import annotations

from numba import njit

from shoal.compile.simd import EIGHT, spread, store
from shoal.mechanics.elements.batch import coordinate


@njit(error_model="numpy", forceinline=True)
def gather(tile, dimensions, vectors, family, number, lane, inverse, z, w, scaled, factors):  # type: ignore[no-untyped-def]
    """X of elements into w from `scaled` on, component by component, and d X/d (nodal vector) from `factors` on."""
    order, side = vectors // 2, dimensions * vectors
    for k in range(dimensions):
        first = coordinate(tile, family, number, lane, side, k, z)
        second = coordinate(tile, family, number, lane, side, dimensions * order + k, z)
        store(w, len(EIGHT) * (scaled + k), (second - first) * inverse)
        for node in range(2):
            for j in range(1, order):
                value = coordinate(tile, family, number, lane, side, dimensions * (node * order + j) + k, z)
                if j == 2:
                    value = value / inverse
                store(w, len(EIGHT) * (scaled + dimensions * (node * (order - 1) + j) + k), value)
    for k in range(vectors):
        factor = spread(EIGHT, 1.0)
        if k == 0:
            factor = -inverse
        elif k == order:
            factor = inverse
        elif k % order == 2:
            factor = 1.0 / inverse
        store(w, len(EIGHT) * (factors + k), factor)


@njit(error_model="numpy", forceinline=True)
def part_of(order, k):  # type: ignore[no-untyped-def]
    """The number of the scaled vector that a nodal vector is a part of."""
    return 0 if k % order == 0 else (k if k < order else k - 1)
