"""Flow: the night. Every problem on every engine, against its reference and the nights before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from prefect import flow, get_run_logger
from shoal_validation.nightly.hold import hold
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.page import headline
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.result import Night
from shoal_validation.nightly.run import compiled

from shoal_flows import events
from shoal_flows.flows.parameters import ALL, Only
from shoal_flows.flows.shown import Bar, ended, progress, show_result
from shoal_flows.flows.tables import table
from shoal_flows.tracking.night import log_night


@dataclass(frozen=True)
class Validated:
    """A night with the id of its run."""

    night: Night
    run_id: str

    @property
    def trusted(self) -> bool:
        """Return whether every line is as it should be."""
        return self.night.passed

    def doubts(self) -> list[str]:
        """Every reason not to trust the night."""
        return [line.complaint for line in self.night.lines if not line.verdict.fine]

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal run nightly --json` prints."""
        return {**self.night.to_json(), "run_id": self.run_id}


@flow(name="nightly", flow_run_name="nightly validation", retries=1, retry_delay_seconds=60, timeout_seconds=3600)
def nightly(only: Only = ALL, quick: bool = False) -> Validated:
    """Run what `shoal validate` runs, keep it beside the nights before, and log its lines.

    Args:
        only: One problem or one scene of the library, or all.
        quick: A part that takes one or two minutes.
    """
    problem = None if only == ALL else only
    lines = plan(problem, quick)
    with progress(len(lines), "lines of the night") as bar:
        if problem is None:
            with events.work("kernels (compiled on first use)"):
                compiled(_said)
        held = hold(lines, quick=quick, only=problem, progress=_note(bar))
    night = held.night
    result = Validated(night, log_night(night, held.text))
    show_result(headline(night), f"{_changes(night)}{_table(night)}", result)
    return ended(result)


def _said(line: str) -> None:
    """Pass on a line of the compilation, to a terminal and to the log of the run."""
    events.note(line)
    get_run_logger().info(line)


def _note(bar: Bar) -> Any:
    def note(done: int, line: Line) -> None:
        bar.stand_at(done)

    return note


def _changes(night: Night) -> str:
    listed = "".join(f"- {change}\n" for change in night.changes)
    return f"Since the night before:\n\n{listed}\n" if listed else ""


def _table(night: Night) -> str:
    """Return the table of a night, failures first."""
    lines = sorted(night.lines, key=lambda line: line.verdict.fine)
    rows = ((line.verdict, line.problem, line.engine, line.method, line.expected, line.found) for line in lines)
    return table(("verdict", "problem", "engine", "method", "expected", "found"), rows)
