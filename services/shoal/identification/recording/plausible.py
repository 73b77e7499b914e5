"""Plausibility of recordings before a search: other units than stated, constant channels, repeated samples.

A machine that only swings by gravity has a time scale and a size of its own. A recording that contradicts them by far
is refused with the unit that it seems to have; who states the unit is believed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.identification.conventions import ROUND_OFF
from shoal.identification.recording.measurement import FEWEST, Measurement, Recording
from shoal.identification.recording.source import Channel, FileSource
from shoal.scene import Scene
from shoal.scene.dimensions import padded
from shoal.scene.joints import Revolute, Weld, places
from shoal.trajectory import Array

_SLOWER = 50.0
"""Times the period of the machine stretched out: no swing is slower, but near a balance."""
_FASTER = 10.0
"""Times the angular frequency of the shortest body: no swing turns faster without a hundredfold energy."""
_FARTHER = 10.0
"""Times the machine's size to either side."""
_PARTS = 50.0
"""Of the shortest period: rates are taken over that time, so that noise does not count."""
_UPRIGHT = 1e-3
"""Of gravity: across the axis of a hinge, less swings nothing."""
_LENGTHS = {"cm": 100.0, "mm": 1000.0, "um": 1e6}
"""Units of length, by their number in a metre."""


@dataclass(frozen=True)
class Swing:
    """A machine under gravity alone: period of all its bodies stretched out, of the shortest [s], and size [m]."""

    slow: float
    fast: float
    size: float


def swing(scene: Scene) -> Swing | None:
    """The scales of a machine that is held by pivots and that gravity alone moves; None for any other."""
    gravity, swinging = math.hypot(*scene.gravity), _swinging(scene)
    held = {place.body for joint in scene.joints.values() for place in places(joint)}
    pivoted = all(isinstance(joint, Revolute | Weld) for joint in scene.joints.values())
    alone = not (scene.loads or scene.ground_points) and pivoted and held >= set(scene.bodies)
    if not alone or swinging <= _UPRIGHT * gravity:
        return None
    attached = [*(place for joint in scene.joints.values() for place in places(joint)), *scene.markers.values()]
    lengths = []
    for name, body in scene.bodies.items():
        named = (padded(point, scene.dimensions) for point in body.points.values())
        used = {*(scene.location(place) for place in attached if place.body == name), *named}
        lengths.append(max((math.dist(a, b) for a, b in combinations(used, 2)), default=0.0))
    if not (longest := sum(lengths)):
        return None
    shortest = min(length for length in lengths if length > 0.0)
    slow, fast = (2 * math.pi * math.sqrt(length / g) for length, g in ((longest, swinging), (shortest, gravity)))
    return Swing(slow, fast, longest)


def _swinging(scene: Scene) -> float:
    """Gravity [m/s^2] across the axes of the hinges, the least of all: along an axis it turns nothing."""
    gravity = np.array(padded(scene.gravity, 3))
    axes = [np.array(joint.axis) for joint in scene.joints.values() if isinstance(joint, Revolute)]
    across = [float(np.linalg.norm(np.cross(axis, gravity)) / np.linalg.norm(axis)) for axis in axes]
    return min(across, default=math.hypot(*gravity))


def check_units(
    source: FileSource, channels: tuple[Channel, ...], times: Array, values: Array, scene: Scene, sized: bool
) -> None:
    """Refuse a recording whose unit of time, length or angle is not stated and cannot be what it counts as.

    times [s]: (samples,); values: (samples, channels); sized: whether the scale of positions is sought. Raises
    InputError.
    """
    scales = swing(scene)
    if scales is None:
        return
    stated = source.model_fields_set & {"time_scale", "rate", "clock"}
    paces = [pace for signal in values.T if (pace := _pace(times, signal)) is not None]
    if paces and not stated and min(paces) > _SLOWER * scales.slow:
        raise InputError(
            f"{source.path}: time_scale: the recording lasts {times[-1] - times[0]:.4g} s and moves within about "
            f"{min(paces):.2g} s, while gravity swings {scene.name} in {scales.slow:.2g} s; are its times in "
            "milliseconds? time_scale: 1.0e-3 (time_scale: 1 if they are in s)"
        )
    for channel, signal in zip(channels, values.T, strict=True):
        if channel.unit is not None or channel.scale != 1.0:
            continue
        where = f"{source.path}: column {channel.column!r}"
        width = float(np.nanmax(signal) - np.nanmin(signal))
        if channel.quantity == "angle":
            rate = _rate(times, signal, scales.fast / _PARTS)
            if rate > _FASTER * 2 * math.pi / scales.fast:
                raise InputError(
                    f"{where}: values range over {width:.3g} and turn by up to {rate:.3g} in a second; degrees? "
                    "unit: deg (unit: rad if they are radians)"
                )
        elif channel.is_position and not sized and source.scale == 1.0 and width > 2 * _FARTHER * scales.size:
            fitting = [unit for unit, parts in _LENGTHS.items() if width / parts <= 2 * scales.size]
            guess = f"{fitting[0]}? unit: {fitting[0]}" if fitting else "another unit?"
            raise InputError(
                f"{where}: values range over {width:.3g} m, but {scene.name} is {scales.size:.3g} m long; {guess} "
                "(unit: m if they are metres)"
            )


