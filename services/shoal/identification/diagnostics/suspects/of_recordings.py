"""Fault hypotheses about a recording: clock, camera, inertial sensors, release, gravity, and other readings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from shoal.identification.diagnostics.suspects.candidate import FACTOR, PROBE, FaultHypothesis, size_of
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import RESERVED, Parameter
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.reading import whole_turns
from shoal.identification.recording.source import Channel, units_of
from shoal.trajectory import Array

_LATE = 0.2
_EARLY = 0.5
"""Of the record: how much may be missing after the release, and how long the machine may be held before it."""
_SHORTEST, _HOLDS = 0.005, 9
"""Of the record, the shortest hold that is tried, and how many up to the longest."""
_MOST = 6
"""Recordings that have candidates of their own."""
_SENSORS = {
    "mounting": ({"ax", "ay"}, np.pi / 2),
    "bias_ax": ({"ax"}, 5.0),
    "bias_ay": ({"ay"}, 5.0),
    "bias_az": ({"az"}, 5.0),
    "bias_rate": ({"rate"}, 1.0),
    "bias_wx": ({"wx"}, 1.0),
    "bias_wy": ({"wy"}, 1.0),
    "bias_wz": ({"wz"}, 1.0),
}
"""Of inertial sensors: the quantities that show a fault, and how large it may be [rad, m/s^2, rad/s]."""


def of_measurement(model: ForwardModel) -> Iterator[FaultHypothesis]:
    """The candidates of a model's recordings, of all by what the first one states, then of each by itself."""
    runs = model.measurement.recordings
    yield from _of(list(runs.values()))
    for name in list(runs)[:_MOST] if len(runs) > 1 else ():
        yield from _of([runs[name]], name)
    axes = np.flatnonzero(model.scene.gravity)
    if len(axes) == 1 and (axes[0] == 1 or model.scene.dimensions == 3):
        size = model.scene.gravity[axes[0]]
        lower, upper = sorted((size / FACTOR, size * FACTOR))
        probe = size * (1 + PROBE)
        yield FaultHypothesis.single(
            "gravity", f"gravity.{axes[0]}", size, (lower, upper), probe, "measurement", factor=True
        )


def _of(runs: list[Recording], name: str | None = None) -> Iterator[FaultHypothesis]:
    """Candidates by what recordings state, by the first one; name: of the only one, whose own it then is."""
    first, channels = runs[0], [channel for run in runs for channel in run.channels]
    own, of = ((), "") if name is None else ((name,), f" of recording {name}")
    positions = any(channel.is_position for channel in channels)
    reach = float(np.nanmax(np.abs(np.nan_to_num(first.values)))) + 1e-9
    end = max(float(run.times[-1]) for run in runs)
    for field in ("clock", "scale") if positions else ("clock",):
        stated = float(getattr(first.stated, field))
        bounds, probe = (stated / FACTOR, stated * FACTOR), stated * (1 + PROBE)
        path = f"{RESERVED}.{field}"
        yield FaultHypothesis.single(
            field + of, path, stated, bounds, probe, "measurement", law="log", factor=True, own=own
        )
    shifts = {"tilt": np.pi / 2} | ({"x": reach, "y": reach} if positions else {})
    shifts |= {
        field: size for field, (quantities, size) in _SENSORS.items() if quantities & {c.quantity for c in channels}
    }
    for field, width in shifts.items():
        stated = float(getattr(first.stated, field))
        bounds, probe = (stated - width, stated + width), stated + PROBE * width
        yield FaultHypothesis.single(field + of, f"{RESERVED}.{field}", stated, bounds, probe, "measurement", own=own)
    yield _delay(f"delay{of}", first.stated.delay, end, own)


def _delay(name: str, stated: float, end: float, own: tuple[str, ...]) -> FaultHypothesis:
    """Late after the release, or held before it.

    Of a short hold the parameters follow all but a kink, which no derivative shows: several holds are tried.
    """
    bounds = (stated - _EARLY * end, stated + _LATE * end)
    free = Parameter(path=f"{RESERVED}.delay", lower=bounds[0], upper=bounds[1], scale="linear", own=own or False)
    held = end * np.geomspace(_SHORTEST, _EARLY, _HOLDS)
    probes = np.append(stated + PROBE * end, stated - held).reshape(-1, 1, 1)
    bases = np.full((len(probes), 1), stated)
    return FaultHypothesis(name, "measurement", (free,), (stated,), probes, bases)


