"""Rotation vectors among the parameters: those that are whole turns apart, along one axis, are one attitude."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

_ALIKE = 1e-9
"""Of a rotation vector [rad]: what turns may change of its components that are not sought."""


def nearest_attitudes(model: ForwardModel, point: Array, other: Array) -> Array:
    """A point (parameters,) with its rotation vectors, of those of the same attitudes, nearest to those of another."""
    found = point.copy()
    for (recording, body), components in model.parameters.rotations.items():
        stated = model.scene.initial[body].rotation or (0.0, 0.0, 0.0)
        known = {} if recording is None else model.measurement.recordings[recording].stated.known
        base = np.array([known.get(f"initial.{body}.rotation.{k}", part) for k, part in enumerate(stated)])
        sought, numbers = list(components), list(components.values())
        vector, near = base.copy(), base.copy()
        vector[sought], near[sought] = point[numbers], other[numbers]
        angle = float(np.linalg.norm(vector))
        turns = np.round((vector @ near / angle - angle) / (2 * np.pi)) if angle > 0.0 else 0.0
        turned = vector * (1.0 + 2 * np.pi * turns / angle) if turns else vector
        if np.all(np.abs(np.delete(turned - vector, sought)) <= _ALIKE):
            found[numbers] = turned[sought]
    return found
