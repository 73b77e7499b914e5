"""Rivals: other points that explain the data as well as the answer, and what they are to it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtri

from shoal.identification.estimate import Value
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome
from shoal.identification.uncertainty import LEVEL, Linearisation
from shoal.trajectory import Array

_APART = 1e-3
"""Of a parameter's range: points that differ by less are the same."""


def rivals_of(model: ForwardModel, outcome: Outcome, at: Linearisation) -> list[Array]:
    """Other minima that fit as well as the noise can tell, without repetitions, (parameters,) each."""
    # Of the sum of squares; correlated noise makes larger differences by chance.
    chance = max(seen.variance / seen.independent(1) for seen in at.noise)
    doubt = float(chdtri(len(outcome.point), 1.0 - LEVEL)) * chance / model.samples
    least = max(outcome.fitness, model.things * (model.noise or 0.0) ** 2)
    limit = outcome.fitness + min(doubt, 0.5 * least) + 1e-18
    found: list[Array] = []
    for point, fitness in outcome.minima:
        if fitness <= limit and all(apart(model, point, other) for other in (outcome.point, *found)):
            found.append(point)
    return found


def apart(model: ForwardModel, one: Array, other: Array) -> bool:
    """Whether two points are different machines; angles that differ by whole turns are not."""
    return bool(np.any(_differing(model, one, other)))


def within(model: ForwardModel, point: Array, parameters: Mapping[str, Value]) -> bool:
    """Whether intervals that are wide for the mesh's own error, more than for noise, include a point already."""
    if not any(value.correction is not None and abs(value.correction) > value.std for value in parameters.values()):
        return False
    values = zip(model.names, model.parameters.to_values(point), strict=True)
    return all(parameters[name].lower <= value <= parameters[name].upper for name, value in values)


def relation(model: ForwardModel, one: Array, other: Array) -> str:
    """What another solution is to the first: a mirror image, or just different."""
    differing = np.flatnonzero(_differing(model, one, other))
    paths = [entry.parameter.path or "" for entry in model.parameters.entries.values()]
    if all(paths[k].startswith("initial.") for k in differing):
        return "mirror images: the same marker positions with another pose"
    span = model.upper - model.lower
    if np.all(np.abs(np.abs(one) - np.abs(other)) <= _APART * span):
        return "mirror images: parameters with the opposite sign"
    return "different machines"


def _differing(model: ForwardModel, one: Array, other: Array) -> Array:
    paths = [entry.parameter.path or "" for entry in model.parameters.entries.values()]
    turning = np.array([path.startswith("initial.") and path.endswith(".angle") for path in paths])
    difference = np.abs(one - other)
    turned = np.abs(difference - 2 * np.pi * np.round(difference / (2 * np.pi)))
    difference = np.where(turning, turned, difference)
    return np.asarray(difference / (model.upper - model.lower) > _APART)
