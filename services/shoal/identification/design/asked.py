"""What a measurement is planned for: noise, duration and rate, as given or as the problem has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.problem import Problem
from shoal.identification.recording.measurement import Measurement
from shoal.identification.recording.source import Channel, EngineSource
from shoal.trajectory import Array

_MOST = 4000
"""Instants at which sensitivities are computed, at most."""


def stated_noise(problem: Problem, noise: float | None, angle_noise: float | None) -> tuple[float, float | None]:
    """Standard deviations of positions [m] and angles [rad], as given, else as the problem states them."""
    source = next(iter(problem.sources.values()))
    for channel in problem.channels_of(source):
        stated = channel.noise or problem.noise
        if channel.is_position:
            noise = noise or stated
        elif channel.quantity == "angle":
            angle_noise = angle_noise or stated
    for what, size in (("noise", noise), ("angle_noise", angle_noise)):
        if size is not None and not (np.isfinite(size) and size > 0):
            raise InputError(f"{what}: {size:g} is no standard deviation; it is positive")
    if noise is None:
        raise InputError(f"noise: {problem.name} states none for positions; give their standard deviation in m")
    if angle_noise is None and any(not channel.is_position for channel in problem.channels_of(source)):
        raise InputError(
            f"angle_noise: {problem.name} states none for its angles; give their standard deviation in rad"
        )
    return noise, angle_noise


def noise_in(channel: Channel, noise: float, angle_noise: float | None) -> float:
    """Standard deviation of a channel; a rate without its own is as noisy as an angle, per second."""
    return channel.noise or (noise if channel.is_position else angle_noise or 1.0)


def today_of(
    source: Any, measurement: Measurement | None, duration: float | None, rate: float | None
) -> tuple[float, float]:
    """Duration [s] and samples per second, as given, else of the measurement, else as the source says."""
    if measurement is not None:
        times = measurement.first.times
        found = (float(times[-1]), len(times) / float(times[-1]))
    elif isinstance(source, EngineSource):
        found = (source.stop, source.count / source.stop)
    else:
        found = (source.duration or 0.0, (source.rate or 0.0) / source.every)
    duration, rate = found[0] if duration is None else duration, found[1] if rate is None else rate
    for what, size, unit in (("duration", duration, "s"), ("rate", rate, "samples per second")):
        if not (np.isfinite(size) and size > 0):
            raise InputError(f"{what}: needed, and positive [{unit}]; without a recording it cannot be guessed")
    return duration, rate


def grid(duration: float, rate: float) -> Array:
    """Instants until twice the duration at twice the rate. Raises InputError."""
    count = round(4 * duration * rate)
    if not 8 <= count <= _MOST:
        raise InputError(
            f"rate: {rate:g} samples per second over {duration:g} s; at most {_MOST // 4} in all, and at least 2"
        )
    return np.arange(1, count + 1) / (2 * rate)
