"""Runs methods on problems: one process, one machine, medians of repeated whole calls."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from shoal.errors import ComputationError, InputError
from shoal.trajectory import Array, Status

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.judge import Outcome, judge
from shoal_validation.problems import Problem
from shoal_validation.work_precision import casadi, exudyn, gauss, mujoco, scipy
from shoal_validation.work_precision.contract import Method, Point, Run
from shoal_validation.work_precision.converged import converged

FAMILIES: dict[str, Callable[[Problem, bool], list[Method]]] = {
    "ours": gauss.methods,
    exudyn.FAMILY: exudyn.methods,
    casadi.FAMILY: casadi.methods,
    scipy.FAMILY: scipy.methods,
    mujoco.FAMILY: mujoco.methods,
}
HEADLINE = "flexible-case-1"
"""The one problem that is measured on all meshes."""
LONGEST = 0.6
"""A curve ends with the first run that takes longer [s], unless its coarsest run takes most of that time already."""
PATIENCE = 3
"""It also ends with so many runs that are long and fail."""
CHANGE = 0.01
"""Without a motion of the same mesh to compare with, a curve also ends where a finer setting changes its error by less
than this part: what is left is the error of the mesh."""
REPEATS, ENOUGH = 9, 0.15
"""Repeats of a call, and the time [s] after which there are no more."""


@dataclass(frozen=True)
class Study:
    """One problem: its points, the families that were left out and why, the references of single meshes."""

    problem: Problem
    points: list[Point]
    left_out: dict[str, str] = field(default_factory=dict)


def size(problem: Problem) -> float:
    """Size of a machine [m], taken as the marker's largest distance from the origin."""
    return _largest(problem.reference.points)


def study(problem: Problem, quick: bool = False, note: Callable[[str], None] = lambda _: None) -> Study:
    """Every family on one problem; `note` is called with the measurement under way."""
    brief = quick or problem.name != HEADLINE
    points: list[Point] = []
    left_out: dict[str, str] = {}
    for family, listed in FAMILIES.items():
        try:
            methods = listed(problem, brief)
        except InputError as error:
            left_out[family] = str(error)
            continue
        for method in methods:
            note(f"{problem.name}: {method.family}, {method.name} {method.mesh}")
            points += curve(problem, method, 1 if quick else REPEATS)
    return Study(problem, points, left_out)


def curve(problem: Problem, method: Method, repeats: int = REPEATS) -> Iterator[Point]:
    """The points of a method, coarse to fine."""
    before: Point | None = None
    longest, failures = 0.0, 0
    for setting in method.settings:
        seconds, run = timed(method.prepare(problem, setting), repeats)
        found = point(problem, method, setting, seconds, run, repeats if seconds < LONGEST else 1)
        yield found
        if found.status == Status.REFUSED:
            continue
        longest = longest or max(LONGEST, 1.5 * seconds)
        failures += not found.ok and seconds > LONGEST
        if seconds > longest or failures == PATIENCE:
            return
        if found.ok and found.mesh and found.mesh_error is None:
            if before and abs(found.error - before.error) < CHANGE * found.error:
                return
            before = found


def timed(call: Callable[[], Run], repeats: int = REPEATS) -> tuple[float, Run]:
    """Median time of a call [s] after a first one, which may build and compile, and its answer.

    A run that failed, or is very long, is not made again.
    """
    first, run = undisturbed(lambda: _caught(call))
    if run.status != Status.OK or first > 3 * LONGEST:
        return first, run
    taken: list[float] = []
    while not taken or (len(taken) < repeats and sum(taken) < ENOUGH):
        taken.append(undisturbed(lambda: _caught(call))[0])
    return statistics.median(taken), run


def point(problem: Problem, method: Method, setting: float, seconds: float, run: Run, repeats: int) -> Point:
    """Error of a run against the reference.

    One that is off by a tenth of the machine's size is silently wrong and not drawn.
    """
    error = _largest(run.path - problem.reference.points) if run.status == Status.OK else float("nan")
    outcome = judge(run.status, error, size(problem))
    believed = outcome in (Outcome.HOLDS, Outcome.INACCURATE)
    mesh = converged(problem, method.mesh) if believed else None
    return Point(
        family=method.family,
        method=method.name,
        mesh=method.mesh,
        setting=setting_name(method, setting),
        seconds=seconds / method.lanes,
        error=error,
        mesh_error=_largest(run.path - mesh.points) if mesh else None,
        loop_seconds=_loop(problem, method, setting, repeats) if believed else None,
        evaluations=run.evaluations,
        status=str(Status.OK if believed else outcome),
        message=run.message,
    )


def setting_name(method: Method, setting: float) -> str:
    """Text of a setting in tables, with its unit."""
    return f"{method.unit} {setting:.3g}" + (" s" if method.unit == "step" else "")


def _loop(problem: Problem, method: Method, setting: float, repeats: int) -> float | None:
    """Median time of the loop alone [s], of which the call's share of waiting for others is taken off."""
    if method.loop is None:
        return None
    taken: list[float] = []
    while not taken or (len(taken) < repeats and sum(taken) < ENOUGH):
        begin, busy = time.perf_counter(), time.process_time()
        seconds = method.loop(problem, setting)
        share = (time.process_time() - busy) / (time.perf_counter() - begin)
        taken.append(seconds * min(1.0, share))
    return statistics.median(taken)


def _caught(call: Callable[[], Run]) -> Run:
    """A run whose refusal is a result like any other."""
    try:
        return call()
    except (InputError, ComputationError) as error:
        status = Status.REFUSED if isinstance(error, InputError) else Status.FAILED
        return Run(np.full((1, 2), np.nan), status, str(error))


def _largest(away: Array) -> float:
    """Largest distance [m] of differences (samples, d)."""
    return float(np.max(np.linalg.norm(away, axis=1)))
