"""Measurements: a method at one setting becomes one point of error and time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shoal.trajectory import Array, Status, Trajectory

from shoal_validation.problems import Problem

OURS, MANY = "ours", "ours, 64 at once"


@dataclass(frozen=True)
class Run:
    """Result of one call: path of the watched marker [m], (times, d); its status and message.

    evaluations: of the accelerations, where the method tells.
    """

    path: Array
    status: Status = Status.OK
    message: str = ""
    evaluations: int | None = None

    @classmethod
    def of(cls, problem: Problem, trajectory: Trajectory) -> Run:
        """The first lane of an engine's answer."""
        evaluations = trajectory.model.get("evaluations")
        return cls(trajectory.marker(problem.marker), trajectory.status[0], trajectory.message, evaluations)


@dataclass(frozen=True)
class Method:
    """One curve of a chart.

    family: whose code; name: integrator and what else sets it apart; mesh: see `mesh.py`, empty for rigid machines
    unit: what a setting is, `step` [s] or `tolerance` (relative); settings: from coarse to fine
    prepare: reads the scene and gives the call that is timed: the whole of what a user with a scene at hand waits for.
        The call raises InputError where it is refused, ComputationError where it gave up
    loop: seconds of the time loop alone, where the whole call also builds and checks
    lanes: simulations made by one call, which share its time
    """

    family: str
    name: str
    mesh: str
    unit: str
    settings: tuple[float, ...]
    prepare: Callable[[Problem, float], Callable[[], Run]]
    loop: Callable[[Problem, float], float] | None = None
    lanes: int = 1


@dataclass(frozen=True)
class Point:
    """A method at one setting.

    seconds: median of repeated whole calls; loop_seconds: of the time loop alone; error: largest distance of the
    watched marker from the problem's reference over all times [m]; mesh_error: from the time-converged motion of the
    same mesh [m]. Errors of runs that are not `ok` are nan: such runs are listed, never drawn.
    """

    family: str
    method: str
    mesh: str
    setting: str
    seconds: float
    error: float
    mesh_error: float | None = None
    loop_seconds: float | None = None
    evaluations: int | None = None
    status: str = str(Status.OK)
    message: str = ""

    @property
    def ok(self) -> bool:
        """Return whether it may be drawn."""
        return self.status == Status.OK and bool(np.isfinite(self.error))

    @property
    def label(self) -> str:
        """Description in one line."""
        return ", ".join(part for part in (self.family, self.method, self.mesh, self.setting) if part)


def counted(problem: Problem, counts: tuple[int, ...]) -> tuple[float, ...]:
    """Steps [s] that divide the problem's duration by these counts."""
    return tuple(float(problem.times[-1]) / count for count in counts)
