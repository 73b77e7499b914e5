"""A night from its plan to its files: beside the nights before it, with the page that shows them all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from shoal_validation.nightly import history
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.page import render
from shoal_validation.nightly.result import Night
from shoal_validation.nightly.run import Progress, machine, run


@dataclass(frozen=True)
class Held:
    """A night that is over. file, page: where they lie; text: of the page; unread: files that are no nights."""

    night: Night
    file: Path
    page: Path
    text: str
    unread: list[Path]


def hold(
    lines: Sequence[Line],
    *,
    quick: bool = False,
    only: str | None = None,
    progress: Progress = lambda *_: None,
    now: datetime | None = None,
) -> Held:
    """Measure all lines and keep what was found. now: what the clock shows, if not that of this machine.

    Raises InputError.
    """
    where = history.folder()
    before, unread = history.load(where, machine())
    night = run(lines, before, quick=quick, only=only, progress=progress, now=now)
    file, page, text = history.save(night, where), where / "index.html", render(night, before)
    history.write_whole(page, text)
    return Held(night, file, page, text, unread)
