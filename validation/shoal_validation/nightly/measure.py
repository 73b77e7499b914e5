"""Computation of one line of the plan, in the worker process: an error against the reference, and a time."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from shoal.engines import get_engine
from shoal.engines.capabilities import require
from shoal.errors import ComputationError, InputError
from shoal.trajectory import Status, Trajectory

from shoal_validation.benchmarks.timing import undisturbed
from shoal_validation.problems import get_problem

T = TypeVar("T")
REPEATS, ENOUGH = 9, 0.3
"""Repeats of a call, and the time [s] after which there are no more."""
LONG = 60.0
"""A call that takes longer [s] is not repeated."""


@dataclass(frozen=True)
class Measured:
    """error: [m] or [rad], nan where there is no motion; seconds: median of whole calls; message: why it is not ok.

    points: of the motion, for the next night to compare with, where nothing else says what is right [m]
    """

    status: str
    error: float
    seconds: float
    message: str = ""
    points: list[float] | None = None


def motion(problem: str, engine: str, values: Mapping[str, object], verify: bool = False) -> Measured:
    """A problem on an engine with fields of its scene set; verify: as `shoal simulate` does it. Raises InputError."""
    from shoal.engines.verification import verified

    wanted, chosen = get_problem(problem), get_engine(engine)
    scene = wanted.scene().with_values(dict(values))
    require(chosen, scene)
    if verify:
        return _motion(problem, lambda: verified(chosen, scene, wanted.times))
    return _motion(problem, lambda: chosen.simulate(scene, wanted.times))


def selection(problem: str, tolerance: float) -> Measured:
    """Measure the cheapest model for a tolerance [m] that `shoal simulate --tolerance` finds; all its runs are timed.

    The references are of slender rods: what these neglect is no error here, though it may keep an answer from being
    met.
    """
    from shoal.selection import select

    wanted = get_problem(problem)
    scene = wanted.scene().with_values({"solver.theory": "slender"})

    def of_slender_rods() -> Trajectory:
        found = select(scene, tolerance, wanted.times)
        meshed = found.chosen.error <= tolerance
        return (
            replace(found.trajectory, lane_findings=found.chosen.trajectory.lane_findings)
            if meshed
            else found.trajectory
        )

    return _motion(problem, of_slender_rods)


def angles(problem: str, method: str) -> Measured:
    """A problem of identification: largest error of a parameter [rad]; the making of the data is not timed."""
    from shoal.identification import identify, load_problem
    from shoal.identification.measure import measure

    wanted = load_problem(problem)
    data = measure(wanted, wanted.load_scene())
    seconds, estimate = timed(lambda: identify(wanted, method=method, measurement=data))
    error = max(abs(estimate.parameters[name].value - true) for name, true in estimate.truth.items())
    status = str(Status.OK) if estimate.verdict.trusted else str(estimate.verdict)
    return Measured(status, float(error), seconds, estimate.message)


def _motion(problem: str, call: Callable[[], Trajectory]) -> Measured:
    """A motion against the problem's reference."""
    seconds, trajectory = timed(call)
    error = get_problem(problem).error(trajectory) if trajectory.ok else np.nan
    return Measured(str(trajectory.status[0]), float(error), seconds, trajectory.message)


def timed(call: Callable[[], T]) -> tuple[float, T]:
    """Median time of a call [s]; the first, which loads kernels and builds the model, counts only if it is long."""
    first, answer = undisturbed(call)
    taken = [first] if first > LONG else [undisturbed(call)[0]]
    while len(taken) < REPEATS and sum(taken) < ENOUGH:
        taken.append(undisturbed(call)[0])
    return statistics.median(taken), answer


def attempt(run: Callable[[], Measured]) -> Measured:
    """A run whose refusal is a result like any other."""
    try:
        return run()
    except InputError as error:
        return Measured(str(Status.REFUSED), np.nan, np.nan, str(error))
    except ComputationError as error:
        return Measured(str(Status.FAILED), np.nan, np.nan, str(error))
