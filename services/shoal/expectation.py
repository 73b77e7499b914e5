"""Expectations of a scene (`expect:`), each as a check of one run: its instants, and the error of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shoal.engines import get_engine
from shoal.engines.capabilities import require
from shoal.errors import ComputationError, InputError
from shoal.identification.recording.observation import camera, observe
from shoal.identification.recording.plausible import check_units
from shoal.identification.recording.reading import described, sampled
from shoal.identification.recording.source import Channel, FileSource
from shoal.identification.recording.units import QUANTITIES as UNITS
from shoal.identification.recording.virtual_sensors import (
    check_sensors,
    engine_options,
    from_start,
    with_sensor_markers,
)
from shoal.scene import Scene
from shoal.scene.expect import Expectation, ExpectedEngine, ExpectedRecording, ExpectedValue
from shoal.shelf import located
from shoal.table import load_table
from shoal.trajectory import Array, Trajectory

INSTANTS = 50
"""Evenly over the motion, where a whole motion is compared."""
QUANTITIES = ("x", "y", "angle")
"""As `shoal simulate --out` names the columns of a marker."""


@dataclass(frozen=True)
class Question:
    """A check of a run.

    scene: to simulate; times: to look at [s], (times,); source: of the expected value; unit: of the error;
    error: of a motion, which raises InputError or ComputationError; None where only the previous night is the reference
    """

    scene: Scene
    times: Array
    source: str
    unit: str = "m"
    error: Callable[[Trajectory], float] | None = None


def question(scene: Scene, name: str, document: Path) -> Question:
    """One expectation of a scene whose YAML file is `document`. Nothing is simulated. Raises InputError."""
    try:
        return _question(scene, scene.expect[name], document)
    except InputError as error:
        raise InputError(f"expect.{name}: {error}") from None


def _question(scene: Scene, expected: Expectation, document: Path) -> Question:
    if isinstance(expected, ExpectedValue):
        return _value(scene, expected)
    if isinstance(expected, ExpectedRecording):
        return _recording(scene, expected, document)
    times = scene.solver.duration * np.arange(1, INSTANTS + 1) / INSTANTS
    if not isinstance(expected, ExpectedEngine):
        return Question(scene, times, "the night before")
    other = get_engine(expected.engine)
    require(other, scene)

    def away(trajectory: Trajectory) -> float:
        theirs = other.simulate(scene, times)
        if not theirs.ok:
            raise ComputationError(f"{expected.engine}: {theirs.explanation}")
        return trajectory.distance(theirs)

    return Question(scene, times, expected.engine, error=away)


def _value(scene: Scene, expected: ExpectedValue) -> Question:
    channels = (Channel(marker=expected.marker, quantity=expected.quantity),)

    def away(trajectory: Trajectory) -> float:
        return abs(float(observe(trajectory, channels)[0, -1, 0]) - expected.value)

    unit = {"x": "m", "y": "m", "angle": "rad", "rate": "rad/s"}[expected.quantity]
    source = f"{expected.marker}.{expected.quantity} = {expected.value:g} {unit} at {expected.at:g} s"
    return Question(scene, np.array([expected.at]), source, unit, away)


def _recording(scene: Scene, expected: ExpectedRecording, document: Path) -> Question:
    """The signals that the recording states, else those of its columns that are called MARKER.x, MARKER.y, ..."""
    beside = document.parent / expected.path
    path = beside if beside.is_file() else Path(located("recordings", expected.path))
    if not path.is_file():
        raise InputError(f"path: {expected.path[:80]}: no such file, nor recording of the library")
    source = FileSource.model_validate(described({}, path))
    channels = tuple(source.channels or _called_so(scene, source))
    for channel in channels:
        for marker in (channel.marker, channel.to):
            if marker and marker not in scene.markers:
                known = ", ".join(scene.markers)
                raise InputError(f"path: {expected.path}: channels: no marker {marker!r}; there are {known}")
    own = scene.with_values(source.known)
    check_sensors(own, channels)
    found, source = sampled(source, channels)
    check_units(source, found.channels, found.times, found.values, scene, sized=False)
    instants = found.times / source.clock + source.delay
    if (first := float(instants[0])) < 0:
        raise InputError(f"path: {expected.path}: delay: the first sample would be {-first:g} s before the motion")

    wanted, native = from_start(instants, channels), get_engine("gauss")
    options = engine_options(native, own, channels)

    def away(trajectory: Trajectory) -> float:
        if options:
            trajectory = native.simulate(with_sensor_markers(own, channels), wanted, **options)
        seen = observe(trajectory, channels, camera(source), own)[0, len(wanted) - len(instants) :]
        return float(np.sqrt(np.nanmean(np.square(seen - found.values), axis=0).max()))

    unit = " or ".join(dict.fromkeys(UNITS[channel.quantity] for channel in channels))
    return Question(with_sensor_markers(own, channels), wanted, f"recording {expected.path}", unit, away)


def _called_so(scene: Scene, source: FileSource) -> list[Channel]:
    columns = load_table(Path(source.path or ""), source.columns).frame.columns
    found = [(marker, quantity) for marker in scene.markers for quantity in QUANTITIES]
    channels = [
        Channel(marker=marker, quantity=quantity, column=f"{marker}.{quantity}")
        for marker, quantity in found
        if f"{marker}.{quantity}" in columns
    ]
    if not channels:
        marker = next(iter(scene.markers))
        raise InputError(f"path: no column is called {marker}.x; a YAML file of the recording says `channels`")
    return channels
