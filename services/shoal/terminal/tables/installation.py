"""The installation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.doctor import Check


def doctor_table(checks: list[Check]) -> None:
    """Print the checks of the installation, and what to do."""
    table = screen.table("shoal doctor", "check", "", "found", "what to do")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "FAILED", check.found, check.advice)
    table.columns[2].justify = table.columns[3].justify = "left"
    screen.out.print(table)
