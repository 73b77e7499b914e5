"""What an identification costs: ours beside CasADi's shooting and scipy around Exudyn, on the paper's two cases.

`python -m shoal_validation.benchmarks.identification`. All are given the same data and start where the first samples
put the machine. CasADi and Exudyn fit the mesh that ours fits, each with its own time steps; ours chooses between both
elbow branches on its own bill, the other two are told which is right.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from scipy import optimize
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, identify, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.starts import starting_points
from shoal.trajectory import Array

from shoal_validation.benchmarks.timing import undisturbed

SAME_MESH = ("paper-case-1-same-mesh", "paper-case-2-same-mesh")
CONVERGED = ("paper-case-1", "paper-case-2")
COARSE = {"bodies.OA.elements": 2, "bodies.AB.elements": 4}
"""The mesh that data of the converged one are fitted with, for comparison [elements]."""
TOLERANCE = 1e-3
"""Of the model at the markers, where it is chosen [m]."""


@dataclass(frozen=True)
class Row:
    """One identification: largest error of an angle [rad], fitness [m^2], time [s], and that over the first row's."""

    name: str
    evaluations: int
    error: float
    fitness: float
    seconds: float
    ratio: float


Answer = tuple[int, float, float]
"""Evaluations, largest error of an angle [rad], fitness [m^2]."""


def same_mesh(name: str) -> list[Row]:
    """Ours, CasADi's single shooting, and scipy's least squares around Exudyn."""
    problem, measurement = _data(name)
    calls: dict[str, Callable[[], Answer]] = {
        "auto": lambda: _ours(problem, measurement, method="auto"),
        "casadi": lambda: _ours(problem, measurement, method="casadi"),
        "scipy + Exudyn": lambda: _scipy(problem, measurement, "exudyn"),
    }
    return _measured(name, calls)


def converged(name: str) -> list[Row]:
    """Data of a converged mesh: the coarse mesh, and a model that is chosen by `tolerance`."""
    problem, measurement = _data(name)
    calls: dict[str, Callable[[], Answer]] = {
        "auto, 2/4 elements": lambda: _ours(problem, measurement, values=COARSE),
        f"auto, tolerance {TOLERANCE:g} m": lambda: _ours(problem, measurement, tolerance=TOLERANCE),
    }
    return _measured(name, calls)


def _measured(name: str, calls: Mapping[str, Callable[[], Answer]]) -> list[Row]:
    """The rows of one case; every call is made twice, so that nothing is compiled or read in its time."""
    for call in calls.values():
        call()
    timed = {what: undisturbed(call) for what, call in calls.items()}
    first = next(iter(timed.values()))[0]
    return [Row(f"{name}: {what}", *answer, seconds, seconds / first) for what, (seconds, answer) in timed.items()]


def _data(name: str) -> tuple[Problem, Measurement]:
    problem = load_problem(name)
    return problem, measure(problem, problem.load_scene())


def _ours(
    problem: Problem,
    measurement: Measurement,
    *,
    method: str = "auto",
    values: Mapping[str, object] | None = None,
    tolerance: float | None = None,
) -> Answer:
    found = identify(problem, method=method, measurement=measurement, values=values, tolerance=tolerance)
    errors = [abs(found.parameters[name].value - true) for name, true in measurement.truth.items()]
    return found.evaluations, max(errors), found.fitness


def _scipy(problem: Problem, measurement: Measurement, engine: str) -> Answer:
    """Trust-region least squares with forward differences, as a user of that engine would write it."""
    model = ForwardModel(problem, problem.load_scene(), get_engine(engine), measurement)
    truth = np.array(list(measurement.truth.values()))
    starts = starting_points(model)
    start = starts[int(np.argmin(np.max(np.abs(starts - truth), axis=1)))]

    def residuals(point: Array) -> Array:
        return np.asarray(model.residuals(point[None])[0])

    bounds = (model.lower, model.upper)
    optimize.least_squares(residuals, start, bounds=bounds, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return model.counter.evaluations, float(np.max(np.abs(model.counter.best - truth))), model.counter.best_value


def main() -> None:
    """Measure and print."""
    console = Console(highlight=False)
    table = Table("", "evaluations", "error [deg]", "fitness [m^2]", "s", "times", box=box.SIMPLE_HEAD)
    groups = [same_mesh(name) for name in SAME_MESH] + [converged(name) for name in CONVERGED]
    for row in (row for group in groups for row in group):
        table.add_row(*_cells(row))
    console.print(table)


def _cells(row: Row) -> tuple[str, ...]:
    error = f"{np.degrees(row.error):.2e}"
    return row.name, str(row.evaluations), error, f"{row.fitness:.1e}", f"{row.seconds:.3f}", f"{row.ratio:.1f}"


if __name__ == "__main__":
    main()
