"""What every identification method is given and what it returns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import Descent, distinct, history
from shoal.trajectory import Array


@dataclass(frozen=True)
class Outcome:
    """The best point a method found, (parameters,), its fitness, and how it got there.

    iterations: rows of (iteration, best fitness, mean fitness of the iteration)
    minima: other points where a local search ended, with their fitness
    choice: which method `auto` has taken, and why; ended: whether the method came to its end;
    converged: whether what it ended with is a minimum, as far as it can tell
    """

    point: Array
    fitness: float
    iterations: list[tuple[int, float, float]]
    message: str
    minima: list[tuple[Array, float]] = field(default_factory=list)
    choice: str = ""
    ended: bool = True
    converged: bool = True


Method = Callable[[ForwardModel, np.random.Generator, Progress], Outcome]


def concluded(model: ForwardModel, descents: Sequence[Descent], before: Sequence[tuple[int, float, float]]) -> Outcome:
    """The outcome of descents: the best, the other minima in order, and the rows of the search before and of theirs."""
    best, *others = distinct(model, descents) or [descents[0]]
    rows = list(before)
    for _, lowest, mean in history(descents):
        rows.append((len(rows), min(lowest, rows[-1][1]) if rows else lowest, mean))
    minima = [(descent.point, descent.fitness) for descent in others if descent.converged]
    return Outcome(best.point, best.fitness, rows, best.message, minima)
