"""The audit: every evaluation of every method passes through one counter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.swarm.best import better_of, without_failures
from shoal.swarm.protocol import Array

BatchFunction = Callable[[Array], Array]


class BudgetExhausted(Exception):  # noqa: N818 - an end that is expected, not an error
    """The next batch would have exceeded the budget; it was not evaluated."""


class EvaluationCounter:
    """Counts the evaluations of a batch function and keeps its best point and best value in step.

    evaluations: points evaluated so far, including those that failed; failures: how many gave nan or inf
    best: best point, (d,), empty before the first evaluation; best_value: its value, inf before any finite one
    """

    def __init__(
        self, function: BatchFunction, *, cost: Callable[[Array], Array] | None = None, budget: int | None = None
    ) -> None:
        """Wrap `function`, which maps points (n, d) to values (n,).

        If it returns something else, such as residuals (n, m), `cost` turns that into the values (n,) to be logged.
        `budget` is the largest number of evaluations.
        """
        self._function = function
        self._cost = cost
        self._budget = budget
        self._improvements: list[tuple[int, float]] = []
        self.evaluations = 0
        self.failures = 0
        self.best: Array = np.empty(0)
        self.best_value = float("inf")

    def __call__(self, points: Array) -> Array:
        """Evaluate the function at points (n, d). Raises BudgetExhausted before exceeding the budget."""
        points = np.asarray(points, dtype=float)
        if points.ndim != 2:
            raise ValueError(f"points come in batches (n, d), found shape {points.shape}")
        count = len(points)
        if self._budget is not None and self.evaluations + count > self._budget:
            raise BudgetExhausted(f"{self.evaluations} of {self._budget} evaluations used, {count} more asked for")
        # A copy, because a function may write on its argument; counted first, because one that raises has cost too.
        asked = points.copy()
        before = self.evaluations
        self.evaluations += count
        result = self._function(points)
        values = without_failures(self._cost(result) if self._cost else result, count)
        self.failures += int(np.isinf(values).sum())
        self._record(before, asked, values)
        return result

    def charge(self, count: int, point: Array, value: float) -> None:
        """Note `count` evaluations that were made elsewhere, by another engine, and the best of them."""
        self.evaluations += count
        self._record(self.evaluations - 1, np.asarray(point, dtype=float)[None], np.array([value]))

    @property
    def history(self) -> tuple[Array, Array]:
        """Best value against evaluations: the numbers of the evaluations that improved it and of the last one, (m,),
        and the best value from there on, (m,); empty while there is no finite value.
        """
        log = list(self._improvements)
        if log and log[-1][0] < self.evaluations:
            log.append((self.evaluations, self.best_value))
        table = np.array(log, dtype=float).reshape(-1, 2)
        return table[:, 0], table[:, 1]

    def _record(self, before: int, points: Array, values: Array) -> None:
        if before == 0 and len(points):
            self.best = points[0]
        running = np.minimum.accumulate(np.concatenate([[self.best_value], values]))
        for index in np.flatnonzero(running[1:] < running[:-1]) + 1:
            self._improvements.append((before + int(index), float(running[index])))
        if len(points):
            self.best, self.best_value = better_of(self.best, self.best_value, points, values)
