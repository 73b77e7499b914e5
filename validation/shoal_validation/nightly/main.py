"""`shoal validate`: the plan, the run, the files, the table."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from shoal.home import prepare_kernel_cache

from shoal_validation.nightly.hold import hold
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.page import headline, time_text
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.result import Night, Verdict
from shoal_validation.nightly.run import Progress as Note
from shoal_validation.nightly.run import compiled


def main(only: str | None, quick: bool, as_json: bool) -> bool:
    """Run a night, keep it and its page, print it; returns whether all is as it should be. Raises InputError."""
    lines = plan(only, quick)
    prepare_kernel_cache()
    if only is None:
        compiled(Console(stderr=True, highlight=False).print)
    return carry_out(lines, only, quick, as_json)


def carry_out(lines: Sequence[Line], only: str | None, quick: bool, as_json: bool) -> bool:
    """The same for any plan."""
    err = Console(stderr=True, highlight=False)
    with _following(err, len(lines)) as note:
        held = hold(lines, quick=quick, only=only, progress=note)
    night = held.night
    for file in held.unread:
        err.print(f"{file} is left out: not a night of this version", soft_wrap=True)
    if as_json:
        print(json.dumps(night.to_json() | {"file": str(held.file), "page": str(held.page)}, allow_nan=False))  # noqa: T201
    else:
        _show(Console(highlight=False), night, held.page)
    for line in night.lines:
        if not line.verdict.fine:
            err.print(line.complaint, soft_wrap=True, markup=False)
    return night.passed


@contextmanager
def _following(err: Console, total: int) -> Iterator[Note]:
    """A bar on a terminal; one line now and then in a log file."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as progress:
        task = progress.add_task("", total=total)
        spoke = -math.inf

        def note(done: int, line: Line) -> None:
            nonlocal spoke
            progress.update(task, completed=done, description=f"{line.problem}, {line.engine}, {line.method}")
            if not err.is_terminal and time.monotonic() - spoke > 10:
                spoke = time.monotonic()
                err.print(f"{done} of {total}: {line.problem}, {line.engine}, {line.method}", soft_wrap=True)

        yield note


def _show(out: Console, night: Night, page: Path) -> None:
    """Counts by problem, its largest error in parts of the limit, its longest line; then where the rest lies."""
    out.print(f"validation, {'quick' if night.quick else 'full'}, {night.wall_s:.0f} s", style="bold")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("problem", no_wrap=True)
    for heading in ("passed", "no answer", "not right", "error / limit", "longest"):
        table.add_column(heading, justify="right")
    for problem in dict.fromkeys(line.problem for line in night.lines):
        lines = [line for line in night.lines if line.problem == problem]
        parts = [line.error / line.limit for line in lines if line.error is not None and line.limit]
        passed = sum(line.verdict is Verdict.PASSED for line in lines)
        refused = sum(line.verdict is Verdict.NOT_POSSIBLE for line in lines)
        longest = max((line.seconds or 0.0 for line in lines), default=0.0)
        counts = (str(count) if count else "" for count in (passed, refused, len(lines) - passed - refused))
        table.add_row(problem, *counts, f"{max(parts):.3g}" if parts else "", time_text(longest))
    out.print(table)
    out.print(headline(night))
    for number, change in enumerate(night.changes):
        out.print(f"{'' if number else 'since the night before: '}{change}", soft_wrap=True, markup=False)
    out.print(f"page: {page}", soft_wrap=True)
