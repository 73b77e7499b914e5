"""A counter that remembers when and where each improvement was found."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shoal.swarm import BatchFunction, EvaluationCounter
from shoal.trajectory import Array


@dataclass(frozen=True)
class Improvement:
    """A new best: evaluations and seconds spent when it was known, the point (d,) and its fitness."""

    evaluations: int
    seconds: float
    point: Array
    fitness: float


class Trace(EvaluationCounter):
    """Counts as every counter does; a batch is known when all of it is. Seconds run from the making of the trace."""

    def __init__(self, function: BatchFunction, *, cost: Callable[[Array], Array], budget: int) -> None:
        """Wrap a function, for instance the counter of a forward model, as EvaluationCounter does."""
        super().__init__(function, cost=cost, budget=budget)
        self.improvements: list[Improvement] = []
        self._begin = time.perf_counter()

    def __call__(self, points: Array) -> Array:
        """Residuals of points (n, d). Raises BudgetExhausted before exceeding the budget."""
        result = super().__call__(points)
        self._note()
        return result

    def charge(self, count: int, point: Array, value: float) -> None:
        """Note evaluations that another engine made."""
        super().charge(count, point, value)
        self._note()

    def _note(self) -> None:
        if np.isfinite(self.best_value) and (not self.improvements or self.best_value < self.improvements[-1].fitness):
            seconds = time.perf_counter() - self._begin
            self.improvements.append(Improvement(self.evaluations, seconds, self.best.copy(), self.best_value))
