"""Lists: of names, of what was looked at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.table import Table

from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.doctor import Check


def listing(title: str, items: Mapping[str, str]) -> None:
    """Names with their descriptions."""
    table = Table(title=title, title_justify="left", title_style="bold", box=None, show_header=False, pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column()
    for name, text in items.items():
        table.add_row(name, text)
    screen.put(table)
    screen.put()


def doctor_table(checks: list[Check]) -> None:
    """What was looked at, and what to do."""
    table = screen.table("shoal doctor", "check", "", "found", "what to do")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "FAILED", check.found, check.advice)
    table.columns[2].justify = table.columns[3].justify = "left"
    screen.put(table)