_UNITS = (1e3, 1e2, 25.4, float(np.degrees(1.0)))
"""Between metres, millimetres, centimetres and inches (by millimetres), degrees and radians."""
_TO_INCHES = 0.0254
"""Metres in an inch."""
_FAR = 4.0
"""Positions are read in a unit in which they lie within so many times the machine's reach, and not within 1 over it."""
_SWINGS = (0.3, 60.0)
"""Time is read in a unit in which a record lasts so many radians of a swing."""
_TURNS = (0.02, 100.0)
"""Angles are read in a unit in which they go so far [rad]."""
_PAIRS = 12
"""Columns that are exchanged, at most."""


@dataclass(frozen=True)
class Reading:
    """A model whose recordings are read otherwise.

    factor: of its positions or angles over those stated, by which its misfit is larger; value: that or 1 over it as
    the suspect names it
    """

    name: str
    change: str
    model: ForwardModel
    value: float
    factor: float = 1.0


def of_data(model: ForwardModel) -> Iterator[Reading]:
    """The readings of a model's recordings."""
    kinds = {c.quantity for recording in model.measurement.recordings.values() for c in recording.channels}
    axes = {"x", "y"} & kinds
    machine = size_of(model.scene)
    runs = model.measurement.recordings.values()
    for factor in sorted({*_UNITS, *(1 / unit for unit in _UNITS), _TO_INCHES, 1 / _TO_INCHES}) if axes else ():
        if 1 / _FAR < factor * _largest(runs, axes) / machine.reach < _FAR:
            name, change = "unit of the positions", f"a factor of {factor:.4g}"
            yield Reading(name, change, _read(model, _scaled(axes, factor)), factor, factor)
    turning = {"angle", "rate"} & kinds
    for factor in (_UNITS[3], 1 / _UNITS[3]) if turning else ():
        if _TURNS[0] < factor * _largest(runs, turning) < _TURNS[1]:
            name, change = "unit of the angles", f"a factor of {factor:.4g} (degrees and radians)"
            yield Reading(name, change, _read(model, _scaled(turning, factor)), factor, factor)
    for factor in (1e-3, 1e3, 1e-2, 1e2, 1 / 60.0, 60.0):
        if not _SWINGS[0] < factor * model.measurement.end * machine.rate < _SWINGS[1]:
            continue
        slower = _read(model, lambda run, factor=factor: replace(run, times=run.times * factor))  # type: ignore[misc]
        yield Reading("unit of the time", f"a factor of {factor:.4g}", slower, factor)
    for axis in sorted(axes):
        yield Reading(f"{axis} axis", "mirrored, it", _read(model, _scaled({axis}, -1.0)), -1.0)
    if len(axes) == 2:
        yield Reading("x and y axes", "exchanged, they", _read(model, _exchanged), -1.0)
        turned = _read(model, _scaled(axes, -1.0))
        yield Reading("x and y axes", "both mirrored, they", turned, -1.0)
    if "angle" in kinds:
        mirrored = _read(model, _scaled({"angle", "rate"}, -1.0))
        yield Reading("sense of the angles", "mirrored, it", mirrored, -1.0)
    for one, other in combinations(model.measurement.recordings, 2):
        if (changed := _files_exchanged(model, one, other)) is not None:
            yield Reading(f"files of recordings {one} and {other}", "exchanged, they", changed, -1.0)
    yield from _of_markers(model)
    yield from _of_columns(model, [*{c.name: c for run in runs for c in run.channels}.values()])


def _of_markers(model: ForwardModel) -> Iterator[Reading]:
    """Pairs of markers whose positions are exchanged in all recordings, as those that a tracker has confused."""
    channels = {(c.marker, c.quantity) for run in model.measurement.recordings.values() for c in run.channels}
    markers = sorted({marker for marker, quantity in channels if {(marker, "x"), (marker, "y")} <= channels})
    for one, other in list(combinations(markers, 2))[:_PAIRS]:
        swapped = _read(model, _markers_exchanged({one: other, other: one}))
        yield Reading(f"columns of {one} and {other}", "exchanged, they", swapped, -1.0)


