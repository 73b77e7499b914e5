"""The last steps to a minimum of a chaotic motion: least squares by derivatives that hold, over a lengthening record.

The valley of the squared residuals is as narrow as the motion magnifies deviations, and bent, so that a descent by
forward differences ends on its way along it: a step of theirs leads across the valley. Over a shorter record it is
wider. So the descent goes to its minimum there, by central differences along singular directions, each as far as the
residuals change by their own size, and from there to that of a record which is little longer, up to the whole.
"""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Descent, damped_step, squares
from shoal.identification.uncertainty.sensitivity import sensitivity
from shoal.trajectory import Array

_SHORTER = 0.75
"""Part of the record that is fitted first, shorter yet by this factor until derivatives hold there, ..."""
_LONGER = 0.93
"""... and each part over the next."""
_SHORTEST = 0.2
"""Of the record: where derivatives hold over no more, nothing is gained."""
_HOLD = 1e-3
"""Relative difference of derivatives by two steps that hold."""
_DAMPINGS = 10.0 ** np.arange(-2.0, 6.0)
"""Times the last damping: tried side by side."""
_ITERATIONS = 20
"""Steps on one part of the record, at most; it settles in a few."""
_SETTLED = 1e-2
"""A fall of the squares by less than this times their mean is the end: by a hundredth of what noise leaves of a row."""
_STEADY = 2.0
"""Differences are taken again where a singular value has changed by more than this factor."""
_LONGEST = 1e-3
"""Of a difference, in units of the sizes of parameters."""
_ROUNDS = 3
"""At most, of differences at one point."""


def lengthened(model: ForwardModel, point: Array) -> Descent | None:
    """The minimum over the whole record near a point that may stand beside it; None if nothing is gained.

    Not counted. Raises TimeIsUp.
    """
    before = float(model.cost(model.uncounted(point[None]))[0])
    end = part = model.measurement.end
    while True:
        part = _SHORTER * part
        if part < _SHORTEST * end or len(model.until(part).rows.time) <= len(point):
            return None
        seen = sensitivity(model.until(part), point)
        if seen.doubt < _HOLD:
            break
    place, jacobian = point, seen.jacobian
    while part < end:
        place, _, jacobian = _descend(model.until(part), place, jacobian)
        part = part / _LONGER
    place, residual, jacobian = _descend(model, place, jacobian)
    fitness = float(model.cost(residual[None])[0])
    if not fitness < (1.0 - _SETTLED / len(residual)) * before:
        return None
    return Descent(place, residual, jacobian, fitness, [(0, before, before), (1, fitness, fitness)], converged=True)


def _descend(model: ForwardModel, point: Array, jacobian: Array) -> tuple[Array, Array, Array]:
    """Levenberg-Marquardt from a point, with derivatives near it; the end, residuals and derivatives there.

    Unlike in `numerics.levenberg_marquardt` the steps of several dampings are run side by side, as batch lanes.
    """
    residual, damping = model.uncounted(point[None])[0], 1e-8
    for _ in range(_ITERATIONS):
        jacobian = _differentiated(model, point, residual, jacobian)
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        steps = np.array([damped_step(residual, jacobian, scale, damping * factor) for factor in _DAMPINGS])
        trials = np.clip(point + steps, *model.box_at(point))
        seen = model.uncounted(trials)
        costs = np.array([squares(one) for one in seen])
        best, cost = int(np.argmin(costs)), squares(residual)
        if not cost - costs[best] > _SETTLED * cost / len(residual):
            break
        point, residual, damping = trials[best], seen[best], damping * _DAMPINGS[best]
    return point, residual, jacobian


def _differentiated(model: ForwardModel, point: Array, residual: Array, jacobian: Array) -> Array:
    """Central differences along the singular directions of derivatives of before, until their sizes stay."""
    sizes = model.sizes(point)
    low, high = model.box_at(point)
    for _ in range(_ROUNDS):
        values, directions = np.linalg.svd(jacobian * sizes, full_matrices=False)[1:]
        lengths = np.minimum(np.linalg.norm(residual) / np.maximum(values, 1e-300), _LONGEST)
        moves = lengths[:, None] * directions * sizes
        ahead, behind = (np.clip(point + way * moves, low, high) for way in (1.0, -1.0))
        seen = model.uncounted(np.concatenate([ahead, behind]))
        if not np.all(np.isfinite(seen)):
            break
        widths = np.maximum(np.linalg.norm((ahead - behind) / sizes, axis=1), 1e-300)[:, None]
        slopes = (seen[: len(moves)] - seen[len(moves) :]) / widths
        jacobian = np.linalg.lstsq((ahead - behind) / sizes / widths, slopes, rcond=None)[0].T / sizes
        found = np.linalg.norm(slopes, axis=1)
        if np.all(np.maximum(found, values) < _STEADY * np.minimum(found, values)):
            break
    return jacobian
