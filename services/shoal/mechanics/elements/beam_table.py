"""Energy, stiffness and damping of beam elements of any order in R^d, with the quadrature as a table; see `beam`.

As the forces, written for values of `simd`, whose lanes are simulations or elements (`batch`).

The second derivative of 1/2 S |k - k0|^2 at a point, with k = (p ^ c)/A, A = p . p, B = p . c, C = c . c and the moment
M = S (k - k0), follows from that of the wedge product. With the vectors g = d(G . (a ^ c))/da and h = d(G . (a ^ p))/da
of the bivector G = S k + M it is, by p and p, by p and c, and by c and c,

    S (C 1 - c c')/A^2 - 2 (p g' + g p')/A^2 + (4 S k.k + 8 M.k) p p'/A^2 - 2 M.k 1/A,
    S (p c' - B 1)/A^2 + 2 p h'/A^2 + M/A,        S (1 - p p'/A)/A,

where M stands for the skew matrix of M . (e_m ^ e_n). Damping of the curvature has the products of gradients alone, M =
0 above; in space those of the size of k (`strain.bend`).
"""

from __future__ import annotations

from numba import njit

from shoal.compile.pointers import shift
from shoal.compile.simd import EIGHT, inverse_root, load, reciprocal, root, spread, store
from shoal.compile.tuples import dot, facing, minus, outer, plus, plus_identity, plus_skew, times, wedge
from shoal.mechanics.elements import beam
from shoal.mechanics.elements.batch import add_sum, coefficient, kept, kept_matrix, nodal, put, together, zeros_like
from shoal.mechanics.elements.families import PLAN, PLANE, SPACE, Family, implement_tangent, space_of
from shoal.mechanics.elements.strain import STRAIGHT, less, reference
from shoal.mechanics.numerics.tile import Array, Tile

_X, _FACTOR, _BLOCK = 1, 16, 22
"""Vectors of the work space: one of `batch`; scaled vectors; factors of nodal vectors; blocks (a_i, d_i) H (a_j, d_j),
behind these the second derivatives H of every point."""


@njit(error_model="numpy", forceinline=True)
def _put(w, at, values):  # type: ignore[no-untyped-def]
    """Keep a tuple of vectors."""
    for k in range(len(values)):
        store(w, len(EIGHT) * (at + k), values[k])


@njit(error_model="numpy", forceinline=True)
def _put_rows(w, at, rows):  # type: ignore[no-untyped-def]
    """Keep a matrix."""
    for m in range(len(rows)):
        _put(w, at + len(rows) * m, rows[m])


@njit(error_model="numpy", forceinline=True)
def _gather(tile, space, vectors, family, number, lane, inverse, z, w):  # type: ignore[no-untyped-def]
    """X of elements and d X/d (nodal vector) into w."""
    order, d, at = vectors // 2, len(space), (tile, space, family, number, lane, vectors, z)
    _put(w, _X, times(inverse, minus(nodal(order, *at), nodal(0, *at))))
    for node in range(2):
        for j in range(1, order):
            value = nodal(node * order + j, *at)
            _put(w, _X + d * (node * (order - 1) + j), times(1.0 / inverse, value) if j == 2 else value)
    for k in range(vectors):
        factor = spread(EIGHT, 1.0)
        if k == 0:
            factor = -inverse
        elif k == order:
            factor = inverse
        elif k % order == 2:
            factor = 1.0 / inverse
        store(w, len(EIGHT) * (_FACTOR + k), factor)


@njit(error_model="numpy", forceinline=True)
def _part_of(order, k):  # type: ignore[no-untyped-def]
    """The number of the scaled vector that a nodal vector is a part of."""
    return 0 if k % order == 0 else (k if k < order else k - 1)


@njit(error_model="numpy", forceinline=True)
def _combined(space, table, at, inner, w):  # type: ignore[no-untyped-def]
    """The sum of the scaled vectors with factors of the table."""
    total = zeros_like(space)
    for k in range(inner):
        total = plus(total, table[at + k], kept(space, w, _X + len(space) * k, 1))
    return total


