"""Measured motion: from recordings, or computed by another engine than the one that is fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification.problem import RESERVED, Problem
from shoal.identification.recording.computed import kept
from shoal.identification.recording.measurement import Measurement, Recording
from shoal.identification.recording.observation import camera, observe, without_turns
from shoal.identification.recording.plausible import check_repeated, check_units
from shoal.identification.recording.reading import described, sampled
from shoal.identification.recording.source import Channel, Clocked, EngineSource, FileSource
from shoal.identification.recording.virtual_sensors import engine_options, from_start, with_sensor_markers
from shoal.scene import Scene
from shoal.scene.load import unknown
from shoal.scene.record import one_line
from shoal.shelf import NAME, located, shelf
from shoal.trajectory import Array

Windows = Sequence[tuple[float, float]]
"""Spans [from, to] in seconds of a recording's clock."""


def measure(
    problem: Problem,
    scene: Scene,
    data: str | Mapping[str, str] | None = None,
    hold_out: Windows | Mapping[str, Windows] | None = None,
) -> Measurement:
    """The measurement of a problem. Raises InputError, ComputationError.

    data: a file (CSV, Parquet, or a recording's YAML) or a recording of the library instead of the problem's own, or
        one for each recording by name
    hold_out: windows that are predicted instead of fitted, in place of those that the recordings state; by name where
        there are several
    """
    files, windows = _named(problem, data), _held(problem, hold_out)
    recordings, truth, read = {}, dict[str, float](), dict[str, Path]()
    for name, source in problem.sources.items():
        where = name if problem.recordings else problem.name
        if isinstance(source, EngineSource):
            if name in files:
                raise InputError(f"data: {where} computes its data; it takes no file")
            if name in windows:
                source = source.model_copy(update=windows[name])
            recordings[name], known = _computed(problem, source, scene, where)
            prefix = f"{name}." if problem.recordings else ""
            truth |= {(f"{prefix}{n}" if problem.parameters[n].own else n): x for n, x in known.items()}
            continue
        path = files.get(name) or source.path
        if path is None:
            raise InputError(
                f"data: {where} needs a recording; give one as data=FILE (on the command line: --data FILE)"
            )
        recordings[name], read[name] = _recorded(problem, scene, source, _file(path), windows.get(name, {}))
    check_repeated(recordings, read)
    return Measurement(recordings, truth)


def _named(problem: Problem, data: str | Mapping[str, str] | None) -> dict[str, str]:
    if data is None:
        return {}
    names = list(problem.sources)
    if isinstance(data, str):
        if len(names) > 1:
            raise InputError(f"data: {problem.name} has several recordings; give NAME=FILE for {', '.join(names)}")
        return {names[0]: data}
    for name in data:
        if name not in names:
            raise InputError(f"data: no recording {name!r} in {problem.name}; there are {', '.join(names)}")
    return dict(data)


def _held(problem: Problem, given: Windows | Mapping[str, Windows] | None) -> dict[str, dict[str, Any]]:
    """Windows by the recording, as changes of its source. Raises InputError."""
    if not given:
        return {}
    names = list(problem.sources)
    if not isinstance(given, Mapping):
        if len(names) > 1:
            raise InputError(
                f"hold_out: {problem.name} has several recordings; give NAME=FROM:TO for {', '.join(names)}"
            )
        given = {names[0]: given}
    found = {}
    for name, windows in given.items():
        if name not in names:
            raise InputError(f"hold_out: no recording {name!r} in {problem.name}; there are {', '.join(names)}")
        try:
            stated = Clocked.model_validate({"hold_out": [list(window) for window in windows]})
        except ValidationError as error:
            raise one_line(error, name) from None
        found[name] = {"hold_out": stated.hold_out}
    return found


def _file(given: str) -> Path:
    """The file of that path, or of the library's recording of that name. Raises InputError."""
    path = Path(located("recordings", given))
    if NAME.fullmatch(given) and not path.exists():
        known = [entry.name for entry in shelf().entries("recordings")]
        raise InputError(f"data: {unknown(given, 'file, nor recording of the library', known)}")
    return path


def _computed(problem: Problem, source: EngineSource, scene: Scene, where: str) -> tuple[Recording, dict[str, float]]:
    truth = scene.with_values({**source.known, **source.values})
    times = np.linspace(0.0, source.stop, source.count + 1)[1:]
    channels = problem.channels_of(source)
    instants = times / source.clock + source.delay

    def simulated() -> Array:
        wanted = from_start(instants, channels)
        engine = get_engine(source.engine)
        trajectory = engine.simulate(
            with_sensor_markers(truth, channels), wanted, **engine_options(engine, truth, channels)
        )
        if not trajectory.ok:
            raise ComputationError(f"{where}: the data could not be computed: {trajectory.message}")
        seen = without_turns(observe(trajectory, channels, camera(source), truth), channels)
        return np.asarray(seen[0, len(wanted) - len(times) :])

    values = kept(source.engine, truth, instants, (channels, camera(source)), simulated)
    values = values + source.noise * np.random.default_rng(source.seed).standard_normal(values.shape)
    origin = ", ".join([source.engine, *(f"{path}={value}" for path, value in source.values.items())])
    origin = origin if source.noise == 0 else f"{origin}, noise {source.noise:g}"
    recording = Recording(times, channels, values, origin, _noise(problem, channels), source.as_stated())
    recording = recording.holding(source.hold_out)
    paths = {name: parameter.path for name, parameter in problem.parameters.items()}
    return recording, {name: _true(truth, source, path) for name, path in paths.items() if path}


def _true(scene: Scene, source: EngineSource, path: str) -> float:
    head, _, rest = path.partition(".")
    return float(getattr(source, rest) if head == RESERVED else scene.value(path))


def _recorded(
    problem: Problem, scene: Scene, source: FileSource, path: Path, windows: Mapping[str, Any]
) -> tuple[Recording, Path]:
    """A recording, and its table."""
    source = FileSource.model_validate({**described(source.model_dump(exclude_unset=True), path), **windows})
    channels = problem.channels_of(source)
    problem.check_channels(channels, scene, path.name)
    found, source = sampled(source, channels)
    channels = found.channels
    sized = any(parameter.path == f"{RESERVED}.scale" for parameter in problem.parameters.values())
    check_units(source, channels, found.times, found.values, scene, sized)
    notes = (*found.notes, *_without_scale(problem, source, channels))
    found = replace(found, noise=_noise(problem, channels), stated=source.as_stated(), notes=notes)
    return found, Path(source.path or path)


def _without_scale(problem: Problem, source: FileSource, channels: tuple[Channel, ...]) -> tuple[str, ...]:
    """A note where nothing says how large a picture element is."""
    sized = source.scale != 1.0 or any(p.path == f"{RESERVED}.scale" for p in problem.parameters.values())
    if sized or not any(channel.unit == "px" and channel.scale == 1.0 for channel in channels):
        return ()
    return (f"positions in px count as metres; state `scale`, or seek it by a parameter {RESERVED}.scale",)


def _noise(problem: Problem, channels: tuple[Channel, ...]) -> Array:
    sizes = [channel.noise if channel.noise is not None else problem.noise for channel in channels]
    return np.array([np.nan if size is None else size for size in sizes])
