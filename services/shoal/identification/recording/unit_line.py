"""What a recording states, completed by the line of units of its table."""

from __future__ import annotations

from shoal.errors import InputError
from shoal.identification.recording.source import Channel, FileSource, units_of
from shoal.table_units import ALSO, TIMES, Units


def with_units(
    source: FileSource, channels: tuple[Channel, ...], units: Units
) -> tuple[FileSource, tuple[Channel, ...], list[str]]:
    """What a recording states, completed by the units of its table, and a note for each that they contradict.

    What is stated wins. Raises InputError for a unit that is not known, or that of another kind of quantity.
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
