"""Cost of an error, measured again at the settings that the last full run found cheapest.

`python -m shoal_validation.work_precision.within` takes a minute where the full run takes a quarter of an hour. It
reads that run's points (docs/charts, or another folder), and makes for each flexible scene and error three whole calls
in turns: ours, 64 of ours at once, Exudyn's. Errors are computed anew. A ratio is the median over the rounds, so a
machine that others load changes it little; times are those of the processor at most.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import MANY, OURS, Method, Point, Run
from shoal_validation.work_precision.data import load
from shoal_validation.work_precision.exudyn import FAMILY as EXUDYN
from shoal_validation.work_precision.measure import FAMILIES, Study, setting_name
from shoal_validation.work_precision.table import costs

ROUNDS = 15
LONGEST = 10.0
"""Rounds end after so many seconds, but never before the fifth."""


class Row(NamedTuple):
    """A way to come within `reach` [m]: error [m], time of a simulation [s], and how many times Exudyn's that is."""

    problem: str
    reach: float
    label: str
    error: float
    seconds: float
    ratio: float


def measure(studies: list[Study], rounds: int = ROUNDS) -> Iterator[Row]:
    """The rows of all flexible problems, error by error."""
    for one in studies:
        for cost in costs(one) if one.problem.flexible else ():
            points = [point for point in (cost.exudyn, cost.ours, cost.many) if point is not None]
            if cost.exudyn is not None:
                yield from _again(one.problem, cost.reach, points, rounds)


def _again(problem: Problem, reach: float, points: list[Point], rounds: int) -> Iterator[Row]:
    """The runs of one error in turns, the first of which the others are compared with."""
    calls = [_call(problem, point) for point in points]
    errors = [_error(problem, call()) for _, call in calls]
    taken: list[list[float]] = []
    while len(taken) < rounds and (len(taken) < 5 or sum(map(sum, taken)) < LONGEST):
        taken.append([undisturbed(call)[0] / method.lanes for method, call in calls])
    for k, point in enumerate(points):
        seconds = statistics.median(row[k] for row in taken)
        ratio = statistics.median(row[0] / row[k] for row in taken)
        yield Row(problem.name, reach, point.label, errors[k], seconds, ratio)


def _call(problem: Problem, point: Point) -> tuple[Method, Callable[[], Run]]:
    """The method of a point, and the whole call at its setting."""
    families = {OURS: "ours", MANY: "ours", EXUDYN: EXUDYN}
    for method in FAMILIES[families[point.family]](problem, False):
        for setting in method.settings:
            told = (method.family, method.name, method.mesh, setting_name(method, setting))
            if told == (point.family, point.method, point.mesh, point.setting):
                return method, method.prepare(problem, setting)
    raise LookupError(f"{problem.name}: no method {point.label!r} any more; make the charts anew")


def _error(problem: Problem, run: Run) -> float:
    return float(np.max(np.linalg.norm(run.path - problem.reference.points, axis=1)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--points", type=Path, default=Path("docs/charts"), help="folder of work-precision.json")
    asked = parser.parse_args()
    studies, _ = load(asked.points)
    table = Table("problem", "within, m", "call", "error, m", "ms each", "times faster", box=box.SIMPLE_HEAD)
    for row in measure(studies, asked.rounds):
        figures = (f"{row.error:.1e}", f"{row.seconds * 1e3:.3f}", f"{row.ratio:.1f}")
        table.add_row(row.problem, f"{row.reach:.0e}", row.label, *figures)
    Console(highlight=False, width=140).print(table)


if __name__ == "__main__":
    main()
