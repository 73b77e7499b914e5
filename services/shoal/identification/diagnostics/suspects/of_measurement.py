"""What a recording states: clock, camera, inertial sensors, the release, and the gravity there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import RESERVED, Parameter
from shoal.identification.recording.measurement import Recording

_FACTORS = 2.0
"""Clock, scale and gravity are looked for within this factor."""
_LATE = 0.2
_EARLY = 0.5
"""Of the record: how much may be missing after the release, and how long the machine may be held before it."""
_SHORTEST, _HOLDS = 0.005, 9
"""Of the record, the shortest hold that is tried, and how many up to the longest."""
_STEP = 1e-4
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
        lower, upper = sorted((size / _FACTORS, size * _FACTORS))
        probe = size * (1 + _STEP)
        yield FaultHypothesis.single(
            "gravity", f"gravity.{axes[0]}", size, (lower, upper), probe, "measurement", factor=True
        )


def _of(runs: list[Recording], name: str | None = None) -> Iterator[FaultHypothesis]:
    """What recordings state, by the first one; name: of the only one, whose own it then is."""
    first, channels = runs[0], [channel for run in runs for channel in run.channels]
    own, of = ((), "") if name is None else ((name,), f" of recording {name}")
    positions = any(channel.is_position for channel in channels)
    reach = float(np.nanmax(np.abs(np.nan_to_num(first.values)))) + 1e-9
    end = max(float(run.times[-1]) for run in runs)
    for field in ("clock", "scale") if positions else ("clock",):
        stated = float(getattr(first.stated, field))
        bounds, probe = (stated / _FACTORS, stated * _FACTORS), stated * (1 + _STEP)
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
        bounds, probe = (stated - width, stated + width), stated + _STEP * width
        yield FaultHypothesis.single(field + of, f"{RESERVED}.{field}", stated, bounds, probe, "measurement", own=own)
    yield _delay(f"delay{of}", first.stated.delay, end, own)


def _delay(name: str, stated: float, end: float, own: tuple[str, ...]) -> FaultHypothesis:
    """Late after the release, or held before it.

    Of a short hold the parameters follow all but a kink, which no derivative shows: several holds are tried.
    """
    bounds = (stated - _EARLY * end, stated + _LATE * end)
    free = Parameter(path=f"{RESERVED}.delay", lower=bounds[0], upper=bounds[1], scale="linear", own=own or False)
    held = end * np.geomspace(_SHORTEST, _EARLY, _HOLDS)
    probes = np.append(stated + _STEP * end, stated - held).reshape(-1, 1, 1)
    bases = np.full((len(probes), 1), stated)
    return FaultHypothesis(name, "measurement", (free,), (stated,), probes, bases)
