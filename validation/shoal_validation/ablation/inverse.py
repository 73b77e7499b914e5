"""The swarm on the inverse problem: sixteen combinations of its parts, one budget, many seeds.

The problem is `paper-case-1-same-mesh`: both angles from the tip's motion, data from CasADi on the mesh that is fitted,
so that only the time error of leapfrog remains (fitness 9e-13 m^2 at the truth).

An inverse problem has no previous time step. What stands for it here is the previous horizon: a fit of the first half
of the record by the same swarm with the same parts, but for the previous seed itself, in ten iterations. Its optimum is
the previous seed of the fit of the whole record. An evaluation of half the record counts one half, since it simulates
half the time. The traditional optimum is that of least squares; its evaluations count as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Measurement, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import least_squares
from shoal.swarm import BudgetExhausted, Iafsa, IafsaPrinted, minimize
from shoal.trajectory import Array

from shoal_validation.ablation.factorial import Combination, combinations

PROBLEM = "paper-case-1-same-mesh"
LEAPFROG = {"solver.integrator": "leapfrog", "solver.step": 2e-4}
SWARMS: dict[str, type[Iafsa] | type[IafsaPrinted]] = {"iafsa": Iafsa, "iafsa-printed": IafsaPrinted}
TARGET = 1e-12
"""Fitness [m^2] at which a search is over."""
CLOSE = 1e-4
"""A largest error of an angle [rad] below this is a success."""
BUDGET = 4040
"""Evaluations: the paper's 40 fish, the first swarm and 100 iterations."""
PREVIOUS_ITERATIONS = 10


@dataclass(frozen=True)
class Searches:
    """One swarm. Arrays are (2, 2, 2, 2, seeds), by parts off and on.

    evaluations: to the target, the budget where it is missed; reached: whether it is reached;
    error: largest error of an angle at the end [rad]
    """

    swarm: str
    evaluations: Array
    reached: Array
    error: Array

    @property
    def success(self) -> Array:
        """Share of seeds that end close to the truth, (2, 2, 2, 2)."""
        share: Array = np.mean(self.error < CLOSE, axis=-1)
        return share


@dataclass(frozen=True)
class Data:
    """The scene with cheap steps, and its whole and half records."""

    problem: Any
    scene: Any
    whole: Measurement
    half: Measurement

    @classmethod
    def load(cls) -> Data:
        """Computed once; every run shares it."""
        problem = load_problem(PROBLEM)
        whole = measure(problem, problem.load_scene())
        times = whole.first.times
        half = whole.until(float(times[len(times) // 2 - 1]))
        return cls(problem, problem.load_scene(LEAPFROG), whole, half)

    def model(self, record: Measurement) -> ForwardModel:
        """A forward model with a counter of its own."""
        return ForwardModel(self.problem, self.scene, get_engine("gauss"), record)

    @property
    def truth(self) -> Array:
        """The angles that the data were computed with [rad], (2,)."""
        return np.array(list(self.whole.truth.values()))


def measure_swarm(swarm: str, data: Data, *, seeds: int, note: Callable[[], None] = lambda: None) -> Searches:
    """All combinations and seeds; `note` is called after each run."""
    table = np.empty((3, 2, 2, 2, 2, seeds))
    for combination in combinations():
        for seed in range(seeds):
            place: tuple[slice | int, ...] = (slice(None), *map(int, combination), seed)
            table[place] = search(swarm, data, combination, seed, BUDGET)
            note()
    return Searches(swarm, *table)


def search(swarm: str, data: Data, combination: Combination, seed: int, budget: int) -> tuple[float, bool, float]:
    """Evaluations in runs of the whole record until the target, whether it was reached, error [rad] at the end."""
    traditional, previous, *_ = combination
    rng = np.random.default_rng(seed)
    spent = 0.0
    last = None
    if previous:
        half = data.model(data.half)
        seed_of_half = _traditional(half, rng) if traditional else None
        last = _swim(swarm, half, combination, seed_of_half, None, rng, 10 * budget, PREVIOUS_ITERATIONS)
        spent = half.counter.evaluations * len(data.half.first.times) / len(data.whole.first.times)
    model = data.model(data.whole)
    best = _traditional(model, rng) if traditional else None
    _swim(swarm, model, combination, best, last, rng, budget - int(spent), None)
    numbers, values = model.counter.history
    hit = np.flatnonzero(values < TARGET)
    evaluations = min(spent + numbers[hit[0]], budget) if hit.size else budget
    return float(evaluations), bool(hit.size), float(np.max(np.abs(model.counter.best - data.truth)))


def _traditional(model: ForwardModel, rng: np.random.Generator) -> Array:
    return least_squares(model, rng, lambda *_: None).point


def _swim(
    swarm: str,
    model: ForwardModel,
    combination: Combination,
    traditional: Array | None,
    previous: Array | None,
    rng: np.random.Generator,
    budget: int,
    iterations: int | None,
) -> Array:
    """The best point of a swarm that swims until the target, the budget or its last iteration, (2,)."""
    *_, velocity, mutation = combination
    box: dict[str, Any] = {"lower": model.lower, "upper": model.upper}
    seeds: dict[str, Any] = {"traditional": traditional, "previous": previous}
    optimizer: Any = SWARMS[swarm](**box, **seeds, use_velocity=velocity, use_mutation=mutation)

    def fitness(points: Array) -> Array:
        if model.counter.best_value < TARGET or model.counter.evaluations + len(points) > budget:
            raise BudgetExhausted
        return model.fitness(points)

    best: Array = minimize(optimizer, fitness, rng=rng, iterations=iterations, budget=budget).best
    return best
