"""The installation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.doctor import Check
    from shoal.imported.table import Row


def doctor_table(checks: list[Check]) -> None:
    """Print the checks of the installation, and what to do."""
    table = screen.table("shoal doctor", "check", "", "found", "what to do")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "FAILED", check.found, check.advice)
    table.columns[2].justify = table.columns[3].justify = "left"
    screen.out.print(table)


def import_table(rows: Iterable[Row]) -> None:
    """Print the parts of an import and their counterparts on stderr; omitted parts have lines of their own."""
    table = screen.untitled("element", "became", "remark")
    for row in rows:
        if row.became:
            table.add_row(row.element, row.became, row.remark)
    for column in table.columns:
        column.justify = "left"
    screen.err.print(table)