def check_constant(measurement: Measurement, simulated: Callable[[str], Array]) -> None:
    """Refuse a recorded channel without any change where the model's moves. Raises InputError.

    simulated: channels (samples, channels) of a recording, by its name, as the model has them
    """
    if measurement.truth:
        return
    for name, recording in measurement.recordings.items():
        seen_often = np.isfinite(recording.values).sum(axis=0) >= FEWEST
        still = [k for k in np.flatnonzero(seen_often) if _spread(recording.values[:, k]) <= ROUND_OFF]
        # A machine that rests shows in all channels; that a single one stands still tells no rest.
        if not still or 1 < len(still) == len(seen_often):
            continue
        seen = simulated(name)
        for k in still:
            channel, moved = recording.channels[k], np.ptp(seen[:, k]) if np.all(np.isfinite(seen[:, k])) else 0.0
            if moved > ROUND_OFF * max(1.0, float(np.max(np.abs(seen[:, k])))):
                what = f"column {channel.column!r}" if channel.column else f"{channel.place} {channel.quantity}"
                value = float(np.nanmean(recording.values[:, k]))
                raise InputError(
                    f"{recording.origin}: {what} is constant ({value:.6g}), while {channel.place} {channel.quantity} "
                    "moves in the model; is it the right column?"
                )


def _pace(times: Array, signal: Array) -> float | None:
    """The period [s] of a harmonic signal of the same size and speed; None without a motion."""
    known = np.isfinite(signal)
    t, x = times[known], signal[known]
    if len(t) < 3 or _spread(x) <= ROUND_OFF:
        return None
    speed = float(np.sqrt(np.mean((np.diff(x) / np.diff(t)) ** 2)))
    return 2 * math.pi * float(np.std(x)) / speed


def _rate(times: Array, signal: Array, least: float) -> float:
    """Largest rate of a signal, but for a twentieth of the time, over steps of at least a given time [s].

    Of three samples in a row the middle one by size counts, so that single outliers do not.
    """
    known = np.isfinite(signal)
    t, x = times[known], signal[known]
    if len(t) < 4:
        return 0.0
    t, x = t[1:-1], np.median(np.stack([x[:-2], x[1:-1], x[2:]]), axis=0)
    every = max(1, math.ceil(least / float(np.median(np.diff(t)))))
    t, x = t[::every], x[::every]
    return float(np.percentile(np.abs(np.diff(x) / np.diff(t)), 95)) if len(t) > 1 else 0.0


def _spread(signal: Array) -> float:
    """Range of a signal over its size."""
    known = signal[np.isfinite(signal)]
    return float(np.ptp(known)) / max(float(np.max(np.abs(known))), 1e-300) if known.size else 0.0


Samples = npt.NDArray[np.intp]
_SHARED = 2
"""Samples from which on windows overlap: two that touch have one in common."""
_SAME = 1e-6
"""Of the interval between samples: times that differ by less are one."""


def check_repeated(recordings: Mapping[str, Recording], files: Mapping[str, Path]) -> None:
    """Refuse two recordings that are fitted to the same samples of a channel. Raises InputError.

    files: where recordings were read from, by their names; the others are not looked at. Two windows of one file, other
    columns of it, and held-out windows are no repetition.
    """
    for one, other in combinations(files, 2):
        a, b = recordings[one], recordings[other]
        pairs, (mine, its) = _pairs(a, b), _at_once(a, b)
        for i, k in pairs if files[one].resolve() == files[other].resolve() else ():
            column = a.channels[i].column
            twice = mine[np.isfinite(a.values[mine, i]) & np.isfinite(b.values[its, k])]
            if column == b.channels[k].column and len(twice) >= _SHARED:
                begin, end = a.begin + a.times[twice[0]], a.begin + a.times[twice[-1]]
                raise InputError(
                    f"recordings: {one} and {other} are fitted to the same {len(twice)} samples of column {column!r} "
                    f"of {files[one].name}, {begin:g} s to {end:g} s, which would count twice; name the file once, or "
                    "choose windows (`start`, `duration`) that do not overlap"
                )
        count = np.arange(min(len(a.times), len(b.times)))
        for at, then in ((mine, its), (count, count)):
            if pairs and all(_equal(a.values[at, i], b.values[then, k]) for i, k in pairs):
                raise InputError(
                    f"recordings: {one} and {other} hold the same {len(at)} samples ({files[one].name}, "
                    f"{files[other].name}); a copy would count twice: name it once"
                )


def _pairs(a: Recording, b: Recording) -> list[tuple[int, int]]:
    """Channels by number that show the same thing, or are read from columns of one name."""
    return [
        (i, k)
        for i, one in enumerate(a.channels)
        for k, other in enumerate(b.channels)
        if one.name == other.name or one.column == other.column
    ]


def _at_once(a: Recording, b: Recording) -> tuple[Samples, Samples]:
    """Samples by number, of either recording, at the same times of their tables."""
    times, others = a.begin + a.times, b.begin + b.times
    near = np.clip(np.searchsorted(others, times), 1, len(others) - 1)
    near -= times - others[near - 1] < others[near] - times
    same = np.abs(others[near] - times) <= _SAME * float(np.median(np.diff(times)))
    return np.flatnonzero(same), near[same]


def _equal(one: Array, other: Array) -> bool:
    """Return whether numbers that change are the same to the last digit, and gaps stand in the same places."""
    known = np.isfinite(one)
    return bool(np.sum(known) >= FEWEST and np.array_equal(one, other, equal_nan=True) and np.ptp(one[known]) > 0.0)
