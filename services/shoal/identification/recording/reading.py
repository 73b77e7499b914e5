"""From a file to the samples of its channels, in SI units; a file that is wrong gets one line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from shoal.errors import InputError
from shoal.identification.recording.measurement import FEWEST, Recording, differences
from shoal.identification.recording.source import IMPACT, Channel, FileSource, units_of
from shoal.identification.recording.swaps import mend
from shoal.identification.recording.units import with_units
from shoal.scene.load import read_yaml
from shoal.scene.record import one_line
from shoal.table import ColumnTable, Mask, load_table
from shoal.table_units import SI
from shoal.trajectory import Array

YAML = (".yaml", ".yml")
MOST = 20_000
"""Samples of a recording that are fitted; of more every n-th is taken, with a note."""
_ABOUT = 0.1
"""Of a recording: where its times begin within that part after zero, zero is meant."""
_OUTLIER = 8.0
"""Times the noise; an isolated sample farther off is counted as an outlier."""
_PAUSE = 1.5
"""Times the usual interval; a longer one is a gap."""
_MARKS = (999.0, 9999.0, 99999.0, 999999.0, 32768.0, 1e30, 1e37, 1e38)
"""Sizes of numbers that programs write for a gap."""
_APART = 3.0
"""Times the range of all other values, by which such a number is away from them."""
_HELD = 4
"""Samples in a row that are equal to the last digit: not measured, where else hardly any two are (_SELDOM)."""
_SELDOM = 0.02
_NEARLY = 0.8
"""Of half a turn; an angle that turns farther from one sample to the next may as well have turned the other way."""


def described(fields: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Fields of a FileSource that name a table: where `path` is a recording's YAML, what it states goes first.

    The YAML's own `path` is beside it. Raises InputError.
    """
    if path.suffix not in YAML:
        return {**fields, "path": str(path)}
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: cannot be read: not a file")
    try:
        own = read_yaml(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or 'not UTF-8 text'}") from None
    if not isinstance(own, dict):
        raise InputError(f"{path}: a recording is a mapping of fields, found {type(own).__name__}")
    try:
        source = FileSource.model_validate(own)
    except ValidationError as error:
        raise one_line(error, str(path), FileSource) from None
    if source.path is None or Path(source.path).suffix in YAML:
        raise InputError(f"{path}: path: the table of the recording (CSV or Parquet), found {source.path!r}")
    return {**fields, **own, "path": str(path.parent / source.path)}


def read(source: FileSource, channels: tuple[Channel, ...]) -> Recording:
    """The recording that a source describes, without its statements. Raises InputError."""
    return sampled(source, channels)[0]


