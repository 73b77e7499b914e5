"""Interface of identification methods: arguments and outcome."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.findings import Finding
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.lanes import Descent, differing, distinct, history
from shoal.trajectory import Array


@dataclass(frozen=True)
class Outcome:
    """The best point a method found, (parameters,), its fitness, and how it got there.

    iterations: rows of (iteration, best fitness, mean fitness of the iteration)
    minima: other points where a local search ended, with their fitness
    choice: which method `auto` has taken, and why; ended: whether the method came to its end;
    converged: whether what it ended with is a minimum, by its own criterion
    findings: what was found out on the way
    """

    point: Array
    fitness: float
    iterations: list[tuple[int, float, float]]
    message: str
    minima: list[tuple[Array, float]] = field(default_factory=list)
    choice: str = ""
    ended: bool = True
    converged: bool = True
    findings: list[Finding] = field(default_factory=list)

    def joined(self, model: ForwardModel, ends: Sequence[Descent], where: str) -> Outcome:
        """Return the outcome with further minima, the best of which is the answer; `where` it was found is its choice.

        Of equals (see `lowers`) the answer is the one from the stated starts.
        """
        known, apart = [self.point, *(point for point, _ in self.minima)], list[Descent]()
        for end in sorted(ends, key=lambda one: one.fitness):
            if np.isfinite(end.fitness) and all(np.any(differing(model, end.point, other)) for other in known):
                known.append(end.point)
                apart.append(end)
        minima = [*self.minima, *((end.point, end.fitness) for end in apart if end.converged)]
        if not apart or not lowers(model, apart[0].fitness, self.fitness):
            return replace(self, minima=minima)
        return replace(self, minima=minima).moved(apart[0], where)

    def moved(self, better: Descent, where: str) -> Outcome:
        """Return the outcome at a better minimum; where it was is left as another one."""
        choice = "; then ".join(part for part in (self.choice, where) if part)
        minima = [(self.point, self.fitness), *(end for end in self.minima if end[0] is not better.point)]
        there = replace(self, point=better.point, fitness=better.fitness, minima=minima, choice=choice)
        return replace(there, message=better.message and "no convergence", converged=better.converged)


def lowers(model: ForwardModel, fitness: float, than: float) -> bool:
    """Return whether a fitness is that of a better minimum than another one.

    It lowers the sum of squares by more than the mean square of a row, and so chi-square by more than one: by more than
    a standard deviation of one parameter.
    """
    return fitness < than * (1.0 - 1.0 / len(model.rows.time))


Method = Callable[[ForwardModel, np.random.Generator, Progress], Outcome]


def concluded(model: ForwardModel, descents: Sequence[Descent], before: Sequence[tuple[int, float, float]]) -> Outcome:
    """The outcome of descents: the best, the other minima in order, and the rows of the search before and of theirs."""
    best, *others = distinct(model, descents) or [descents[0]]
    rows = list(before)
    for _, lowest, mean in history(descents):
        rows.append((len(rows), min(lowest, rows[-1][1]) if rows else lowest, mean))
    minima = [(descent.point, descent.fitness) for descent in others if descent.converged]
    return Outcome(best.point, best.fitness, rows, best.message, minima)
