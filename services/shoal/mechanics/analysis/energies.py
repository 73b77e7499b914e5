"""Energies of a machine along its motion."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import points
from shoal.mechanics.analysis.felt import Felt
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.frames import RigidFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import RigidBody, Rod


class Energies(NamedTuple):
    """Energies of bodies, of springs, and of weights above the origin of the ground [J], (samples,) each."""

    kinetic: Array
    elastic: Array
    gravity: Array

    @property
    def potential(self) -> Array:
        """Return the potential energy of springs and weights; loads do work instead."""
        return self.elastic + self.gravity

    @property
    def total(self) -> Array:
        """Kinetic and potential."""
        return self.kinetic + self.potential


def energies_along(felt: Felt) -> Energies:
    """Return the energies of one lane; of a model that bends or moves in space its only one."""
    model = felt.evaluator.model
    if model.dimensions != plane.DIMENSIONS or model.flexible or model.modal:
        return _of_bodies(felt)
    return _of_rigid(felt)


def _of_bodies(felt: Felt) -> Energies:
    """By coordinates of each body's own, which leave nothing of a machine to constants."""
    bodies = FreeBodies(felt.evaluator, float(felt.times[-1]))
    free, forces = bodies.evaluator, felt.evaluator.model.forces.size
    rubbing = forces - free.model.forces.size
    turns = felt.turns if forces else np.zeros((len(felt.q), 0))
    at, rate, _ = bodies.state(felt.q, felt.v, felt.v)
    kinetic, elastic, gravity = np.empty((3, len(at)))
    for k, (q, v, turned, t) in enumerate(zip(at, rate, turns, felt.times.tolist(), strict=True)):
        free.turns = turned[rubbing:]
        found = free.at(q, v, t)
        # The mass is without the inertia that bodies are lent which have none.
        kinetic[k], elastic[k], gravity[k] = 0.5 * float(v @ (bodies.mass @ v)), found.strain, found.gravity
    return Energies(kinetic, elastic, gravity)


def _of_rigid(felt: Felt) -> Energies:
    model, kinetic, gravity = felt.evaluator.model, np.zeros(len(felt.times)), np.zeros(len(felt.times))

    def number(stated: Any) -> float:
        """Return a stated number for this lane."""
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