@njit(cache=True, error_model="numpy")
def potential(tile: Tile, family: Family, z: Array, w: Array, energy: Array, row: int) -> None:
    """See `families.add_energy`."""
    space, table, total, number = space_of(family), family.table, shift(energy, row * len(tile)), 0
    vectors = family.side // len(space)
    inner, curved = vectors - 1, len(space) == len(PLANE)
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
            ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
            ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
            _gather(tile, space, vectors, family, number, lane, inverse, z, w)
            stretched, bent = spread(EIGHT, 0.0), spread(EIGHT, 0.0)
            for g in range(family.plan[PLAN * number + 1]):
                at = 2 * vectors * (family.plan[PLAN * number] + g)
                p, axial, bending = (
                    _combined(space, table, at, inner, w),
                    table[at + 2 * inner],
                    table[at + 2 * inner + 1],
                )
                square, relaxed = dot(p, p), reference(tile, curved, family, number, lane, 2 * g, 1.0)
                if axial != 0.0:
                    strain = square * inverse_root(square) * relaxed - 1.0
                    stretched = stretched + axial * strain * strain * reciprocal(relaxed)
                if bending != 0.0:
                    c = _combined(space, table, at + inner, inner, w)
                    angle = reference(tile, curved, family, number, lane, 2 * g + 1, 0.0)
                    turn = less(times(reciprocal(square), wedge(p, c)), angle)
                    bent = bent + bending * dot(turn, turn) * relaxed
            add_sum(tile, lane, count, w, total, 0.5 * (ea * stretched + ei * bent))
        number += count


@njit(error_model="numpy", forceinline=True)
def _stretched(viscous, p, relaxed, axial):  # type: ignore[no-untyped-def]
    """Second derivative of the stretching energy by p at a point, or its damping matrix."""
    flat = 1.0 / dot(p, p)
    # (|p|/|p0| - 1)^2 |p0|/2 bends by 1/|p0| along p and by eps/|p| across it.
    across = 0.0 * flat if viscous else axial * (relaxed - root(flat))
    return plus_identity(outer(times((axial * relaxed - across) * flat, p), p), across)


@njit(error_model="numpy", forceinline=True)
def _bent(viscous, p, c, relaxed, angle, bending):  # type: ignore[no-untyped-def]
    """Second derivatives of the bending energy by p, by p and c, and by c, or the damping matrix."""
    flat, stiffness = 1.0 / dot(p, p), bending * relaxed
    k, firm = times(flat, wedge(p, c)), stiffness * flat * flat
    if viscous and len(k) > 1:
        square = dot(k, k) + STRAIGHT
        by_p, by_c = minus(facing(c, k), times(2.0 * dot(k, k), p)), times(-1.0, facing(p, k))
        u, v = times(firm / square, by_p), times(firm / square, by_c)
        whole, mixed, last = _turned(p, c, k, flat, stiffness * (STRAIGHT / square), zeros_like(k))
        return plus(outer(u, by_p), 1.0, whole), plus(outer(u, by_c), 1.0, mixed), plus(outer(v, by_c), 1.0, last)
    moment = zeros_like(k) if viscous else times(stiffness, less(k, angle))
    return _turned(p, c, k, flat, stiffness, moment)


@njit(error_model="numpy", forceinline=True)
def _turned(p, c, k, flat, stiffness, moment):  # type: ignore[no-untyped-def]
    """The products of gradients of the turn k, times the stiffness, and its second derivatives times the moment."""
    firm = stiffness * flat * flat
    both, turned = plus(moment, stiffness, k), dot(moment, k)
    g, h = times(2.0 * flat * flat, facing(c, both)), times(2.0 * flat * flat, facing(p, both))
    q = minus(times(flat * flat * (4.0 * stiffness * dot(k, k) + 8.0 * turned), p), g)
    by_p = minus(minus(outer(p, q), outer(g, p)), outer(times(firm, c), c))
    mixed = plus_identity(outer(p, plus(h, firm, c)), -firm * dot(p, c))
    return (
        plus_identity(by_p, firm * dot(c, c) - 2.0 * flat * turned),
        plus_skew(mixed, times(flat, moment)),
        plus_identity(outer(times(-firm, p), p), stiffness * flat),
    )


@njit(error_model="numpy", forceinline=True)
def _sum(space, table, at, points, inner, i, j, w, hessian, block):  # type: ignore[no-untyped-def]
    """The block (a_i, d_i) H (a_j, d_j), summed over the points."""
    d = len(space)
    total = zeros_like(kept_matrix(space, w, hessian, d, 1))
    for g in range(points):
        row, h = at + 2 * (inner + 1) * g, hessian + 3 * d * d * g
        a, b = table[row + i], table[row + j]
        total = plus(total, a * b, kept_matrix(space, w, h, d, 1))
        if table[row + 2 * inner + 1] != 0.0:
            e, f = table[row + inner + i], table[row + inner + j]
            total = plus(total, a * f, kept_matrix(space, w, h + d * d, d, 1))
            total = plus(total, e * b, kept_matrix(space, w, h + d * d, 1, d))
            total = plus(total, e * f, kept_matrix(space, w, h + 2 * d * d, d, 1))
    _put_rows(w, block, total)


