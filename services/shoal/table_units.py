"""The line of units that many instruments write under the names of the columns of a table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

LengthUnit = Literal["m", "cm", "mm", "um", "in", "px"]
AngleUnit = Literal["rad", "deg", "rev"]
AccelerationUnit = Literal["m/s^2", "g"]
ForceUnit = Literal["N", "kN", "mN"]
TorqueUnit = Literal["N m", "mN m", "N mm"]
StrainUnit = Literal["m/m", "um/m", "%"]
TimeUnit = Literal["s", "ms", "us"]
SI: dict[str, float] = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "in": 0.0254,
    "px": 1.0,
    "rad": 1.0,
    "deg": 0.017453292519943295,
    "rev": 6.283185307179586,
    **{"m/s^2": 1.0, "g": 9.80665},
    **{"N": 1.0, "kN": 1e3, "mN": 1e-3},
    **{"N m": 1.0, "mN m": 1e-3, "N mm": 1e-3},
    **{"m/m": 1.0, "um/m": 1e-6, "%": 1e-2},
    **{"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "1": 1.0,
}
"""What a unit is in those of SI; of a picture element the recording's `scale` tells the size."""
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
"""Seconds in a unit of time."""
ALSO = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **{"µs": "us", "μs": "us", "µm": "um", "μm": "um", "inch": "in", "inches": "in"},
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("pixel", "pixels"), "px"),
    **dict.fromkeys(("degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("turn", "turns", "revolution", "revolutions"), "rev"),
    **dict.fromkeys(("Nm", "N*m", "N·m"), "N m"),
    **dict.fromkeys(("Nmm", "N*mm", "N·mm"), "N mm"),
    **dict.fromkeys(("mNm", "mN*m", "mN·m"), "mN m"),
    **dict.fromkeys(("microstrain", "ustrain"), "um/m"),
}
"""Other words for a unit."""
_BRACKETED = re.compile(r"\[[^\[\]]*\]|\([^()]*\)|<[^<>]*>")
_NONE = ("", "-", "–", "none", "n/a", "na")
"""What a cell without a unit holds."""


@dataclass(frozen=True)
class Units:
    """Units that the line `row` of a file states of its columns, by their names; none where there is no such line."""

    path: Path
    row: int = 0
    of: Mapping[str, str] = field(default_factory=dict)


def is_unit_line(cells: Sequence[str]) -> bool:
    """Return whether cells are a line of units: none is a number, and a known unit or a word in brackets is among
    them.
    """
    words = [cell.strip() for cell in cells]
    return not any(_is_number(word) for word in words) and any(
        _known(word) or (_BRACKETED.fullmatch(word) and len(word) > 2) for word in words
    )


def of_columns(path: Path, row: int, names: Sequence[str], cells: Sequence[str]) -> Units:
    """The units of columns, from the cells of that line."""
    return Units(path, row, {name: unit for name, cell in zip(names, cells, strict=False) if (unit := bare(cell))})


def bare(cell: str) -> str:
    """A unit without its brackets, by its shortest name; empty where a cell names none."""
    word = cell.strip()
    word = word[1:-1].strip() if _BRACKETED.fullmatch(word) else word
    head, slash, tail = word.partition("/")
    if not slash and re.fullmatch(r".*[ ·*]?s(\^-1|⁻¹|-1)", word):
        head, slash, tail = re.sub(r"[ ·*]?s(\^-1|⁻¹|-1)$", "", word), "/", "s"
    head = head.strip()
    found = ALSO.get(head, ALSO.get(head.lower(), head)) + slash + tail.strip().replace("²", "^2").replace("s2", "s^2")
    return "" if found.lower() in _NONE else found


def _known(word: str) -> bool:
    unit = bare(word)
    names = (*get_args(LengthUnit), *get_args(AngleUnit))
    head, slash, tail = unit.partition("/")
    return unit in TIMES or unit in SI or unit == "Hz" or (head in names and (not slash or tail.split("^")[0] in TIMES))


def _is_number(word: str) -> bool:
    try:
        float(word.replace(",", "."))
    except ValueError:
        return False
    return word.lower().strip("+-") not in ("nan", "inf", "infinity")
