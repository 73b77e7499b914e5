"""Carries out a plan: every line in the worker process, then against its limit and against the nights before."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
from shoal.home import processor
from shoal.trajectory import Status
from shoal.versions import versions

from shoal_validation.nightly.changes import changes
from shoal_validation.nightly.history import compare, since_last
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured
from shoal_validation.nightly.result import Night, Result, Verdict, apart
from shoal_validation.nightly.worker import Worker

TIMEOUT = 300.0
"""A line that takes longer [s] is stopped."""
PACKAGES = ("shoal", "numpy", "scipy", "numba", "exudyn", "casadi")

Progress = Callable[[int, Line], None]
"""Called with the number of lines done and the line that is next."""


def compiled(note: Callable[[str], None] = lambda _: None) -> None:
    """Compile all kernels before the first line of a whole night, whose time limit is not meant for that."""
    from shoal.mechanics.warm import warm  # after the folder of kernels is known

    warm(note=note)


def run(
    lines: Sequence[Line],
    before: Sequence[Night] = (),
    *,
    quick: bool = False,
    only: str | None = None,
    progress: Progress = lambda *_: None,
    timeout: float = TIMEOUT,
    now: datetime | None = None,
) -> Night:
    """Measure all lines. before: earlier nights of this machine; now: what the clock shows, if not that of this one."""
    started, begin = (now or datetime.now(UTC)).astimezone(UTC), time.perf_counter()
    found = []
    with Worker() as worker:
        for done, line in enumerate(lines):
            progress(done, line)
            result = _found(line, worker, timeout, before)
            if result.verdict is Verdict.SLOWER:
                # Others on the machine slow a run down, nothing speeds it up: the better of two tries counts.
                result = min(result, _found(line, worker, timeout, before), key=_seconds)
            found.append(result)
    wall = time.perf_counter() - begin
    when = started.replace(tzinfo=None).isoformat(timespec="milliseconds")
    night = Night(when, machine(), versions(PACKAGES), quick, only, wall, tuple(found))
    return replace(night, changes=changes(night, before))


def _found(line: Line, worker: Worker, timeout: float, before: Sequence[Night]) -> Result:
    """One line, measured and judged."""
    measured = worker.measure(line.run, timeout)
    if line.as_before and measured.points is not None:
        measured = replace(measured, error=since_last(line, measured.points, before))
    return compare(judged(line, measured), before)


def judged(line: Line, measured: Measured) -> Result:
    """A line against its own limit."""
    answered = measured.status == Status.OK
    digits = apart(measured.error, line.limit)
    if line.limit is None:
        verdict = Verdict.FAILED if answered else Verdict.NOT_POSSIBLE
        if measured.status in ("crashed", "timeout"):
            verdict = Verdict.FAILED
        expected = f"no answer: {line.reason}"
    else:
        verdict = Verdict.PASSED if answered and measured.error <= line.limit else Verdict.FAILED
        expected = f"at most {line.limit:.{digits}e} {line.unit} from {line.reference()}"
    return Result(
        problem=line.problem,
        engine=line.engine,
        method=line.method,
        expected=expected,
        found=_words(line, measured, digits),
        error=_number(measured.error),
        limit=line.limit,
        unit=line.unit,
        seconds=_number(measured.seconds),
        status=measured.status,
        verdict=verdict,
        reason=line.reason,
        noise=line.noise,
        version=line.version,
        points=measured.points,
    )


def machine() -> str:
    """Processor and cores: what times depend on."""
    return f"{processor()}, {os.cpu_count()} cores"


def _words(line: Line, measured: Measured, digits: int) -> str:
    if measured.status != Status.OK:
        return f"{measured.status}: {measured.message}" if measured.message else measured.status
    return f"{measured.error:.{digits}e} {line.unit} in {measured.seconds * 1e3:.3g} ms"


def _seconds(result: Result) -> float:
    return np.inf if result.seconds is None else result.seconds


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