@njit(error_model="numpy", forceinline=True)
def _write(tile, d, vectors, number, lane, count, w, out, first):  # type: ignore[no-untyped-def]
    """From second derivatives in X to those in the nodal vectors, all entries, to the blocks of `count` elements.

    Only the upper triangle is read, so that the blocks are symmetric to the last bit.
    """
    order, side, inner = vectors // 2, d * vectors, vectors - 1
    for one in range(vectors):
        i = _part_of(order, one)
        for other in range(vectors):
            j = _part_of(order, other)
            low, high = min(i, j), max(i, j)
            block = _BLOCK + d * d * (low * inner - low * (low - 1) // 2 + high - low)
            factor = load(EIGHT, w, len(EIGHT) * (_FACTOR + one)) * load(EIGHT, w, len(EIGHT) * (_FACTOR + other))
            for m in range(d):
                for n in range(d):
                    upper = i < j or (i == j and m <= n)
                    value = factor * load(EIGHT, w, len(EIGHT) * (block + (d * m + n if upper else d * n + m)))
                    put(tile, lane, count, w, out, first + side * (d * one + m) + d * other + n, side * side, value)


@njit(error_model="numpy", forceinline=True)
def _blocks(tile: Tile, viscous: bool, family: Family, z: Array, w: Array, out: Array, first: int) -> None:
    """Sum over the points of (a_i, d_i) H (a_j, d_j); H: second derivative in (p, c), or the damping matrix there."""
    space, table, side, number = space_of(family), family.table, family.side, 0
    d = len(space)
    vectors, curved = side // d, d == len(PLANE)
    inner = vectors - 1
    while number < family.size:
        count = together(tile, family, number)
        for lane in range(0, len(tile), len(EIGHT)):
            inverse = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 0)
            ea = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 1)
            ei = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 2)
            if viscous:
                eta = coefficient(tile, family, number, lane, beam.COEFFICIENTS, 3)
                ea, ei = ea * eta, ei * eta
            _gather(tile, space, vectors, family, number, lane, inverse, z, w)
            hessian, points = _BLOCK + d * d * inner * vectors // 2, family.plan[PLAN * number + 1]
            at = 2 * vectors * family.plan[PLAN * number]
            for g in range(points):
                row, place = at + 2 * vectors * g, hessian + 3 * d * d * g
                p, axial, bending = (
                    _combined(space, table, row, inner, w),
                    table[row + 2 * inner],
                    table[row + 2 * inner + 1],
                )
                relaxed = reference(tile, curved, family, number, lane, 2 * g, 1.0)
                by_p = _stretched(viscous, p, relaxed, axial * ea)
                if bending != 0.0:
                    c = _combined(space, table, row + inner, inner, w)
                    angle = reference(tile, curved, family, number, lane, 2 * g + 1, 0.0)
                    more, mixed, by_c = _bent(viscous, p, c, relaxed, angle, bending * ei)
                    by_p = plus(by_p, 1.0, more)
                    _put_rows(w, place + d * d, mixed)
                    _put_rows(w, place + 2 * d * d, by_c)
                _put_rows(w, place, by_p)
            block = _BLOCK
            for i in range(inner):
                for j in range(i, inner):
                    _sum(space, table, at, points, inner, i, j, w, hessian, block)
                    block += d * d
            _write(tile, d, vectors, number, lane, count, w, out, first + side * side * number)
        number += count


@njit(cache=True, error_model="numpy")
def stiffness(tile: Tile, family: Family, z: Array, w: Array, out: Array, first: int, viscous: bool) -> None:
    """See `families.tangent`."""
    _blocks(tile, viscous, family, z, w, out, first)


class PlanarBeams(Family):
    """Beams in the plane, of any order: their tangent is compiled once."""


class SpatialBeams(Family):
    """The same in space."""


TANGENTS = {PLANE: PlanarBeams, SPACE: SpatialBeams}
for _space, _kind in TANGENTS.items():
    implement_tangent(_kind, _space, stiffness)
