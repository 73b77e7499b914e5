"""Measured motion: from a recording, or computed by another engine than the one that is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification.problem import Channel, EngineSource, FileSource, Problem
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Measurement:
    """Samples of the channels. times [s]: (samples,), from the start of the motion to fit; values: (samples, channels).

    `origin` says where the data come from; `truth` holds the parameters of computed data, for the report.
    """

    times: Array
    channels: tuple[Channel, ...]
    values: Array
    origin: str
    truth: dict[str, float]

    @property
    def things(self) -> int:
        """How many things are observed: positions (x and y count as one) and angles."""
        return len({(c.marker, "angle" if c.quantity == "angle" else "position") for c in self.channels})


def observe(trajectory: Trajectory, channels: tuple[Channel, ...]) -> Array:
    """The channels of a trajectory, (lanes, samples, channels)."""
    columns = []
    for channel in channels:
        index = trajectory.markers.index(channel.marker)
        if channel.quantity == "angle":
            columns.append(trajectory.angles[:, index])
        else:
            columns.append(trajectory.points[:, index, 0 if channel.quantity == "x" else 1])
    return np.moveaxis(np.stack(columns, axis=1), -1, 0)


def measure(problem: Problem, scene: Scene, data: str | None = None) -> Measurement:
    """The measurement of a problem; `data` names a file instead of the problem's own. Raises InputError."""
    if isinstance(problem.source, EngineSource):
        if data is not None:
            raise InputError(f"data: {problem.name} computes its data; it takes no file")
        return _computed(problem, problem.source, scene)
    path = data or problem.source.path
    if path is None:
        raise InputError(f"data: {problem.name} needs a recording; give it with --data FILE.csv")
    return _recorded(problem, problem.source, Path(path))


def _computed(problem: Problem, source: EngineSource, scene: Scene) -> Measurement:
    truth = scene.with_values(source.values)
    times = np.linspace(0.0, source.stop, source.count + 1)[1:]
    trajectory = get_engine(source.engine).simulate(truth, times)
    if not trajectory.ok:
        raise ComputationError(f"{problem.name}: the data could not be computed: {trajectory.message}")
    return Measurement(
        times=times,
        channels=tuple(problem.channels),
        values=observe(trajectory, tuple(problem.channels))[0],
        origin=f"{source.engine}, " + ", ".join(f"{path}={value}" for path, value in source.values.items()),
        truth={name: float(truth.value(parameter.path)) for name, parameter in problem.parameters.items()},
    )


def _recorded(problem: Problem, source: FileSource, path: Path) -> Measurement:
    table = _read_csv(path)
    needed = [source.time, *(channel.column for channel in problem.channels)]
    for column in needed:
        if column not in table.columns:
            raise InputError(f"{path}: no column {column!r}; there are {', '.join(map(str, table.columns))}")
    columns = {column: _numbers(table[column], column, path) for column in dict.fromkeys(needed)}
    times = columns[source.time] * source.time_scale
    if np.any(np.diff(times) <= 0):
        row = int(np.argmax(np.diff(times) <= 0)) + 3
        raise InputError(f"{path}: row {row}, column {source.time!r}: times must increase")
    inside = (times >= source.start - 1e-9) & (times <= source.start + source.duration + 1e-9)
    if inside.sum() < 3:
        raise InputError(
            f"{path}: only {inside.sum()} samples from {source.start:g} s to {source.start + source.duration:g} s; "
            f"the recording covers {times[0]:g} s to {times[-1]:g} s"
        )
    chosen = np.flatnonzero(inside)[:: source.every]
    values = np.column_stack([c.offset + c.scale * columns[c.column][chosen] for c in problem.channels])
    for k, channel in enumerate(problem.channels):
        if channel.quantity == "angle":
            # Whole turns before the window say nothing about the motion in it.
            values[:, k] -= 2 * np.pi * np.round(values[0, k] / (2 * np.pi))
    return Measurement(
        times=times[chosen] - times[chosen[0]],
        channels=tuple(problem.channels),
        values=values,
        origin=f"{path.name}, {times[chosen[0]]:g} s to {times[chosen[-1]]:g} s, {len(chosen)} samples",
        truth={},
    )


def _read_csv(path: Path) -> Any:
    import pandas

    try:
        return pandas.read_csv(path)
    except (OSError, EOFError) as error:
        raise InputError(f"data: {path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"data: {path} is not CSV: {str(error).splitlines()[0]}") from None


def _numbers(series: Any, column: str, path: Path) -> Array:
    import pandas

    numbers: Array = pandas.to_numeric(series, errors="coerce").to_numpy(dtype=float)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise InputError(f"{path}: row {bad[0] + 2}, column {column!r}: {series.iloc[bad[0]]!r} is not a number")
    return numbers
