"""The fish swarms on the inverse problem: 40 fish, 100 iterations, as in the paper's section 5."""

from __future__ import annotations

import os
from dataclasses import fields
from typing import Any

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import mean_of
from shoal.identification.methods.least_squares import least_squares
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.starts import starting_points
from shoal.mechanics.numerics.tile import WIDE
from shoal.swarm import Iafsa, minimize
from shoal.trajectory import Array

ITERATIONS = 100
"""Iterations of a swarm, as in the paper (section 5)."""
AGREED = 1e-4
"""IAFSA ends where all that its fish remember differs by less in chi-square: by a hundredth of a standard deviation."""


def by_swarm(swarm: type[Any], model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """A swarm in the box of a problem, with the paper's two additional fish where it has places for them.

    Where its search does not depend on how many fish are simulated at once, these fill a tile for every core.
    """
    known = {field.name for field in fields(swarm)}
    settings: dict[str, Any] = seeds(model, rng) if {"traditional", "previous"} <= known else {}
    if "value_tolerance" in known:
        settings["value_tolerance"] = AGREED / len(model.rows.weight)
    if "batch" in known:
        settings["batch"] = (os.cpu_count() or 1) * len(WIDE)
    return _search(model, swarm(lower=model.lower, upper=model.upper, **settings), rng, progress)


def iafsa_unseeded(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IAFSA as repaired, without the seeds of a traditional optimiser: what the swarm does by itself."""
    optimizer = Iafsa(lower=model.lower, upper=model.upper, value_tolerance=AGREED / len(model.rows.weight))
    return _search(model, optimizer, rng, progress)


def seeds(model: ForwardModel, rng: np.random.Generator) -> dict[str, Array]:
    """The paper's two additional fish, for the inverse problem; their evaluations are counted.

    The optimum of a traditional method is that of least squares; in place of the previous time step's optimum, which
    the inverse problem does not have, stands the pose that the first samples fix.
    """
    pose = starting_points(model)[0]
    return {"traditional": least_squares(model, rng, lambda *_: None).point, "previous": pose}


def school(
    model: ForwardModel, optimizer: Any, rng: np.random.Generator, progress: Progress, iterations: int = ITERATIONS
) -> tuple[Any, list[tuple[int, float, float]]]:
    """Let a swarm search; returns its last state, and rows of (iteration, best, mean fitness)."""
    rows: list[tuple[int, float, float]] = []
    last: list[float] = []

    def evaluate(points: Array) -> Array:
        values = model.fitness(points)
        last.append(mean_of(values))
        return values

    def note(state: Any) -> None:
        if not rows or state.iteration > rows[-1][0]:
            rows.append((state.iteration, state.best_value, float(np.mean(last))))
            last.clear()
            progress(*rows[-1])

    return minimize(optimizer, evaluate, rng=rng, iterations=iterations, callback=note), rows


def _search(model: ForwardModel, optimizer: Any, rng: np.random.Generator, progress: Progress) -> Outcome:
    state, rows = school(model, optimizer, rng, progress)
    return Outcome(state.best, state.best_value, rows, "")
