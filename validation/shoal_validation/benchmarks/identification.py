"""Cost of an identification: ours beside scipy around CasADi and around Exudyn, on the paper's two cases.

`python -m shoal_validation.benchmarks.identification`. All are given the same data, fit the same mesh, each with the
longest of its own steps that tell the angles to `careful.ACCURACY`, and start where the first samples put the machine.
Ours chooses between both elbow branches and looks for the error of its mesh, all on its own bill; the other two are
told which branch is right, and their systems are built beforehand. A single run of our solver stands beside them: a few
of these are the floor of anything that identifies by it. Times are medians.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, identify, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.starts import starting_points
from shoal.scene import Scene
from shoal.trajectory import Array

from shoal_validation.benchmarks import careful
from shoal_validation.benchmarks.timing import undisturbed

SAME_MESH = {"paper-case-1-same-mesh": 4e-4, "paper-case-2-same-mesh": 0.5 / 1700}
"""Steps of the classical Runge-Kutta method, ours and CasADi's, that are short enough for the angles [s]."""
CONVERGED = ("paper-case-1", "paper-case-2")
REPEATS = 15
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


def same_mesh(name: str, step: float) -> list[Row]:
    """Ours, scipy's least squares around CasADi and Exudyn, and a single run of our solver."""
    problem, measurement = _data(name)
    scene, recording = problem.load_scene({"solver.step": step}), measurement.first
    paths, marker = [parameter.path or "" for parameter in problem.parameters.values()], recording.channels[0].marker
    start = _start(problem, measurement)
    casadi = careful.around_casadi(scene, paths, marker, recording.times, recording.values, step)
    exudyn = careful.around_exudyn(scene, recording.times, recording.values)
    calls: dict[str, Callable[[], Answer]] = {
        "auto": lambda: _ours(problem, measurement, values={"solver.step": step}),
        "scipy + CasADi": lambda: _theirs(casadi(start), measurement),
        "scipy + Exudyn": lambda: _theirs(exudyn(start), measurement),
        "one run of ours": lambda: _run(scene, recording.times),
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
    """The rows of one case; every call is made once more before, so that nothing is compiled or read in its time."""
    for call in calls.values():
        call()
    timed = {what: [undisturbed(call) for _ in range(REPEATS)] for what, call in calls.items()}
    seconds = {what: statistics.median(time for time, _ in runs) for what, runs in timed.items()}
    first = next(iter(seconds.values()))
    return [Row(f"{name}: {what}", *timed[what][0][1], time, time / first) for what, time in seconds.items()]


def _data(name: str) -> tuple[Problem, Measurement]:
    problem = load_problem(name)
    return problem, measure(problem, problem.load_scene())


def _ours(
    problem: Problem,
    measurement: Measurement,
    *,
    values: Mapping[str, object] | None = None,
    tolerance: float | None = None,
) -> Answer:
    found = identify(problem, measurement=measurement, values=values, tolerance=tolerance)
    errors = [abs(found.parameters[name].value - true) for name, true in measurement.truth.items()]
    return found.evaluations, max(errors), found.fitness


def _run(scene: Scene, times: Array) -> Answer:
    """The motion alone, once: nothing that identifies takes less than a few of these."""
    get_engine("gauss").simulate(scene, times)
    return 1, float("nan"), float("nan")


def _theirs(found: careful.Found, measurement: Measurement) -> Answer:
    errors = np.abs(found.angles - np.array(list(measurement.truth.values())))
    return found.runs, float(np.max(errors)), found.fitness


def _start(problem: Problem, measurement: Measurement) -> Array:
    """Pose near the truth, of those that the first samples allow."""
    starts = starting_points(ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measurement))
    away = np.abs(starts - np.array(list(measurement.truth.values())))
    return np.asarray(starts[int(np.argmin(np.max(away, axis=1)))])


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    console = Console(highlight=False)
    table = Table("", "evaluations", "error [deg]", "fitness [m^2]", "s", "times", box=box.SIMPLE_HEAD)
    groups = [same_mesh(name, step) for name, step in SAME_MESH.items()] + [converged(name) for name in CONVERGED]
    for row in (row for group in groups for row in group):
        table.add_row(*_cells(row))
    console.print(table)


def _cells(row: Row) -> tuple[str, ...]:
    known = np.isfinite(row.error)
    error, fitness = (f"{np.degrees(row.error):.2e}", f"{row.fitness:.1e}") if known else ("", "")
    return row.name, str(row.evaluations), error, fitness, f"{row.seconds:.4f}", f"{row.ratio:.2g}"


if __name__ == "__main__":
    main()
