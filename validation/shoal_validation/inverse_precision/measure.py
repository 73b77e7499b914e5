"""One method on one case: how far the best point so far is from the truth, against evaluations and time."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from shoal.errors import InputError
from shoal.identification import Measurement
from shoal.swarm import BudgetExhausted
from shoal.trajectory import Array

from shoal_validation.inverse_precision.cases import Case
from shoal_validation.inverse_precision.contenders import Contender
from shoal_validation.inverse_precision.trace import Trace

CLOSE = 1e-3
"""A largest error of an angle [rad] up to which a run is a success."""
KEPT = 60
"""Improvements of a run that are kept, evenly over their number; the first and last always."""


@dataclass(frozen=True)
class Run:
    """One run. Arrays (improvements,): spent when each was known, and the point's largest angle error [rad].

    fitness: the best [m^2]; spent, wall: evaluations and seconds at the end; refused: why it could not be run, or empty
    """

    case: str
    method: str
    family: str
    seed: int
    evaluations: Array
    seconds: Array
    errors: Array
    fitness: float
    spent: int
    wall: float
    refused: str = ""

    @property
    def error(self) -> float:
        """Error of the best point at the end [rad]; infinite where there is none."""
        return float(self.errors[-1]) if len(self.errors) else float("inf")

    @property
    def success(self) -> bool:
        """Return whether it ends close to the truth."""
        return self.error <= CLOSE


def run(case: Case, measurement: Measurement, contender: Contender, seed: int, budget: int) -> Run:
    """Let the method search until it ends or the next call would exceed the budget."""
    model = case.model(measurement)
    trace = Trace(model.counter, cost=model.cost, budget=budget)
    model.counter = trace
    refused = ""
    begin = time.perf_counter()
    try:
        contender.search(model, np.random.default_rng(seed), lambda *_: None)
    except BudgetExhausted:
        pass
    except InputError as error:
        refused = str(error)
    wall = time.perf_counter() - begin
    truth = np.array(list(measurement.truth.values()))
    rows = trace.improvements
    kept = [rows[k] for k in sorted({*np.linspace(0, len(rows) - 1, min(KEPT, len(rows))).astype(int).tolist()})]
    return Run(
        case=case.name,
        method=contender.name,
        family=contender.family,
        seed=seed,
        evaluations=np.array([row.evaluations for row in kept], dtype=float),
        seconds=np.array([row.seconds for row in kept]),
        errors=np.array([float(np.max(np.abs(row.point - truth))) for row in kept]),
        fitness=trace.best_value,
        spent=trace.evaluations,
        wall=wall,
        refused=refused,
    )
