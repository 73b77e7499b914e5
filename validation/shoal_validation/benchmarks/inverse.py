"""The inverse problem: time and counted evaluations of every method on the same data."""

from __future__ import annotations

from dataclasses import dataclass

from shoal.identification import identify, load_problem, measure
from shoal.identification.estimate import Estimate

METHODS = ("least-squares", "iafsa", "iafsa-unseeded", "iafsa-printed", "afsa", "casadi")


@dataclass(frozen=True)
class InverseRow:
    """One method: counted evaluations, seconds, fitness [m^2], largest error of an angle [rad]."""

    name: str
    evaluations: int
    seconds: float
    fitness: float
    error: float


def measure_methods(problem_name: str, methods: tuple[str, ...] = METHODS, seed: int = 0) -> list[InverseRow]:
    """Every method on one problem, the second of two runs each, so that compilation does not count."""
    problem = load_problem(problem_name)
    data = measure(problem, problem.load_scene())
    rows = []
    for method in methods:
        identify(problem, method="least-squares" if method != "casadi" else "casadi", measurement=data)
        estimate = identify(problem, method=method, measurement=data, seed=seed)
        rows.append(
            InverseRow(
                f"{problem_name}: {method}",
                estimate.evaluations,
                estimate.wall_s,
                estimate.fitness,
                largest_error(estimate),
            )
        )
    return rows


def largest_error(estimate: Estimate) -> float:
    """Largest deviation of a parameter from the truth of computed data."""
    return max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())
