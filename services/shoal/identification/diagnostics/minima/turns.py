"""Whole turns of angles, which no channel shows: of an answer's turns those nearest to the stated starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.identification.conventions import DIFFERENCE
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import nearest_attitudes
from shoal.identification.methods.outcome import Outcome
from shoal.trajectory import Array

_ALIKE = 1e-3
"""Of the fitness, and of the signal: what turns may change by the growth of round-off."""


def with_nearest_turns(model: ForwardModel, outcome: Outcome) -> Outcome:
    """The outcome with its angles, and those of its minima, nearest to their starts. Not counted. Raises TimeIsUp.

    Where turns change the fit, as by a prior or a spring that is wound up, they stay unless it is the better one.
    """
    turned = nearest_turns(model, outcome.point)
    if not np.isfinite(outcome.fitness) or np.array_equal(turned, outcome.point):
        return outcome
    fitness = float(model.cost(model.uncounted(turned[None]))[0])
    if not fitness <= outcome.fitness * (1.0 + _ALIKE) + (DIFFERENCE * model.rows.signal) ** 2:
        return outcome
    minima = [(nearest_turns(model, point), value) for point, value in outcome.minima]
    return replace(outcome, point=turned, fitness=fitness, minima=minima)


def nearest_turns(model: ForwardModel, point: Array) -> Array:
    """A point (parameters,) with each angle, of those within its bounds, by whole turns nearest to its start.

    Rotation vectors are taken to where they are nearest if all are within the bounds there.
    """
    turn = 2 * np.pi
    fewest = np.minimum(np.ceil((model.lower - point) / turn), 0.0)
    most = np.maximum(np.floor((model.upper - point) / turn), 0.0)
    turns = np.clip(np.round((model.parameters.start - point) / turn), fewest, most)
    angles = np.where(model.parameters.turning, point + turn * turns, point)
    near = nearest_attitudes(model, angles, model.parameters.start)
    return near if np.all((near >= model.lower) & (near <= model.upper)) else np.asarray(angles)