def sampled(source: FileSource, channels: tuple[Channel, ...]) -> tuple[Recording, FileSource]:
    """Return the result of `read`, and the source with the unit of time of its table."""
    path = Path(source.path or "")
    table = load_table(path, source.columns)
    of_units: list[str] = []
    if table.units is not None:
        source, channels, of_units = with_units(source, channels, table.units)
    for column in (source.time, *(c.column for c in channels))[bool(source.rate) :]:
        table.require(column)
    times = _times(source, table)
    heard = any(channel.quantity == IMPACT for channel in channels)
    if heard and (len(channels) > 1 or source.every != 1):
        raise InputError(
            f"{path}: channels: times of impacts are a recording of one channel, of whose rows all are taken"
        )
    begin = _begin(source, times, heard)
    inside = _window(source, times, begin, path)
    columns = {name: table.numbers(name) for c in channels for name in (c.column, c.origin) if name is not None}
    for name, numbers in columns.items():
        _refuse_marks(numbers[inside], f"{path}: column {name!r}")
    notes = [f"the motion's time is zero at {begin:g} s, the first sample"] if source.start is None and begin else []
    notes = of_units + notes + (_mend(times, columns, channels) if source.swaps else [])
    signals, turns = [], np.zeros(len(channels))
    for k, channel in enumerate(channels):
        signal, note = _signal(source, channel, columns, times, inside)
        turns[k] = whole_turns(signal[inside]) if channel.quantity == "angle" else 0.0
        signals.append(signal - turns[k])
        notes += note
    values = (times - begin)[:, None] if heard else np.column_stack(signals)
    for channel, signal in zip(channels, values[inside].T, strict=True):
        if not np.any(np.isfinite(signal[:: source.every])):
            raise InputError(f"{path}: column {channel.column!r} has no sample from {_span(times[inside])}")
    notes += _findings(times[inside], values[inside], channels)
    chosen = np.flatnonzero(inside)[:: source.every]
    if (part := -(-len(chosen) // MOST)) > 1:
        notes.append(f"of {len(chosen)} samples every {part}th is fitted; `duration` or `every` choose others")
        chosen = chosen[::part]
    origin = f"{path.name}, {_span(times[chosen])}, {len(chosen)} samples"
    unknown = np.full(len(channels), np.nan)
    found = Recording(
        *(times[chosen] - begin, channels, values[chosen], origin, unknown),
        notes=tuple(notes),
        begin=begin,
        table=table.digest,
        turns=turns,
    )
    try:
        return found.holding(source.hold_out, begin), source
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _times(source: FileSource, table: ColumnTable) -> Array:
    """Times [s], (rows,), as recorded or counted. Raises InputError."""
    if len(table.rows) == 0:
        raise InputError(f"{table.path}: only 0 samples in the file; at least {FEWEST} are needed")
    if source.rate:
        return np.asarray(table.frames / source.rate)
    times = table.numbers(source.time) * source.time_scale
    where = f"{table.path}: row {{}}, column {source.time!r}: "
    for k in np.flatnonzero(np.isnan(times))[:1]:
        raise InputError(f"{where.format(table.rows[k])}a sample needs its time")
    for k in np.flatnonzero(np.diff(times) <= 0)[:1]:
        found = f"found {times[k + 1]:g} s after {times[k]:g} s"
        raise InputError(f"{where.format(table.rows[k + 1])}times must increase, {found}")
    return times


def _begin(source: FileSource, times: Array, heard: bool) -> float:
    """When the motion's time is zero, by the table's clock [s]. heard: whether the rows are impacts."""
    if source.start is not None:
        return source.start
    if heard:
        return 0.0
    about = times[-1] > 0 and times[0] <= _ABOUT * (times[-1] - times[0])
    return 0.0 if about else float(times[0])


def _window(source: FileSource, times: Array, begin: float, path: Path) -> Mask:
    """Mask of the rows in the window, (rows,), bool. Raises InputError."""
    stop = np.inf if source.duration is None else begin + source.duration
    inside: Mask = (times >= begin - 1e-9) & (times <= stop + 1e-9)
    count = len(np.flatnonzero(inside)[:: source.every])
    if count < FEWEST:
        raise InputError(
            f"{path}: only {count} samples from {begin:g} s to {stop:g} s (every {source.every}); at least "
            f"{FEWEST} are needed; the recording covers {_span(times)}"
        )
    return inside


def _refuse_marks(column: Array, where: str) -> None:
    """Refuse a number that programs write for a gap, such as -9999, where it is far from all others."""
    known = column[np.isfinite(column)]
    for mark in (known.min(), known.max()) if known.size else ():
        rest = known[known != mark]
        if abs(mark) not in _MARKS or len(rest) < FEWEST:
            continue
        if min(abs(rest.min() - mark), abs(rest.max() - mark)) > _APART * np.ptp(rest):
            raise InputError(
                f"{where}: {mark:g} stands {len(known) - len(rest)} times, far from the other values "
                f"({rest.min():.4g} to {rest.max():.4g}), as a mark of gaps does; leave such cells empty"
            )


def _mend(times: Array, columns: dict[str, Array], channels: tuple[Channel, ...]) -> list[str]:
    """Put exchanged markers right in the columns, in place; what was found, by rows of samples from 0."""
    places = {(c.marker, c.quantity): c.column for c in channels if c.is_position}
    pairs = {
        m: (places[m, "x"], places[m, "y"])
        for m, q in places
        if q == "x" and (m, "y") in places and (m, "z") not in places
    }
    if len(pairs) < 2 or len({name for pair in pairs.values() for name in pair}) < 2 * len(pairs):
        return []
    mended, notes = mend(times, {m: np.column_stack([columns[x], columns[y]]) for m, (x, y) in pairs.items()})
    for marker, (x, y) in pairs.items() if notes else ():
        columns[x], columns[y] = mended[marker].T
    return notes


def _signal(
    source: FileSource, channel: Channel, columns: dict[str, Array], times: Array, inside: Mask
) -> tuple[Array, list[str]]:
    """A channel in SI units, (rows,), and notes. Where y grows down, y and the sense of angles are turned round."""
    column = columns[channel.column]
    notes: list[str] = []
    unit = SI[channel.unit or units_of(channel.quantity)[0]]
    if channel.quantity == "angle":
        column, notes = _unwrapped(column, times, 2 * np.pi / unit, channel.marker, inside)
    if channel.origin:
        column = column - columns[channel.origin]
    seen = channel.quantity != "x" and not channel.is_sensor
    sense = -1.0 if source.y_axis == "down" and seen else 1.0
    return np.asarray(channel.offset + sense * channel.scale * unit * column), notes


def _unwrapped(angle: Array, times: Array, turn: float, marker: str, inside: Mask) -> tuple[Array, list[str]]:
    """An angle that jumps by whole turns made continuous; one that leaves the range of a turn is not wrapped."""
    known = np.flatnonzero(np.isfinite(angle))
    turns = np.round(np.diff(angle[known]) / turn)
    if not turns.any() or np.ptp(angle[known]) > 1.01 * turn:
        return angle, []
    smooth = angle.copy()
    smooth[known[1:]] -= turn * np.cumsum(turns)
    interval = np.diff(times[known])
    usual = interval <= _PAUSE * np.median(interval)
    steps = np.abs(np.diff(smooth[known]))
    fastest = float((steps / interval)[usual].max())
    doubtful = np.where(usual, steps > _NEARLY * turn / 2, fastest * interval > turn / 2)
    notes = [f"angle of {marker} jumps by whole turns: made continuous"] if turns[inside[known[1:]]].any() else []
    for k in np.flatnonzero(inside[known[1:]] & doubtful)[:1]:
        gap = f"{interval[k]:.3g} s from {times[known[k]]:g} s on"
        notes.append(f"angle of {marker}: its count of turns is a guess; no sample for {gap} is long for its motion")
    return smooth, notes


def whole_turns(angle: Array) -> float:
    """Return the whole turns [rad] of the first known sample of an angle, which say nothing about the motion."""
    known = angle[np.isfinite(angle)][:1]
    return float(2 * np.pi * np.round(known[0] / (2 * np.pi))) if known.size else 0.0


def _findings(times: Array, values: Array, channels: tuple[Channel, ...]) -> list[str]:
    """Gaps of the channels, dropped frames, uneven times, and outliers."""
    notes = []
    interval = np.diff(times)
    usual = float(np.median(interval))
    longer = interval > _PAUSE * usual
    if np.mean(np.abs(interval - usual) > 0.1 * usual) > 0.2:
        notes.append(f"uneven times: intervals of {interval.min():.3g} s to {interval.max():.3g} s")
    elif longer.any():
        frames = int(np.sum(np.round(interval[longer] / usual) - 1))
        notes.append(f"about {frames} dropped frames; intervals of {usual:.3g} s, the longest {interval.max():.3g} s")
    for channel, signal in zip(channels, values.T, strict=True):
        if missing := int(np.isnan(signal).sum()):
            notes.append(f"{channel.place} {channel.quantity}: {missing} of {len(times)} samples are gaps")
        notes += [f"{channel.place} {channel.quantity}: {held}" for held in _held(times, signal)]
        if count := _outliers(times, signal):
            notes.append(
                f"{channel.place} {channel.quantity}: outliers, {count} samples beyond {_OUTLIER:g} standard "
                "deviations of the noise; `loss: huber` lets them weigh less"
            )
    return notes


def _held(times: Array, signal: Array) -> list[str]:
    """Notes of stretches where a signal is constant to the last digit, as a lost marker is written."""
    known = np.isfinite(signal)
    t, x = times[known], signal[known]
    ends = np.flatnonzero(np.append(np.diff(x) != 0.0, True))
    lengths = np.diff(np.append(-1, ends))
    moving = lengths[lengths < _HELD]
    if not len(moving) or np.mean(moving > 1) > _SELDOM:
        return []
    found = []
    for k in [k for k in np.flatnonzero(lengths >= _HELD) if lengths[k] <= len(x) / 2][:1]:
        begin = ends[k] - lengths[k] + 1
        constant = f"{lengths[k]} samples in a row are all {x[begin]:.6g} from {t[begin]:g} s on"
        found.append(f"{constant}; if a marker was lost there, leave the cells empty")
    return found


def _outliers(times: Array, signal: Array) -> int:
    """Number of isolated outliers, by the cubic through four neighbours; none where times are uneven.

    A kink or a jump of the motion looks like one too, but is not mended by another value of that sample.
    """
    known = np.isfinite(signal)
    x, steps = signal[known], np.diff(times[known])
    if len(x) < 20 or np.ptp(steps) > 0.1 * np.median(steps):
        return 0
    signed = (x[2:-2] - (4 * (x[1:-3] + x[3:-1]) - x[:-4] - x[4:]) / 6) / np.sqrt(70 / 36)
    off = np.abs(signed)
    # What is left beside a sample when it takes the value that the cubic has there.
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(signed, 2), 5)
    left = np.max(np.abs(beside - signed[:, None] * np.array([1, -4, 6, -4, 1]) / 6), axis=1)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(off, 3), 7)
    # A spike spoils the prediction of the two samples on either side, and of no other; fast motion spoils them all.
    alone = (off == around.max(axis=1)) & (off > _OUTLIER * np.maximum(around[:, 0], around[:, 6]))
    # Of a signal in whole units (pixels) that hardly moves, the differences tell nothing below the unit.
    resolution = float(np.diff(np.unique(x)).min(initial=np.inf)) if np.ptp(x) else 0.0
    noise, background = differences(x), np.maximum(around[:, 0], around[:, 6])
    mended = left <= np.maximum(0.5 * _OUTLIER * np.maximum(background, noise), resolution)
    return int(np.sum(alone & mended & (off > _OUTLIER * max(noise, resolution))))


def _span(times: Array) -> str:
    return f"{times[0]:g} s to {times[-1]:g} s"
