"""Computations of the tasks: one plain function each, from small descriptions to frozen results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from shoal import notebook
from shoal.engines import get_engine, spot_checks
from shoal.engines import sweep as sweeping
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.identification import Estimate, Measurement, identify, load_problem, measure
from shoal.identification.conclude import Options
from shoal.notebook import machine, motion
from shoal.pictures.answer import Answer
from shoal.requests.simulate import Simulate
from shoal.requests.sweep import Sweep
from shoal.response import Response, uncertain
from shoal.response.limits import read_limits
from shoal.response.read import parameters
from shoal.response.stated import load_study
from shoal.response.worst import Worst, require_case, worst
from shoal.scene import Scene
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows import inputs

_POINTS = 300
"""Samples of a trajectory that is drawn and logged."""


@dataclass(frozen=True)
class Cell:
    """One optimisation of a study.

    values: fields of the scene to set; label: its readable name; the others are those of `shoal identify`
    """

    problem: str
    method: str
    seed: int = 0
    engine: str = "gauss"
    values: dict[str, Any] = field(default_factory=dict)
    label: str = ""
    tolerance: float | None = None
    sample: int = 0
    profiles: bool = False
    bootstrap: int = 0
    time_limit: float | None = None

    @property
    def title(self) -> str:
        """Return the title of the problem."""
        return inputs.title(self.problem)

    @property
    def name(self) -> str:
        """Readable and unique within a study."""
        return self.label or f"{self.method} · seed {self.seed}"


@dataclass(frozen=True)
class Fit:
    """An estimate with the motion of the identified scene, by recording, on a fine grid of times."""

    cell: Cell
    estimate: Estimate
    motions: dict[str, Trajectory]

    @property
    def motion(self) -> Trajectory:
        """Return the motion of the first recording."""
        return next(iter(self.motions.values()))


def measured(problem: str, data: str | None = None, hold_out: Any = None) -> Measurement:
    """The motion to fit: read from `data`, or computed as the problem says. Raises InputError.

    hold_out: windows [s] that are predicted instead of fitted, in place of those that the recordings state
    """
    stated = load_problem(problem)
    return measure(stated, stated.load_scene(), data, hold_out)


def fit(cell: Cell, measurement: Measurement) -> Fit:
    """One optimisation, and the motion of what it found. Raises InputError, ComputationError."""
    estimate = identify(
        load_problem(cell.problem),
        method=cell.method,
        engine=cell.engine,
        values=cell.values,
        seed=cell.seed,
        measurement=measurement,
        tolerance=cell.tolerance,
        time_limit=cell.time_limit,
        options=Options(cell.profiles, cell.bootstrap, cell.sample),
    )
    return with_motion(cell, estimate)


def with_motion(cell: Cell, estimate: Estimate) -> Fit:
    """An estimate with the motion of what it found, over the time that each recording shows."""
    engine, answer, motions = get_engine(cell.engine), Answer(load_problem(cell.problem), estimate), {}
    for name, recording in estimate.measurement.recordings.items():
        view = answer.view(name)
        grid = np.linspace(0.0, float(recording.times[-1]) / view["clock"] + view["delay"], _POINTS)
        motions[name] = engine.simulate(estimate.scenes[name], grid)
    return Fit(cell, estimate, motions)


def simulated(asked: Simulate) -> tuple[Trajectory, Scene, Selection | None]:
    """Return the motion of a scene as `shoal simulate` computes it, with the scene. Raises InputError."""
    return motion(asked, machine(asked))


def answered(name: str, asked: Any) -> Any:
    """Return what the library's function of that name answers to its request. Raises InputError, ComputationError."""
    return getattr(notebook, name).answer(asked)


def responded(study: str, fields: Mapping[str, Any]) -> tuple[Response, list[Worst]]:
    """A study of uncertain parameters with its worst cases, if any. Raises InputError, ComputationError.

    fields: of its scene to set, by path, beside those that it states
    """
    asked = load_study(study)
    machine = asked.machine().with_values(fields)
    limits = read_limits(asked.limit, asked.require, machine)
    require_case(asked.worst_of, limits, machine, parameters(asked.vary, machine))
    found = uncertain(replace(asked, checkpoint=None), machine)
    try:
        return found, worst(found, asked.worst_of)
    except InputError:
        return found, []


def swept(asked: Sweep) -> sweeping.Sweep:
    """A scene over a grid, on one core: the others compute other pieces. Raises InputError."""
    chosen = get_engine(asked.engine)
    if isinstance(chosen, GaussEngine):
        chosen = replace(chosen, threads=1)
    return sweeping.sweep(asked.machine(), asked.vary, chosen, asked.at)


def spot_checked(found: sweeping.Sweep, engine: str) -> sweeping.Sweep:
    """A sweep with the errors that are estimated at a few of its points."""
    return spot_checks.spot_checked(found, get_engine(engine))
