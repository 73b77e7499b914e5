"""SI units: of measured quantities, and of the fields of a scene or a recording by their path."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shoal.identification.recording.measurement import Measurement
    from shoal.identification.recording.source import Channel

QUANTITIES = {
    **{"x": "m", "y": "m", "z": "m", "angle": "rad", "rate": "rad/s"},
    **dict.fromkeys(("ax", "ay", "az"), "m/s²"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    **dict.fromkeys(("fx", "fy", "fz"), "N"),
    **dict.fromkeys(("mx", "my", "mz", "torque"), "N m"),
    "strain": "m/m",
}
"""Of what a channel measures."""
_FIELDS = {
    "angle": "rad",
    "tilt": "rad",
    "mounting": "rad",
    **{"bias_ax": "m/s²", "bias_ay": "m/s²", "bias_az": "m/s²"},
    **dict.fromkeys(("bias_rate", "bias_wx", "bias_wy", "bias_wz"), "rad/s"),
    "direction": "rad",
    "rate": "rad/s",
    "length": "m",
    "height": "m",
    "width": "m",
    "end_height": "m",
    "end_width": "m",
    "wall": "m",
    "web": "m",
    "flange": "m",
    "centre_of_mass": "m",
    "position": "m",
    "x": "m",
    "y": "m",
    "z": "m",
    "velocity": "m/s",
    "gravity": "m/s²",
    "density": "kg/m³",
    "mass": "kg",
    "inertia": "kg m²",
    "youngs_modulus": "Pa",
    "torque": "N m",
    "delay": "s",
    "retardation": "s",
    "step": "s",
    "duration": "s",
}
"""By the last name of a path; names that mean different things in different places are not among them."""


def unit(path: str) -> str:
    """The unit of the field at a dotted path (`gravity.1`), empty where it has none or none is known."""
    names = [part for part in path.split(".") if not part.isdecimal()]
    return _FIELDS.get(names[-1], "") if names else ""


def of_channels(measurement: Measurement) -> str:
    """The unit that all channels of all recordings share, else nothing."""
    runs = measurement.recordings.values()
    units = {of_channel(channel) for recording in runs for channel in recording.channels}
    return units.pop() if len(units) == 1 else ""


def of_channel(channel: Channel) -> str:
    """The unit of a channel's samples: px where nothing but the recording's `scale` says how large one is."""
    return "px" if channel.unit == "px" and abs(channel.scale) == 1.0 else QUANTITIES[channel.quantity]


def squared(unit: str) -> str:
    """The square of a unit."""
    return f"({unit})²" if "/" in unit or " " in unit else f"{unit}²"
