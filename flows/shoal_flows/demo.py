"""`shoal demo`: run the demo flow with its progress, print one table, write the report."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, cast

from shoal_flows import events, run
from shoal_flows.events import Listener

if TYPE_CHECKING:
    from shoal_flows.results import DemoResult


def demo(progress: Listener) -> DemoResult:
    """Both cases by every method, on four meshes, on three engines. Raises InputError, ComputationError."""
    with events.listening(progress):
        return cast("DemoResult", run.run_flow("demo", {}))


def main() -> bool:
    """Run it and print its tables; returns whether the answers can be trusted and the engines agree."""
    from rich.console import Console

    from shoal_flows.terminal import demo_tables, following, notice

    begin = time.perf_counter()
    with following("demo") as listener:
        result = demo(listener)
        from shoal_flows.report.write import write_report

        report = write_report(result)
    console = Console(highlight=False)
    demo_tables(console, result)
    notice()
    console.print(f"\ndone in {time.perf_counter() - begin:.0f} s")
    console.print(f"report: {_short(report)}", soft_wrap=True)
    console.print("runs:   shoal ui", soft_wrap=True)
    return result.trusted


def _short(path: Path) -> str:
    inside = path.is_relative_to(Path.cwd())
    return os.path.relpath(path) if inside else str(path)
