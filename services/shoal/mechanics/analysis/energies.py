"""Energies of a rigid machine in the plane along its motion."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.analysis.evaluate import points
from shoal.mechanics.analysis.felt import Felt
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import RigidBody, Rod


class Energies(NamedTuple):
    """Of the bodies, of springs, and of weights above the origin of the ground [J], (samples,) each."""

    kinetic: Array
    elastic: Array
    gravity: Array

    @property
    def potential(self) -> Array:
        """That of springs and weights; loads have none here, they do work."""
        return self.elastic + self.gravity

    @property
    def total(self) -> Array:
        """Kinetic and potential."""
        return self.kinetic + self.potential


def energies_along(felt: Felt) -> Energies:
    """Of one lane."""
    model, kinetic, gravity = felt.evaluator.model, np.zeros(len(felt.times)), np.zeros(len(felt.times))

    def number(stated: Any) -> float:
        """Of this lane."""
        return float(np.ravel(stated)[felt.lane % np.size(stated)])

    for name, frame in model.frames.items():
        body = felt.scene.bodies[name]
        mass, centre = number(body.mass), frame.vectors[0]
        if isinstance(frame, RigidFrame):
            assert isinstance(body, Rod | RigidBody)
            x, y = (number(part) for part in body.centre_of_mass)
            centre = frame.point((x, y))
            turn = points(frame.directors[:1], model.unknowns, felt.lane)
            director, turning = felt.q @ turn.matrix[0].T + turn.constant[0], felt.v @ turn.matrix[0].T
            rate = plane.cross(director.T, turning.T) / np.sum(director**2, axis=1)
            kinetic += 0.5 * number(body.inertia) * rate**2
        found = points([centre], model.unknowns, felt.lane)
        velocity = felt.v @ found.matrix[0].T
        kinetic += 0.5 * mass * np.sum(velocity**2, axis=1)
        gravity -= mass * (felt.q @ found.matrix[0].T + found.constant[0]) @ felt.gravity
    held = model.forces.size > 0
    elastic = felt.evaluator.stored(felt.q, felt.turns) if held else np.zeros(len(felt.times))
    return Energies(kinetic, elastic, gravity)
