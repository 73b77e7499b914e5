"""SI units: of measured quantities, and of the fields of a scene or a recording by their path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shoal.errors import InputError
from shoal.identification.recording.source import Channel, FileSource, units_of
from shoal.table_units import ALSO, TIMES, Units

if TYPE_CHECKING:
    from shoal.identification.recording.measurement import Measurement
    from shoal.identification.recording.source import Channel

QUANTITIES = {
    **{"x": "m", "y": "m", "z": "m", "angle": "rad", "rate": "rad/s"},
    **dict.fromkeys(("ax", "ay", "az"), "m/s²"),
    **dict.fromkeys(("wx", "wy", "wz"), "rad/s"),
    **dict.fromkeys(("fx", "fy", "fz", "normal", "friction"), "N"),
    "impact": "s",
    **dict.fromkeys(("mx", "my", "mz", "torque"), "N m"),
    "strain": "m/m",
    "signal": "",
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
    "rho_A": "kg/m",
    "rho_I": "kg m",
    "rho_I_side": "kg m",
    "EA": "N",
    "EI": "N m²",
    "EI_side": "N m²",
    "GJ": "N m²",
    "GA": "N",
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


def with_units(
    source: FileSource, channels: tuple[Channel, ...], units: Units
) -> tuple[FileSource, tuple[Channel, ...], list[str]]:
    """Statements of a recording, completed by the units of its table, and a note for each that they contradict.

    Statements win. Raises InputError for a unit that is not known, or that of another kind of quantity.
    """
    if not units.of:
        return source, channels, []
    notes: list[str] = []
    if source.rate is None and (unit := units.of.get(source.time, "")):
        where = f"{units.path}: row {units.row}, column {source.time!r}: "
        if "time_scale" not in source.model_fields_set:
            if unit not in TIMES:
                raise InputError(f"{where}unit {unit!r} is none of {', '.join(TIMES)}; state `time_scale`")
            source = source.model_copy(update={"time_scale": TIMES[unit]})
        elif abs(source.time_scale / TIMES.get(unit, source.time_scale) - 1.0) > 1e-9:
            notes.append(
                f"times: the table says {unit}, the recording time_scale {source.time_scale:g}, which is taken"
            )
    found = []
    for channel in channels:
        unit = _unit(channel, units)
        if unit and channel.unit is None:
            channel = channel.model_copy(update={"unit": unit})
        elif unit and unit != channel.unit:
            what = f"{channel.place} {channel.quantity}"
            notes.append(f"{what}: the table says {unit}, the recording {channel.unit}, which is taken")
        found.append(channel)
    return source, tuple(found), notes


def _unit(channel: Channel, units: Units) -> str:
    """The unit of a channel's column, as a channel states it; empty where its table names none."""
    allowed = units_of(channel.quantity)
    if channel.signal is not None:
        return ""
    found = []
    for column in (channel.column, channel.origin):
        text = units.of.get(column, "") if column else ""
        unit = _of_quantity(text, channel.quantity)
        if text and unit not in allowed:
            if channel.unit is not None:
                text = unit = ""
            else:
                known = ", ".join(f"{name}/s" if channel.quantity == "rate" else name for name in allowed)
                raise InputError(
                    f"{units.path}: row {units.row}, column {column!r}: unit {text!r} of {channel.quantity} is "
                    f"none of {known}; state `unit` and `scale` of the channel"
                )
        found.append(unit)
    if channel.unit is None and channel.origin and found[0] != found[1]:
        raise InputError(
            f"{units.path}: row {units.row}: column {channel.column!r} is in {found[0] or 'no unit'}, its origin "
            f"{channel.origin!r} in {found[1] or 'no unit'}; one unit is needed"
        )
    return found[0]


def _of_quantity(text: str, quantity: str) -> str:
    """A unit as a channel of that quantity names it: that of a rate is per second there."""
    if quantity != "rate":
        return text
    head, _, tail = text.partition("/")
    return head if ALSO.get(tail, tail) == "s" else f"{text} "
