"""From a file to the samples of its channels, in SI units; a file that is wrong gets one line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.recording import SI, Channel, FileSource
from shoal.trajectory import Array


@dataclass(frozen=True)
class Samples:
    """What a file holds; see `measurement.Recording`."""

    times: Array
    channels: tuple[Channel, ...]
    values: Array
    origin: str
    notes: tuple[str, ...] = ()


def read(source: FileSource, channels: tuple[Channel, ...], path: Path) -> tuple[FileSource, Samples]:
    """The samples of a recording, and the source that tells how they were read. Raises InputError."""
    table = _read_csv(path)
    needed = [source.time, *(channel.column for channel in channels)]
    for column in needed:
        if column not in table.columns:
            raise InputError(f"{path}: no column {column!r}; there are {', '.join(map(str, table.columns))}")
    columns = {column: _numbers(table[column], column, path) for column in dict.fromkeys(needed)}
    times = columns[source.time] * source.time_scale
    if np.any(np.diff(times) <= 0):
        row = int(np.argmax(np.diff(times) <= 0)) + 3
        raise InputError(f"{path}: row {row}, column {source.time!r}: times must increase")
    duration = np.inf if source.duration is None else source.duration
    inside = (times >= source.start - 1e-9) & (times <= source.start + duration + 1e-9)
    if inside.sum() < 3:
        raise InputError(
            f"{path}: only {inside.sum()} samples from {source.start:g} s to {source.start + duration:g} s; "
            f"the recording covers {times[0]:g} s to {times[-1]:g} s"
        )
    chosen = np.flatnonzero(inside)[:: source.every]
    values = np.column_stack([c.offset + c.scale * SI[c.unit or "m"] * columns[c.column][chosen] for c in channels])
    for k, channel in enumerate(channels):
        if channel.quantity == "angle":
            # Whole turns before the window say nothing about the motion in it.
            values[:, k] -= 2 * np.pi * np.round(values[0, k] / (2 * np.pi))
    return source, Samples(
        times[chosen] - times[chosen[0]],
        channels,
        values,
        f"{path.name}, {times[chosen[0]]:g} s to {times[chosen[-1]]:g} s, {len(chosen)} samples",
    )


def _read_csv(path: Path) -> Any:
    import pandas

    try:
        return pandas.read_csv(path)
    except (OSError, EOFError) as error:
        raise InputError(f"data: {path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"data: {path} is not CSV: {str(error).splitlines()[0]}") from None


def _numbers(series: Any, column: str, path: Path) -> Array:
    import pandas

    numbers: Array = pandas.to_numeric(series, errors="coerce").to_numpy(dtype=float)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise InputError(f"{path}: row {bad[0] + 2}, column {column!r}: {series.iloc[bad[0]]!r} is not a number")
    return numbers
