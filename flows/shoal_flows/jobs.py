"""What the tasks compute: one plain function each, from small descriptions to frozen results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from shoal.engines import compare as comparing
from shoal.engines import get_engine, spot_checks
from shoal.engines import sweep as sweeping
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.identification import Estimate, Measurement, identify, load_problem, measure
from shoal.pictures.answer import Answer
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array, Trajectory

_POINTS = 300
"""Samples of a trajectory that is drawn and logged."""
_PIECES = 4
"""Of a sweep, for each worker."""
_SMALLEST = 64
"""Points below which a piece is not worth its message."""


@dataclass(frozen=True)
class Cell:
    """One optimisation of a study. values: fields of the scene to set; label: its readable name."""

    problem: str
    method: str
    seed: int = 0
    engine: str = "gauss"
    values: dict[str, Any] = field(default_factory=dict)
    label: str = ""

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
        """That of the first recording."""
        return next(iter(self.motions.values()))


def measured(problem: str, data: str | None = None) -> Measurement:
    """The motion to fit: read from `data`, or computed as the problem says. Raises InputError."""
    stated = load_problem(problem)
    return measure(stated, stated.load_scene(), data)


def fit(cell: Cell, measurement: Measurement) -> Fit:
    """One optimisation, and the motion of what it found. Raises InputError, ComputationError."""
    estimate = identify(
        load_problem(cell.problem),
        method=cell.method,
        engine=cell.engine,
        values=cell.values,
        seed=cell.seed,
        measurement=measurement,
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
    """A scene with its motion. Raises InputError."""
    wanted = load_scene(scene).with_values(values)
    return wanted, get_engine(engine).simulate(wanted)


def compared(scene: str, engines: Sequence[str], values: Mapping[str, Any]) -> comparing.Comparison:
    """A scene on several engines. Raises InputError."""
    return comparing.compare(load_scene(scene).with_values(values), engines)


Grid = Mapping[str, Array]
"""Values by path, of which every combination is meant."""


def swept(scene: str, grid: Grid, engine: str, time: float | None) -> sweeping.Sweep:
    """A scene over a grid, on one core: the others compute other pieces. Raises InputError."""
    chosen = get_engine(engine)
    if isinstance(chosen, GaussEngine):
        chosen = replace(chosen, threads=1)
    return sweeping.sweep(load_scene(scene), grid, chosen, time)


def pieces(vary: Mapping[str, Sequence[float]], workers: int) -> list[Grid]:
    """A grid, stated as [low, high, count] by path, cut along its first axis so that no worker waits long for another.

    Raises InputError.
    """
    axes = {path: _axis(path, span) for path, span in vary.items()}
    if not axes:
        raise InputError("vary: name at least one path, as {path: [low, high, count]}")
    first, *others = axes
    points = int(np.prod([axis.size for axis in axes.values()]))
    count = min(axes[first].size, _PIECES * workers, -(-points // _SMALLEST))
    return [{first: part, **{path: axes[path] for path in others}} for part in np.array_split(axes[first], count)]


def joined(parts: Sequence[sweeping.Sweep]) -> sweeping.Sweep:
    """The pieces of a grid, in their order, as the whole; the time is the sum."""
    status = tuple(one for part in parts for one in part.status)
    return replace(
        parts[0],
        grid=_stacked([part.grid for part in parts]),
        positions=_stacked([part.positions for part in parts]),
        displacements=_stacked([part.displacements for part in parts]),
        status=status,
        wall_s=sum(part.wall_s for part in parts),
    )


def spot_checked(found: sweeping.Sweep, engine: str) -> sweeping.Sweep:
    """A sweep with the errors that are estimated at a few of its points."""
    return spot_checks.spot_checked(found, get_engine(engine))


def _stacked(columns: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([column[name] for column in columns]) for name in columns[0]}


def _axis(path: str, span: Sequence[float]) -> Array:
    if len(span) != 3 or span[2] != int(span[2]) or span[2] < 1:
        raise InputError(f"vary: {path}: needs [low, high, count], found {list(span)}")
    low, high, number = span
    return np.linspace(low, high, int(number))
