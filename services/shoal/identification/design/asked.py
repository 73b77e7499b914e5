"""Noise, duration and rate of a planned measurement, as given or as the problem has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from shoal.arguments import Limit, brief
from shoal.errors import InputError
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.source import ACCELERATIONS, FORCES, MOMENTS, RATES, Channel, EngineSource
from shoal.trajectory import Array

_POSITIVE = Limit(gt=0)
_MOST = 4000
"""Instants at which sensitivities are computed, at most."""


POSITION, ANGLE = "position", "angle"
KINDS: dict[str, str] = {
    **dict.fromkeys(("x", "y", "z"), POSITION),
    **dict.fromkeys(ACCELERATIONS, "acceleration"),
    **dict.fromkeys(RATES, "rate"),
    **dict.fromkeys(FORCES, "force"),
    **dict.fromkeys(MOMENTS, "torque"),
}
"""What a quantity is as far as noise goes, where that is not the quantity itself."""
SENSORS = {"acceleration": "m/s^2", "rate": "rad/s", "force": "N", "torque": "N m", "strain": "m/m"}
"""What sensors on a machine measure, and in which unit."""


def kind_of(channel: Channel) -> str:
    """Kind of quantity that a channel measures: position, angle, acceleration, rate, force, torque or strain."""
    return KINDS.get(channel.quantity, channel.quantity)


def stated_noise(
    problem: Problem, noise: float | None, angle_noise: float | None, sensors: Mapping[str, float] | None
) -> dict[str, float]:
    """Standard deviations in SI units by what is measured, as given, else as the problem states them.

    A rate without its own is as noisy as an angle, per second. Raises InputError.
    """
    source = next(iter(problem.sources.values()))
    for kind in sensors or {}:
        if kind not in SENSORS:
            raise InputError(f"sensor_noise: no sensor of {kind!r}; there are {', '.join(SENSORS)}")
    named = {"noise": (POSITION, noise), "angle_noise": (ANGLE, angle_noise)}
    named |= {f"sensor_noise.{kind}": (kind, size) for kind, size in (sensors or {}).items()}
    for what, (_, size) in named.items():
        if size is not None and not _POSITIVE.holds(size):
            raise InputError(f"{what}: {brief(size)} is no standard deviation; it is positive")
    found = {kind: size for kind, size in named.values() if size is not None}
    channels = problem.channels_of(source)
    for channel in channels:
        size = channel.noise or problem.noise
        if size is not None:
            found.setdefault(kind_of(channel), size)
    if ANGLE in found and any(channel.quantity == "rate" for channel in channels):
        found.setdefault("rate", found[ANGLE])
    for kind in dict.fromkeys(map(kind_of, channels)):
        if kind not in found:
            field, unit = _ASKED.get(kind, (f"sensor_noise.{kind}", "in SI units"))
            raise InputError(
                f"{field}: {problem.name} states none for its {kind}s; give their standard deviation {unit}"
            )
    return found


_ASKED = {POSITION: ("noise", "in m"), ANGLE: ("angle_noise", "in rad")}


def noise_in(channel: Channel, noise: Mapping[str, float]) -> float:
    """Standard deviation of a channel, its own first."""
    return channel.noise or noise[kind_of(channel)]


def today_of(
    source: Any, measurement: Measurement | None, duration: float | None, rate: float | None
) -> tuple[float, float, float | None]:
    """Duration [s] and samples per second, as given, else of the measurement, else as the source says.

    And the first instant of the measurement [s], None without one. Raises InputError.
    """
    first = None
    if measurement is not None and len(times := measurement.first.times) > 1:
        first = float(times[0])
        found = (float(times[-1]), (len(times) - 1) / float(times[-1] - times[0]))
    elif isinstance(source, EngineSource):
        found = (source.stop, source.count / source.stop)
    else:
        found = (source.duration or 0.0, (source.rate or 0.0) / source.every)
    duration, rate = found[0] if duration is None else duration, found[1] if rate is None else rate
    for what, size, unit in (("duration", duration, "s"), ("rate", rate, "samples per second")):
        if not _POSITIVE.holds(size):
            raise InputError(f"{what}: needed, and positive [{unit}]; without a recording it cannot be guessed")
    return duration, rate, first


def grid(duration: float, rate: float, first: float | None = None) -> Array:
    """Instants until twice the duration at twice the rate. Raises InputError.

    first [s]: of them, else half a sampling interval
    """
    count = round(4 * duration * rate) if first is None else int((2 * duration - first) * 2 * rate + 1e-6) + 1
    if not 8 <= count <= _MOST:
        raise InputError(
            f"rate: {rate:g} samples per second over {duration:g} s; at most {_MOST // 4} in all, and at least 2"
        )
    return np.arange(1, count + 1) / (2 * rate) if first is None else first + np.arange(count) / (2 * rate)
