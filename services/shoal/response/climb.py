"""From many places of the box at once downhill to where a surrogate is least, column by column.

Quasi-Newton steps (BFGS: Nocedal and Wright, Numerical Optimization, 2006, chapter 6) that are cut off at the faces of
the box, along which a place may then go on (Bertsekas, Projected Newton methods for optimization problems with simple
constraints, SIAM Journal on Control and Optimization 20, 1982). They follow narrow valleys that lie across the axes,
such as those of equal phase at long times.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.response.inputs import IntArray
from shoal.trajectory import Array

DIFFERENCE = 1e-6
"""Of germs, for slopes."""
FIRST = 0.1
"""Length of the first step."""
STEPS = 30
SETTLED = 1e-12
"""Share of the answers' size below which a step gains nothing."""
BACK = 0.25
"""A step that leads uphill is taken again, so much shorter."""

Objective = Callable[[Array, IntArray], Array]
"""Places, (places, parameters), and which searches they belong to, (places,), to values, (places,)."""


def climb_down(objective: Objective, at: Array, value: Array) -> None:
    """Improve places, (searches, parameters), and values, (searches,), in place."""
    count = len(at)
    every = np.arange(count)
    slope, curved = _slopes(objective, at, value, every)
    inverse = _begun(slope, curved)
    longest, size = np.full(count, np.inf), np.abs(value).max(initial=0.0)
    for _ in range(STEPS):
        some = every
        x, g, h = at[some], slope[some], inverse[some]
        bound = ((x <= -1) & (g > 0)) | ((x >= 1) & (g < 0))
        free = np.where(bound, 0.0, g)
        step = np.where(bound, 0.0, -np.einsum("nij,nj->ni", h, free))
        uphill = np.einsum("ni,ni->n", step, free) >= 0
        if uphill.any():
            inverse[some[uphill]] = _begun(free[uphill], curved[some[uphill]])
            step[uphill] = -np.einsum("nij,nj->ni", inverse[some[uphill]], free[uphill])
        length = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, longest[some] / np.maximum(length, 1e-300))[:, None]
        new, found = _tried(objective, x, step, g, value[some], some)
        better = found < value[some]
        gain = value[some] - found
        longest[some] = np.where(better, np.inf, BACK * np.minimum(length, longest[some]))
        moved = some[better]
        if len(moved):
            before, old = at[moved].copy(), slope[moved].copy()
            at[moved], value[moved] = new[better], found[better]
            slope[moved], curved[moved] = _slopes(objective, at[moved], value[moved], moved)
            _learn(inverse, moved, at[moved] - before, slope[moved] - old)
        going = np.where(better, gain > SETTLED * size, longest[some] > DIFFERENCE)
        every = some[going & (length > DIFFERENCE**2)]
        if not len(every):
            return


def _slopes(objective: Objective, at: Array, value: Array, searches: IntArray) -> tuple[Array, Array]:
    """By differences of second order, inwards at a face, and curvatures along each axis, (searches, parameters).

    Those of first order are off by half a difference times the curvature: across a narrow valley more than what is
    gained along it.
    """
    parameters = at.shape[1]
    one = np.where(at - DIFFERENCE < -1, DIFFERENCE, -DIFFERENCE)
    other = np.where(np.abs(at - one) > 1, 2 * one, -one)
    ways = np.stack([one, other])
    # All places that are needed, (ways, axes, searches, parameters), at one go.
    beside = at + ways.transpose(0, 2, 1)[..., None] * np.eye(parameters)[:, None]
    told = objective(beside.reshape(-1, parameters), np.tile(searches, 2 * parameters))
    chords = (told.reshape(2, parameters, len(at)).transpose(0, 2, 1) - value[:, None]) / ways
    found = (chords[0] * other - chords[1] * one) / (other - one)
    return found, 2 * (chords[1] - chords[0]) / (other - one)


def _begun(slope: Array, curved: Array) -> Array:
    """Inverse curvatures: a first step has its length, or ends where an axis that is more curved is lowest."""
    size = np.linalg.norm(slope, axis=1, keepdims=True)
    scale = np.divide(FIRST, size, out=np.zeros_like(size), where=size > 0)
    scale = np.divide(scale, np.maximum(scale * curved, 1.0))
    return np.asarray(scale[:, :, None] * np.eye(slope.shape[1]))


def _tried(
    objective: Objective,
    x: Array,
    step: Array,
    slope: Array,
    value: Array,
    searches: IntArray,
) -> tuple[Array, Array]:
    """The best of a whole step and of the lowest point of the parabola along it."""
    new = np.clip(x + step, -1, 1)
    found = objective(new, searches)
    taken = new - x
    falls = np.einsum("ni,ni->n", slope, taken)
    curved = found - value - falls
    share = np.divide(-falls, 2 * curved, out=np.full_like(falls, 2.0), where=curved > 0)
    other = np.clip(x + np.clip(share, 0.05, 3.0)[:, None] * taken, -1, 1)
    also = objective(other, searches)
    lower = also < found
    return np.where(lower[:, None], other, new), np.where(lower, also, found)


def _learn(inverse: Array, searches: IntArray, moved: Array, turned: Array) -> None:
    """Enter a step and the change of slope along it into inverse curvatures."""
    along = np.einsum("ni,ni->n", moved, turned)
    curved = along > 1e-10 * np.linalg.norm(moved, axis=1) * np.linalg.norm(turned, axis=1)
    searches, moved, turned, along = searches[curved], moved[curved], turned[curved], along[curved]
    h = inverse[searches]
    image = np.einsum("nij,nj->ni", h, turned)
    whole = 1 + np.einsum("ni,ni->n", turned, image) / along
    outer = np.einsum("ni,nj->nij", image, moved)
    inverse[searches] = (
        h
        + (whole / along)[:, None, None] * np.einsum("ni,nj->nij", moved, moved)
        - (outer + np.swapaxes(outer, 1, 2)) / along[:, None, None]
    )
