"""The markers at the very start, which need no march where nothing holds the machine but coordinates that it shares."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.marched import FARTHEST, NUMBERS
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array


class Still:
    """The rows of the markers as functions of the coordinates, of a model whose lanes differ in their start only."""

    def __init__(self, model: Model) -> None:
        d, derived = model.dimensions, model.derived
        size = model.unknowns
        matrix, constant = np.eye(model.rows, size), np.zeros(model.rows)
        for r, row in enumerate(range(size, model.rows)):
            parts = slice(derived.start[r], derived.start[r + 1])
            factors, sources = derived.coefficient[parts, 0], derived.source[parts]
            matrix[row] = factors @ matrix[sources]
            constant[row] = derived.constant[r, 0] + factors @ constant[sources]
        rows = model.marker_rows.ravel()
        self._matrix, self._constant = matrix[rows], constant[rows, None]
        self._shape = rows.size // (2 * d), 2, d

    def fill(self, model: Model, turns: Array, anchors: Array, motion: Array, numbers: Array) -> None:
        """Fill the results of a run (`runs`) at the start of a model, where nothing has moved or lost energy."""
        place, change = self._matrix @ model.q0 + self._constant, self._matrix @ model.v0
        (points, along), (velocities, turning) = (
            rows.reshape(*self._shape, -1).transpose(1, 0, 2, 3) for rows in (place, change)
        )
        d = points.shape[1]
        motion[0, :, :d], motion[0, :, d + 1 : 2 * d + 1] = points, velocities
        x, y, u, v = along[:, 0], along[:, 1], turning[:, 0], turning[:, 1]
        motion[0, :, d] = plane.angle((x, y)) + turns
        motion[0, :, 2 * d + 1] = (x * v - y * u) / (x * x + y * y)
        apart = np.hypot(points[None, :, 0] - anchors[:, None, 0], points[None, :, 1] - anchors[:, None, 1])
        numbers[:] = np.zeros((NUMBERS, 1))
        numbers[FARTHEST] = np.max(np.min(apart, axis=0), axis=0)
