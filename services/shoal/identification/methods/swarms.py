"""The fish swarms on the inverse problem: 40 fish, 100 iterations, as in the paper's section 5."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.least_squares import least_squares
from shoal.identification.methods.outcome import Outcome
from shoal.identification.starts import starting_points
from shoal.swarm import Afsa, Iafsa, IafsaPrinted, minimize
from shoal.trajectory import Array

ITERATIONS = 100


def afsa(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """AFSA as published; it knows only the box."""
    return _search(model, Afsa(lower=model.lower, upper=model.upper), rng, progress)


def iafsa(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IAFSA as repaired, with both seeds."""
    traditional, previous = seeds(model, rng)
    optimizer = Iafsa(lower=model.lower, upper=model.upper, traditional=traditional, previous=previous)
    return _search(model, optimizer, rng, progress)


def iafsa_unseeded(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IAFSA as repaired, without the seeds of a traditional optimiser: what the swarm does by itself."""
    return _search(model, Iafsa(lower=model.lower, upper=model.upper), rng, progress)


def iafsa_printed(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """IAFSA exactly as printed in the paper, with both seeds."""
    traditional, previous = seeds(model, rng)
    optimizer = IafsaPrinted(lower=model.lower, upper=model.upper, traditional=traditional, previous=previous)
    return _search(model, optimizer, rng, progress)


def seeds(model: ForwardModel, rng: np.random.Generator) -> tuple[Array, Array]:
    """The paper's two additional fish, for the inverse problem; their evaluations are counted.

    The optimum of a traditional method is that of least squares; in place of the
    previous time step's optimum, which the inverse problem does not have, stands the pose that the first
    samples fix.
    """
    pose = starting_points(model)[0]
    return least_squares(model, rng, lambda *_: None).point, pose


def school(
    model: ForwardModel, optimizer: Any, rng: np.random.Generator, progress: Progress, iterations: int = ITERATIONS
) -> tuple[Any, list[tuple[int, float, float]]]:
    """Let a swarm search; returns its last state, and rows of (iteration, best, mean fitness)."""
    rows: list[tuple[int, float, float]] = []
    last: list[float] = []

    def evaluate(points: Array) -> Array:
        values = model.fitness(points)
        finite = values[np.isfinite(values)]
        last.append(float(finite.mean()) if finite.size else float("inf"))
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
