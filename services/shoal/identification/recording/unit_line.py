"""The line of units that many instruments write under the names of the columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from shoal.errors import InputError
from shoal.identification.recording.source import Channel, FileSource, units_of

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
"""Seconds in a unit of time."""
_ALSO = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **{"µs": "us", "μs": "us", "µm": "um", "μm": "um", "inch": "in", "inches": "in"},
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("pixel", "pixels"), "px"),
    **dict.fromkeys(("degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("turn", "turns", "revolution", "revolutions"), "rev"),
}
"""Other words for a unit."""
_BRACKETED = re.compile(r"\[[^\[\]]*\]|\([^()]*\)|<[^<>]*>")
_NONE = ("", "-", "–", "none", "n/a", "na")
"""What a cell without a unit holds."""


@dataclass(frozen=True)
class Units:
    """What the line `row` of a file says of its columns, by their names; nothing where there is no such line."""

    path: Path
    row: int = 0
    of: Mapping[str, str] = field(default_factory=dict)


def is_unit_line(cells: Sequence[str]) -> bool:
    """Whether cells are a line of units: none is a number, and a known unit or a word in brackets is among them."""
    words = [cell.strip() for cell in cells]
    return not any(_is_number(word) for word in words) and any(
        _known(word) or (_BRACKETED.fullmatch(word) and len(word) > 2) for word in words
    )


def bare(cell: str) -> str:
    """A unit without its brackets, by its shortest name; empty where a cell names none."""
    word = cell.strip()
    word = word[1:-1].strip() if _BRACKETED.fullmatch(word) else word
    head, slash, tail = word.partition("/")
    if not slash and re.fullmatch(r".*[ ·*]?s(\^-1|⁻¹|-1)", word):
        head, slash, tail = re.sub(r"[ ·*]?s(\^-1|⁻¹|-1)$", "", word), "/", "s"
    found = _ALSO.get(head.strip().lower(), head.strip()) + slash + tail.strip()
    return "" if found.lower() in _NONE else found


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
            what = f"{channel.marker} {channel.quantity}"
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
    return head if _ALSO.get(tail, tail) == "s" else f"{text} "


def _known(word: str) -> bool:
    unit = bare(word)
    lengths, angles = units_of("x"), units_of("angle")
    head, slash, tail = unit.partition("/")
    return unit in TIMES or unit == "Hz" or (head in (*lengths, *angles) and (not slash or tail.split("^")[0] in TIMES))


def _is_number(word: str) -> bool:
    try:
        float(word.replace(",", "."))
    except ValueError:
        return False
    return word.lower().strip("+-") not in ("nan", "inf", "infinity")


def of_columns(path: Path, row: int, names: Sequence[str], cells: Sequence[str]) -> Units:
    """The units of columns, from the cells of that line."""
    return Units(path, row, {name: unit for name, cell in zip(names, cells, strict=False) if (unit := bare(cell))})