def _of_columns(model: ForwardModel, channels: list[Channel]) -> Iterator[Reading]:
    """Single channels beside others with the sign turned, and pairs of a kind whose columns are exchanged."""
    others = [c for c in channels if not c.is_position]
    turning = [c for c in others if c.quantity in ("angle", "rate")]
    for channel in others if len(channels) > 1 else ():
        if channel not in turning or len(turning) > 1:
            turned = _read(model, _turned(channel.name))
            yield Reading(f"sign of the {channel.name}", "turned, it", turned, -1.0)
    pairs = [pair for pair in combinations(others, 2) if _of_a_kind(*pair)]
    for one, other in pairs[:_PAIRS]:
        swapped = _read(model, _swapped(one.name, other.name))
        yield Reading(f"columns of {one.name} and {other.name}", "exchanged, they", swapped, -1.0)


def _files_exchanged(model: ForwardModel, one: str, other: str) -> ForwardModel | None:
    """With the samples of two recordings of which something different is known; None for others."""
    runs = model.measurement.recordings
    a, b = runs[one], runs[other]
    if a.stated == b.stated or [c.name for c in a.channels] != [c.name for c in b.channels]:
        return None
    changed = {**runs, one: replace(b, stated=a.stated), other: replace(a, stated=b.stated)}
    return model.aside(measurement=replace(model.measurement, recordings=changed))


def _of_a_kind(one: Channel, other: Channel) -> bool:
    """Return whether columns may have been taken for each other: of one unit, and of one place or one quantity."""
    alike = one.place == other.place or one.quantity == other.quantity
    return alike and units_of(one.quantity) == units_of(other.quantity)


def _largest(runs: Iterable[Recording], quantities: set[str]) -> float:
    """The largest number among channels of some quantities, less their stated offset."""
    return max(
        float(np.nanmax(np.abs(run.values[:, k] - channel.offset)))
        for run in runs
        for k, channel in enumerate(run.channels)
        if channel.quantity in quantities
    )


def _read(model: ForwardModel, change: Callable[[Recording], Recording]) -> ForwardModel:
    return model.aside(measurement=model.measurement.changed(change))


def _scaled(quantities: set[str], factor: float) -> Callable[[Recording], Recording]:
    def change(run: Recording) -> Recording:
        factors = np.array([factor if channel.quantity in quantities else 1.0 for channel in run.channels])
        # An offset is stated in SI units: what is read otherwise is the column, whole turns and all.
        offset = np.array([channel.offset for channel in run.channels])
        values = offset + (run.values + run.turns - offset) * factors
        turning = [channel.quantity == "angle" for channel in run.channels]
        turns = np.where(turning, [whole_turns(column) for column in values.T], 0.0)
        return replace(run, values=values - turns, noise=run.noise * np.abs(factors), turns=turns)

    return change


def _turned(name: str) -> Callable[[Recording], Recording]:
    def change(run: Recording) -> Recording:
        sense, offset = np.array([(-1.0 if c.name == name else 1.0, c.offset) for c in run.channels]).T
        return replace(run, values=offset + (run.values - offset) * sense)

    return change


def _swapped(one: str, other: str) -> Callable[[Recording], Recording]:
    def change(run: Recording) -> Recording:
        order, columns = {c.name: k for k, c in enumerate(run.channels)}, list(range(len(run.channels)))
        if one in order and other in order:
            columns[order[one]], columns[order[other]] = order[other], order[one]
        return replace(run, values=run.values[:, columns], noise=run.noise[columns])

    return change


def _exchanged(run: Recording) -> Recording:
    """With x and y of each marker that has both exchanged."""
    other = {"x": "y", "y": "x"}
    return _reordered(run, {(c.marker, c.quantity): (c.marker, other.get(c.quantity, "")) for c in run.channels})


def _markers_exchanged(other: dict[str, str]) -> Callable[[Recording], Recording]:
    def change(run: Recording) -> Recording:
        positions = [c for c in run.channels if c.is_position and c.marker in other]
        return _reordered(run, {(c.marker, c.quantity): (other[c.marker], c.quantity) for c in positions})

    return change


def _reordered(run: Recording, source: dict[tuple[str, str], tuple[str, str]]) -> Recording:
    """With channels, by marker and quantity, that show the columns of others where there are such."""
    order: dict[tuple[str, str], int] = {(c.marker, c.quantity): k for k, c in enumerate(run.channels)}
    columns = [order.get(source.get(key, key), k) for key, k in order.items()]
    return replace(run, values=run.values[:, columns], noise=run.noise[columns])


def misfit(residual: Array) -> float:
    """Root mean square, infinite where a motion failed."""
    return float(np.sqrt(np.mean(residual**2))) if np.all(np.isfinite(residual)) else float("inf")
