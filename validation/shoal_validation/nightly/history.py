"""The nights before: one file each, never changed; and what the medians of the last seven say about a new line."""

from __future__ import annotations

import json
import os
import statistics
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from shoal.home import home

from shoal_validation.nightly.line import Line
from shoal_validation.nightly.result import Night, Result, Verdict

NIGHTS = 7
SLOWER, SLOWER_BY = 1.5, 5e-3
"""A line is slower beyond both this factor and so many seconds [s]."""
LESS_ACCURATE = 3.0
"""A line is less accurate beyond this factor, if its error is above what round-off may do."""


def folder() -> Path:
    """Folder of nights and page, made on demand. Raises InputError."""
    found = home() / "validation"
    found.mkdir(exist_ok=True)
    return found


def save(night: Night, where: Path) -> Path:
    """Write a night that was not there before. Raises FileExistsError."""
    target = where / f"night-{night.started.replace(':', '')}.json"
    if target.exists():
        raise FileExistsError(target)
    write_whole(target, json.dumps(night.to_json(), indent=1, allow_nan=False) + "\n")
    return target


def write_whole(target: Path, text: str) -> None:
    """Write a file at once: whoever reads it, or a machine that stops, sees the old one or the new one."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=".new-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def load(where: Path, machine: str) -> tuple[list[Night], list[Path]]:
    """The nights of a machine, oldest first, and the files that could not be read."""
    nights, unread = [], []
    for file in sorted(where.glob("night-*.json")):
        try:
            nights.append(Night.from_json(json.loads(file.read_text(encoding="utf-8"))))
        except ValueError:
            unread.append(file)
    return [night for night in nights if night.machine == machine], unread


def track(key: tuple[str, str, str], nights: Iterable[Night]) -> list[Result]:
    """One line through the nights, oldest first; nights without it are left out."""
    return [line for night in nights for line in night.lines if line.key == key]


def since_last(line: Line, points: Sequence[float], nights: Sequence[Night]) -> float:
    """Distance of a motion from that of the last night with the same version of its scene [m]; 0 where there is none.

    points: of its markers, by instants and markers, x and y next to each other
    """
    key = line.problem, line.engine, line.method
    for past in reversed(track(key, nights)):
        if past.version == line.version and past.points is not None and len(past.points) == len(points):
            return float(np.linalg.norm(np.reshape(np.subtract(points, past.points), (-1, 2)), axis=1).max())
    return 0.0


def compare(line: Result, nights: Sequence[Night]) -> Result:
    """The line with its usual values, and with its verdict if they speak against it."""
    alike = [past for past in track(line.key, nights) if past.version == line.version]
    before = [past for past in alike if past.verdict is not Verdict.FAILED][-NIGHTS:]
    errors = [past.error for past in before if past.error is not None]
    times = [past.seconds for past in before if past.seconds is not None]
    usual_error = statistics.median(errors) if errors else None
    usual_seconds = statistics.median(times) if times else None
    line = replace(line, usual_error=usual_error, usual_seconds=usual_seconds)
    if line.verdict is not Verdict.PASSED:
        return line
    if line.error and usual_error is not None and line.error > max(LESS_ACCURATE * usual_error, line.noise):
        expected = f"about {usual_error:.1e} {line.unit}, the median of {len(errors)} nights"
        return replace(line, verdict=Verdict.LESS_ACCURATE, expected=expected)
    if line.seconds and usual_seconds and line.seconds > max(SLOWER * usual_seconds, usual_seconds + SLOWER_BY):
        expected = f"about {usual_seconds * 1e3:.3g} ms, the median of {len(times)} nights"
        return replace(line, verdict=Verdict.SLOWER, expected=expected)
    return line
