"""Least constraint as an orthogonal projection in the metric of the mass matrix, with rank detection.

With M = L D L' and y = D^1/2 L' a, Gauss's function is 1/2 |y - y_f|^2 and every constraint one row w . y = -g, so the
minimiser moves y_f by the least norm. The rows are orthonormalised with pivoting (Gram and Schmidt, each row twice);
the remainder of a row that depends on the others, relative to its own length, is a distance from the singular
position, not its square. One lane at a time, on contiguous work space.

At a singular position the minimiser is in general not the limit of the motion: see `branch`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.mechanics.numerics.tile import Array, Index

NEW = 1e-6
"""What must be left of a row by third derivatives, as a part of the size of its terms, to add to the others."""
TIE = 1.0 + 1e-6
"""Squares of lengths that differ by less are equal, and the first row is the pivot: round-off must not choose, step by
step, which of two constraints is met that contradict each other."""
NOTHING = 1e-10
"""A row that has no larger share in a combination than this part of the largest is not in it, but for round-off.

Where the rows that are in it change no more, as those of a driven crank at rest, round-off of others would be all that
is left of their third derivatives: a row of its own, and wrong.
"""


@njit(error_model="numpy", forceinline=True)
def dot(x: Array, y: Array) -> float:
    """x . y in four sums, which do not wait for each other; that of numpy would have scipy imported for one of BLAS."""
    n = x.size
    whole = n - n % 4
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(0, whole, 4):
        a += x[i] * y[i]
        b += x[i + 1] * y[i + 1]
        c += x[i + 2] * y[i + 2]
        d += x[i + 3] * y[i + 3]
    for i in range(whole, n):
        a += x[i] * y[i]
    return (a + b) + (c + d)


@njit(error_model="numpy", forceinline=True)
def clear(x: Array) -> None:
    """x = 0, as a loop: Numba compiles any assignment to a slice as the most general one."""
    for i in range(x.size):
        x[i] = 0.0


@njit(cache=True, error_model="numpy")
def orthonormalise(rows: Array, triangle: Array, norms: Array, order: Index, tolerance: float) -> int:
    """Replace the leading rows by an orthonormal basis of all of them; returns the rank.

    rows: (constraints, unknowns); row order[k] of the input = norms[order[k]] * sum_j triangle[j, k] * (basis row j).
    Rows beyond the rank depend on the basis up to the tolerance; a row of zeros depends on anything.
    """
    count: int = rows.shape[0]
    n = rows.shape[1]
    for k in range(count):
        order[k] = k
        norms[k] = np.sqrt(dot(rows[k], rows[k]))
        if norms[k] > 0.0:
            for i in range(n):
                rows[k, i] /= norms[k]
    for k in range(count):
        clear(triangle[k])
    for k in range(count):
        pivot, longest = k, -1.0
        for j in range(k, count):
            length = dot(rows[j], rows[j])
            if length > TIE * longest:
                pivot, longest = j, length
        if not np.sqrt(longest) > tolerance:
            return k
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for i in range(n):
                rows[k, i], rows[pivot, i] = rows[pivot, i], rows[k, i]
            for j in range(k):
                triangle[j, k], triangle[j, pivot] = triangle[j, pivot], triangle[j, k]
        for j in range(k):  # again, so that round-off of the first time does not stay
            more = dot(rows[j], rows[k])
            triangle[j, k] += more
            for i in range(n):
                rows[k, i] -= more * rows[j, i]
        length = np.sqrt(dot(rows[k], rows[k]))
        if not length > tolerance:
            return k
        triangle[k, k] = length
        for i in range(n):
            rows[k, i] /= length
        for j in range(k + 1, count):
            part = dot(rows[k], rows[j])
            triangle[k, j] = part
            for i in range(n):
                rows[j, i] -= part * rows[k, i]
    return count


@njit(cache=True, error_model="numpy")
def left(rank: int, rows: Array) -> float:
    """Return the remainders of the rows that depend on the basis, relative to their lengths."""
    longest = 0.0
    for k in range(rank, rows.shape[0]):
        longest = max(longest, dot(rows[k], rows[k]))
    return np.sqrt(longest)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def components(rank: int, triangle: Array, norms: Array, order: Index, target: Array, out: Array) -> None:
    """out[j]: what (basis row j) . y must be so that row . y = target for the leading rows; target: by constraint."""
    for k in range(rank):
        total = target[order[k]] / norms[order[k]]
        for j in range(k):
            total -= triangle[j, k] * out[j]
        out[k] = total / triangle[k, k]


@njit(cache=True, error_model="numpy")
def dependence(number: int, rank: int, triangle: Array, norms: Array, order: Index, out: Array) -> None:
    """A combination of rows that vanishes: out[k] * row k, summed, = 0; that of the dependent row order[number]."""
    clear(out)
    if norms[order[number]] == 0.0:
        out[order[number]] = 1.0
        return
    out[order[number]] = 1.0 / norms[order[number]]
    for k in range(rank - 1, -1, -1):
        total = triangle[k, number]
        for j in range(k + 1, rank):
            total += triangle[k, j] * out[order[j]] * norms[order[j]]
        out[order[k]] = -total / triangle[k, k] / norms[order[k]]
    largest = 0.0
    for k in range(out.size):
        largest = max(largest, abs(out[k]) * norms[k])
    for k in range(out.size):
        if abs(out[k]) * norms[k] < NOTHING * largest:
            out[k] = 0.0


@njit(cache=True, error_model="numpy")
def move(rank: int, rows: Array, wanted: Array, y: Array) -> None:
    """Change y by the least norm so that (basis row j) . y = wanted[j], which becomes the change along that row."""
    n = rows.shape[1]
    for j in range(rank):
        gap = wanted[j] - dot(rows[j], y)
        wanted[j] = gap
        for i in range(n):
            y[i] += gap * rows[j, i]


@njit(cache=True, error_model="numpy")
def take_out(rank: int, rows: Array, change: Array, y: Array) -> None:
    """Take what is along the basis out of y, and off the change along the basis."""
    n = rows.shape[1]
    for j in range(rank):
        part = dot(rows[j], y)
        change[j] -= part
        for i in range(n):
            y[i] -= part * rows[j, i]


@njit(cache=True, error_model="numpy")
def confine(rank: int, rows: Array, y: Array, room: Array) -> None:
    """Take out of y what is not along the basis; room: (unknowns,)."""
    for i in range(rows.shape[1]):  # `room[:] = y` would compile a message for arrays of other shapes
        room[i] = y[i]
    for j in range(rank):
        part = dot(rows[j], room)
        for i in range(rows.shape[1]):
            room[i] -= part * rows[j, i]
    for i in range(rows.shape[1]):
        y[i] -= room[i]


@njit(cache=True, error_model="numpy")
def multipliers(rank: int, triangle: Array, norms: Array, order: Index, change: Array, out: Array) -> None:
    """lambda with sum of lambda * row = -(change along the basis), change: from `move`; zero for dependent rows."""
    clear(out)
    for k in range(rank - 1, -1, -1):
        total = -change[k]
        for j in range(k + 1, rank):
            total -= triangle[k, j] * out[order[j]] * norms[order[j]]
        out[order[k]] = total / triangle[k, k] / norms[order[k]]


@njit(cache=True, error_model="numpy")
def extend(rank: int, rows: Array, wanted: Array, row: Array, target: float, tolerance: float) -> int:
    """Add row . y = target to the basis if it is independent of it; returns the new rank. Changes `row`."""
    n = rows.shape[1]
    length = np.sqrt(dot(row, row))
    if not length > 0.0 or rank >= min(rows.shape[0], n):
        return rank
    rest = target
    for _ in range(2):
        for j in range(rank):
            part = dot(rows[j], row)
            rest -= part * wanted[j]
            for i in range(n):
                row[i] -= part * rows[j, i]
    left = np.sqrt(dot(row, row))
    if not left > tolerance * length:
        return rank
    for i in range(n):
        rows[rank, i] = row[i] / left
    wanted[rank] = rest / left
    return rank + 1
