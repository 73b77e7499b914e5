"""Computations of the tasks: one plain function each, from small descriptions to frozen results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from shoal.engines import compare as comparing
from shoal.engines import get_engine, spot_checks
from shoal.engines import sweep as sweeping
from shoal.engines.gauss import GaussEngine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.identification import Estimate, Measurement, identify, load_problem, measure
from shoal.identification.conclude import Wishes
from shoal.identification.measure import Windows
from shoal.pictures.answer import Answer
from shoal.response import Response, uncertain
from shoal.response.limits import read_limits
from shoal.response.read import parameters
from shoal.response.stated import load_study
from shoal.response.worst import Worst, require_case, worst
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Trajectory

from shoal_flows import inputs

_POINTS = 300
"""Samples of a trajectory that is drawn and logged."""


@dataclass(frozen=True)
class Cell:
    """One optimisation of a study.

    values: fields of the scene to set; tolerance [m]: for which the model is chosen; sample: effective draws from the
    posterior; label: its readable name
    """

    problem: str
    method: str
    seed: int = 0
    engine: str = "gauss"
    values: dict[str, Any] = field(default_factory=dict)
    label: str = ""
    tolerance: float | None = None
    sample: int = 0

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


def measured(problem: str, data: str | None = None, hold_out: Windows | None = None) -> Measurement:
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
        wishes=Wishes(sample=cell.sample),
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


def simulated(scene: str, engine: str, values: Mapping[str, Any]) -> tuple[Scene, Trajectory]:
    """A scene with its motion, verified as `shoal simulate` does it. Raises InputError."""
    wanted = load_scene(scene).with_values(values)
    return wanted, verified(get_engine(engine), wanted)


def compared(scene: str, engines: Sequence[str] | None, values: Mapping[str, Any]) -> comparing.Comparison:
    """A scene on several engines. Raises InputError."""
    return comparing.compare(load_scene(scene).with_values(values), engines)


def responded(study: str, values: Mapping[str, Any]) -> tuple[Response, list[Worst]]:
    """A study of uncertain parameters with its worst cases, if any. Raises InputError, ComputationError."""
    stated = load_study(study)
    machine = stated.machine().with_values(values)
    asked = stated.asked()
    limits = read_limits(asked["limits"], asked["requirements"], machine)
    require_case(stated.worst_of, limits, machine, parameters(asked["vary"], machine))
    found = uncertain(machine, **asked)
    try:
        return found, worst(found, stated.worst_of)
    except InputError:
        return found, []


def swept(scene: str, grid: Mapping[str, Array], engine: str, time: float | None) -> sweeping.Sweep:
    """A scene over a grid, on one core: the others compute other pieces. Raises InputError."""
    chosen = get_engine(engine)
    if isinstance(chosen, GaussEngine):
        chosen = replace(chosen, threads=1)
    return sweeping.sweep(load_scene(scene), grid, chosen, time)


def spot_checked(found: sweeping.Sweep, engine: str) -> sweeping.Sweep:
    """A sweep with the errors that are estimated at a few of its points."""
    return spot_checks.spot_checked(found, get_engine(engine))
