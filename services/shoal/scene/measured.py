"""Functions of time that a scene names by a file: the measured signal becomes a table in the scene, when it is read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np
from pydantic import ValidationError

from shoal.errors import InputError
from shoal.scene.record import NonNegative, Positive, Record, one_line
from shoal.scene.smoothing import smooth, strength_of
from shoal.shelf import LARGEST
from shoal.table_units import SI, TIMES, AngleUnit, ForceUnit, LengthUnit, TorqueUnit, Units

PARTS = ("joints", "loads", "ground_points")
"""Parts of a scene whose members have functions of time: PART.NAME.FIELD; those of signals are functions themselves."""
_LENGTHS = ("a length", {unit: SI[unit] for unit in get_args(LengthUnit) if unit != "px"})
_MEASURES: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "angle": ("an angle", {unit: SI[unit] for unit in get_args(AngleUnit)}),
    "torque": ("a torque", {unit: SI[unit] for unit in get_args(TorqueUnit)}),
    "scale": ("a force", {unit: SI[unit] for unit in get_args(ForceUnit)} | {"N/m": 1.0}),
    **dict.fromkeys(("length", "value", "x", "y", "z"), _LENGTHS),
}
"""What a field is, by its name, and the units that a line of units may state for it."""


class Signal(Record):
    """A column of a table (CSV or Parquet) over another.

    path: from the folder of the scene's file. time, column: their names; time_scale: seconds in a unit of the time,
    scale: SI units in a unit of the column. start: the time of the table [s] at which the motion begins. Rows with a
    gap are left out.
    smooth, noise: as of `Function`; where `smooth` is set and the noise is stated in SI units, the samples are
    smoothed first as far as they separate noise from motion
    """

    path: str
    column: str
    time: str = "t"
    time_scale: Positive = 1.0
    scale: float = 1.0
    start: float = 0.0
    smooth: bool = True
    noise: NonNegative | None = None

    def table(self, folder: Path, field: str) -> dict[str, Any]:
        """The function as a scene has it, for a field by its name. Raises InputError."""
        # Where no scene names a file, none of what reads tables is loaded.
        from shoal.table import load_table

        table = load_table(folder / self.path, largest=LARGEST)
        times, values = table.numbers(self.time), table.numbers(self.column)
        told = np.isfinite(times) & np.isfinite(values)
        pace = self._factor("time_scale", self.time, table.units, ("a time", TIMES))
        factor = self._factor("scale", self.column, table.units, _MEASURES.get(field, ("a number", SI)))
        rows = np.column_stack([pace * times - self.start, factor * values])[told]
        if field == "elastic":
            return {"table": rows.tolist(), "smooth": self.smooth}
        self._check_start(rows[:, 0])
        return {"smooth": self.smooth, **self._without_noise(rows)}

    def _without_noise(self, rows: np.ndarray) -> dict[str, Any]:
        """Return rows [t, value] as the table of a function, smoothed where the noise is stated, else unchanged."""
        if not self.smooth or not self.noise or np.any(np.diff(rows[:, 0]) <= 0.0):
            return {"table": rows.tolist(), "noise": self.noise}
        strength, _ = strength_of(rows[:, 0], rows[:, 1])
        if strength:
            rows[:, 1] = smooth(rows[:, 0], rows[:, 1], strength)
        return {"table": rows.tolist(), "noise": self.noise, "smoothing": strength}

    def _check_start(self, times: np.ndarray) -> None:
        """Refuse a motion that the table does not cover; times [s] of the motion.

        It begins at the table's end, or more than the table's length before it without a stated start.
        """
        if len(times) < 2 or np.any(np.diff(times) <= 0.0):  # refused by the table itself
            return
        first, last = times[0], times[-1]
        if last <= 0.0 or (first > last - first and "start" not in self.model_fields_set):
            raise InputError(
                f"start: the motion begins at {self.start:g} s of a table that covers {first + self.start:.10g} s to "
                f"{last + self.start:.10g} s; state `start`, a time of the table [s]"
            )

    def _factor(self, field: str, column: str, units: Units | None, measure: tuple[str, Mapping[str, float]]) -> float:
        """Return the stated factor, else that of the unit in the table; measure: the quantity and its units."""
        what, known = measure
        unit = units.of.get(column, "") if units else ""
        if field in self.model_fields_set or units is None or not unit:
            return float(getattr(self, field))
        if unit not in known and unit in (*SI, *TIMES):
            raise InputError(f"row {units.row}, column {column!r}: {unit!r} is no unit of {what}; state `{field}`")
        if unit not in known:
            raise InputError(f"row {units.row}, column {column!r}: unit {unit!r} is not known here; state `{field}`")
        return known[unit]


def with_signals(data: Any, folder: Path, source: str) -> Any:
    """The fields of a scene with the signals that they name as tables. Raises InputError, one line with the field."""
    for path, field, stated in signals(data):
        try:
            quantity = path[-1] if path[0] in PARTS else ""
            field[path[-1]] = Signal.model_validate(stated).table(folder, quantity)
        except ValidationError as error:
            raise one_line(error, f"{source}: {'.'.join(path)}", Signal) from None
        except InputError as error:
            raise InputError(f"{source}: {'.'.join(path)}: {error}") from None
    return data


def signals(data: Any) -> Iterator[tuple[tuple[str, ...], dict[str, Any], dict[str, Any]]]:
    """Yield the signals in the fields of a scene: the path, the mapping that holds the field, and the field."""
    for part in PARTS:
        members = data.get(part) if isinstance(data, dict) else None
        for name, member in members.items() if isinstance(members, dict) else ():
            for field, value in member.items() if isinstance(member, dict) else ():
                if isinstance(value, dict) and "path" in value:
                    yield (part, str(name), str(field)), member, value
    stated = data.get("signals") if isinstance(data, dict) else None
    of_scene: dict[str, Any] = stated if isinstance(stated, dict) else {}
    for name, value in of_scene.items():
        if isinstance(value, dict) and "path" in value:
            yield ("signals", str(name)), of_scene, value
