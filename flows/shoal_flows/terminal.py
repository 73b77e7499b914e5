"""Terminal output of a flow: progress on standard error, one table on the output."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from shoal.terminal.screen import FittingTable

from shoal_flows import remembered
from shoal_flows.events import Listener
from shoal_flows.tracking import outbox
from shoal_flows.tracking.record import LOCAL

UI = "http://127.0.0.1:5000"
"""Where `shoal ui` serves the runs if it is not told otherwise."""

if TYPE_CHECKING:
    from shoal_flows.jobs import Fit
    from shoal_flows.results import Compared, DemoResult, Study


@contextmanager
def following(what: str) -> Iterator[Listener]:
    """A line that names what runs, on a terminal; in a log file a line for everything that ended."""
    console = Console(stderr=True, highlight=False)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    if not console.is_terminal:
        console.print(f"{what}: starting", soft_wrap=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task(f"{what}: starting")
        running: list[str] = []
        ended = 0
        lock = Lock()

        def note(name: str, state: str) -> None:
            nonlocal ended
            with lock:
                if state == "note":
                    console.print(name, soft_wrap=True, markup=False)
                elif state == "started":
                    running.append(name)
                else:
                    running.remove(name)
                    ended += 1
                    if state == "failed" or not console.is_terminal:
                        console.print(f"{state}: {name}", soft_wrap=True)
                now = "; ".join(running)
                progress.update(bar, description=f"{what}: {ended} done" + (f", now {now}" if now else ""))

        yield note


def show(result: Any) -> None:
    """The table of a result."""
    from shoal.terminal import tables

    from shoal_flows.results import (
        AtRest,
        Compared,
        DemoResult,
        Designed,
        Exported,
        Responded,
        Selected,
        Simulated,
        Study,
        Swept,
    )

    console = Console(highlight=False)
    if isinstance(result, Study):
        _study(console, result)
    elif isinstance(result, Compared):
        _differences(console, [result])
    elif isinstance(result, DemoResult):
        demo_tables(console, result)
    elif isinstance(result, Simulated):
        tables.trajectory_table(result.answer, result.scene)
    elif isinstance(result, AtRest):
        tables.equilibrium_table(result.answer)
    elif isinstance(result, Selected):
        tables.selection_table(result.answer)
    elif isinstance(result, Designed):
        tables.design_table(result.answer)
    elif isinstance(result, Responded):
        tables.response_table(result.answer)
    elif isinstance(result, Exported):
        for name in result.answer.files:
            console.print(f"export/{name}", soft_wrap=True)
        for tool, distance in result.answer.distances.items():
            console.print(f"{tool}: its motion is within {distance:.2g} m of `shoal simulate`", soft_wrap=True)
    elif isinstance(result, Swept):
        console.print(f"{len(result.answer.status)} points in {result.answer.wall_s:.2f} s")
        if result.answer.check is not None:
            console.print(str(result.answer.check), soft_wrap=True)
    else:
        from shoal_validation.nightly.page import headline

        from shoal_flows.flows.nightly import Validated

        if isinstance(result, Validated):
            console.print(headline(result.night), soft_wrap=True)
    if not isinstance(result, DemoResult) and not result.run_id.startswith(LOCAL):
        from shoal_flows.tracking.addresses import run_address

        address = run_address(result.run_id, UI)
        where = f": {address}" if address else ""
        console.print(f"MLflow run {result.run_id}; browse it with `shoal ui`{where}", soft_wrap=True)


def notice() -> None:
    """Print on standard error which results were reused, and which runs MLflow still lacks."""
    console = Console(stderr=True, highlight=False)
    if count := remembered.reused():
        console.print(f"{count} results were computed before; SHOAL_FRESH=1 computes them anew", soft_wrap=True)
    if waiting := len(outbox.pending()):
        text = f"{waiting} runs that MLflow could not be told of are in {outbox.folder()}; `shoal upload` sends them"
        console.print(text, soft_wrap=True)


def demo_tables(console: Console, result: DemoResult) -> None:
    """The identifications, then the engines."""
    table = _table("Angles [rad] identified from the tip's motion, data from Exudyn on 16/32 elements")
    for column in ("case", "method", "theta1", "theta2", "error°", "fitness", "runs", "s"):
        table.add_column(column, justify="left" if column in ("case", "method") else "right", no_wrap=True)
    for case, study in result.studies.items():
        for fit in study.fits:
            e = fit.estimate
            first, second = (value.value for value in e.parameters.values())
            error = _worst_error(fit)
            numbers = f"{first:.5f}", f"{second:.5f}", f"{error:.3f}", f"{e.fitness:.1e}", str(e.evaluations)
            table.add_row(case.removeprefix("paper-case-"), fit.cell.method, *numbers, f"{e.wall_s:.1f}")
    console.print(table)
    for case, study in result.studies.items():
        for fit in study.fits:
            e = fit.estimate
            if not e.verdict.trusted:
                console.print(f"{case}, {fit.cell.method}: {e.verdict}: {e.message}", soft_wrap=True)
    console.print(_paper_table(result))
    _differences(console, list(result.comparisons.values()))
    for doubt in result.doubts():
        console.print(f"doubt: {doubt}", soft_wrap=True)


def _paper_table(result: DemoResult) -> Table:
    """The paper's swarms on data of the fitted mesh, as the paper's must have been, and on data of a finer model."""
    from shoal_flows.report.paper import AS, NAMES, TABLES

    table = _table("Fitness in m² of the paper's swarms, by what the data were computed with")
    for column in ("case", "swarm", "paper", "same mesh", "error°", "finer", "error°"):
        table.add_column(column, justify="left" if column in ("case", "swarm") else "right", no_wrap=True)
    for case, same in result.same_mesh.items():
        fits = same.by_method(), result.studies[case].by_method()
        for row, printed in TABLES[case][1].items():
            for method, kind in AS[row].items():
                cells = [f"{NAMES[row]} {kind}", f"{printed.value:.1e}"]
                for fit in (found.get(method) for found in fits):
                    cells += ["failed", ""] if fit is None else [f"{fit.estimate.fitness:.1e}", _error(fit)]
                table.add_row(case.removeprefix("paper-case-"), *cells)
    return table


def _error(fit: Fit) -> str:
    return f"{_worst_error(fit):.3f}"


def _worst_error(fit: Any) -> float:
    errors = [fit.estimate.parameters[name].value - true for name, true in fit.estimate.truth.items()]
    return math.degrees(max(map(abs, errors), default=math.nan))


def _study(console: Console, study: Study) -> None:
    table = _table(study.name)
    for column in ("method", "values", "fitness", "runs", "s", "verdict"):
        table.add_column(column, overflow="fold")
    for fit in study.fits:
        e = fit.estimate
        values = ", ".join(f"{name} {value.value:.6g}" for name, value in e.parameters.items())
        numbers = f"{e.fitness:.2e}", str(e.evaluations), f"{e.wall_s:.1f}"
        table.add_row(fit.cell.name, values, *numbers, str(e.verdict))
    for name, reason in study.failures.items():
        table.add_row(name, reason, "", "", "", "failed")
    console.print(table)


def _differences(console: Console, results: list[Compared]) -> None:
    for compared in results:
        comparison = compared.answer
        largest: dict[str, tuple[float, str]] = {}
        for row in comparison.differences():
            pair, distance = "-".join(row["engines"]), row["largest"]
            far = math.inf if distance is None else distance
            largest[pair] = max(largest.get(pair, (-1.0, "")), (far, row["marker"]))
        parts = [
            f"{pair} {far * 1e6:.1f} µm at {marker}" if far < math.inf else f"{pair} ? at {marker}"
            for pair, (far, marker) in largest.items()
        ]
        if parts:
            console.print(f"{comparison.scene.name}, largest distance:", soft_wrap=True)
            console.print(f"  {', '.join(parts)}", soft_wrap=True)
        elif not comparison.refused:
            console.print(f"{comparison.scene.name}: {comparison.complaint}", soft_wrap=True)
        for engine, reason in comparison.refused.items():
            console.print(f"  {engine} refused: {reason}", soft_wrap=True)


def _table(title: str) -> Table:
    return FittingTable(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
