"""Independent constraints of a model, by the rank of the Jacobian at the start and beside it.

What depends on others at one position only, a singular one, is not redundant. So the machine is moved aside along its
free directions, both ways, and closed again; a dependence that all positions show is one of the machine. Of its rows
the one is left out in whose place the others are farthest from depending on each other, the largest entry of the left
null vectors (Golub and Van Loan, Matrix Computations, 5.5.7).
"""

from __future__ import annotations

import numpy as np

from shoal.mechanics.constraints import Constraints
from shoal.mechanics.derived import Derived
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.numerics.tile import Array, Index

DEPENDENT = 1e-7
"""Smallest singular value of the unit rows below which some depend on others: the root of round-off, at which closing
the constraints to round-off leaves a singular position."""
ASIDE = 0.02
"""How far the machine is moved aside, as a part of the largest coordinate."""
CLOSED = 1e-12
"""Gap of constraints that have closed again, relative to the first gap aside."""


def independent_rows(c: Constraints, derived: Derived, q: Array) -> Index | None:
    """Return the numbers of constraints that span all of them at the coordinates q (unknowns,) and near them.

    None where a dependence is not seen to be one of the machine: it is at a singular position, or cannot move.
    """
    first, gap = linearised(c, derived, q)
    rank, left, free = _rank(first)
    if rank == c.size:
        return np.arange(c.size)
    if not len(free):
        return None
    shares = [left]
    step = free.T @ np.cos(1.0 + np.arange(len(free)))
    step *= ASIDE * max(float(np.max(np.abs(q))), ASIDE) / np.max(np.abs(step))
    for way in (step, -step):
        aside = _closed(c, derived, q + way, gap)
        if aside is None:
            return None
        other, left, _ = _rank(linearised(c, derived, aside)[0])
        if other != rank:
            return None
        shares.append(left)
    kept = np.ones(c.size, dtype=bool)
    for _ in range(c.size - rank):
        least = np.min([np.sum(left**2, axis=0) for left in shares], axis=0)
        out = int(np.argmax(np.where(kept, least, -1.0)))
        kept[out] = False
        shares = [_without(left, out) for left in shares]
    return np.flatnonzero(kept)


def _without(left: Array, out: int) -> Array:
    """Return an orthonormal basis of the combinations (dependences, rows) in which a row has no part."""
    turn = np.linalg.qr(left[:, out : out + 1], mode="complete")[0]
    return np.asarray(turn.T @ left)[1:]


def _rank(slope: Array) -> tuple[int, Array, Array]:
    """Return the rank of unit rows, the combinations of them that vanish, and the directions that they leave free."""
    lengths = np.linalg.norm(slope, axis=1, keepdims=True)
    left, sizes, right = np.linalg.svd(slope / np.where(lengths > 0, lengths, 1.0))
    rank = int(np.sum(sizes > DEPENDENT))
    return rank, left[:, rank:].T, right[rank:]


def _closed(c: Constraints, derived: Derived, q: Array, gap: Array) -> Array | None:
    """Return coordinates near q at which the constraints are as at the start; None if they do not close."""
    begin = np.max(np.abs(linearised(c, derived, q)[1] - gap))

    def correct(q: Array) -> tuple[Array, float]:
        slope, now = linearised(c, derived, q)
        back = np.asarray(np.linalg.lstsq(slope, gap - now, DEPENDENT)[0], dtype=float)
        return back, float(np.max(np.abs(back)))

    found, *_ = newton(correct, q, close=1e-14)
    left = np.max(np.abs(linearised(c, derived, found)[1] - gap))
    return found if left <= CLOSED * max(begin, 1.0) else None


def linearised(c: Constraints, derived: Derived, q: Array) -> tuple[Array, Array]:
    """Return C_q (rows, unknowns) and C without drives (rows,) of the first lane."""
    of_row = np.repeat(np.arange(len(derived.constant)), np.diff(derived.start))
    parts = np.bincount(of_row, derived.coefficient[:, 0] * q[derived.source], len(derived.constant))
    state = np.concatenate([q, derived.constant[:, 0] + parts])
    known = np.where(c.source < 0, 1.0, state[c.source])
    entries = np.bincount(c.target, c.coefficient[:, 0] * known, len(c.column))
    slope = np.zeros((c.size, len(q)))
    slope[np.repeat(np.arange(c.size), np.diff(c.entry)), c.column] = entries
    products = c.factor[:, 0] * np.where(c.left < 0, 1.0, state[c.left]) * state[c.right]
    gap = np.bincount(np.repeat(np.arange(c.size), np.diff(c.start)), products, c.size).astype(float)
    angles = np.arctan2(state[c.rising + 1], state[c.rising]) * c.share[:, 0]
    return slope, gap + np.bincount(np.repeat(np.arange(c.size), np.diff(c.turned)), angles, c.size)
