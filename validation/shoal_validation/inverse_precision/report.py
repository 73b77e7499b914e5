"""Markdown tables of the identification charts."""

from __future__ import annotations

from collections import Counter

import numpy as np

from shoal_validation.document import table
from shoal_validation.inverse_precision.charts import floor, reach, worst_cells
from shoal_validation.inverse_precision.horizon_noise import Cell, Panel
from shoal_validation.inverse_precision.measure import CLOSE, Run
from shoal_validation.judge import Outcome


def precision_table(runs: dict[str, list[Run]]) -> str:
    """One table per case: evaluations and time until the error stays below CLOSE, success, error at the end."""
    return "\n\n".join(_case_table(name, found) for name, found in runs.items())


def _case_table(name: str, runs: list[Run]) -> str:
    head = (f"`{name}`", f"evaluations to {CLOSE:g} rad", "time [ms]", "success", "error at the end [rad]", "spent")
    rows = []
    for method in dict.fromkeys(run.method for run in runs):
        mine = [run for run in runs if run.method == method]
        if mine[0].refused:
            rows.append((method, f"refused: {mine[0].refused}", "", "", "", ""))
            continue
        ends = [run.error for run in mine]
        error = f"{np.median(ends):.1e}"
        if len(mine) > 1:
            error += f" ({min(ends):.1e} to {max(ends):.1e})"
        spent = f"{np.median([run.spent for run in mine]):.0f}, {np.median([run.wall for run in mine]):.2f} s"
        counted, waited = reach(runs, method, "evaluations"), 1e3 * reach(runs, method, "seconds")
        success = f"{sum(run.success for run in mine)} of {len(mine)}"
        rows.append((method, _number(counted), _number(waited), success, error, spent))
    return table(head, rows) + f"\n\nThe best fit of our model has an error of {floor(runs):.1e} rad."


def map_table(panels: list[Panel], cells: list[Cell]) -> str:
    """Counts of the classes, silently wrong first, then each silently wrong cell."""
    order = (Outcome.SILENT, Outcome.FAILED, Outcome.REFUSED, Outcome.INACCURATE, Outcome.HOLDS)
    rows = []
    found = worst_cells(cells)
    for panel in panels:
        count = Counter(c.outcome for c in found if c.panel == panel)
        rows.append((panel.title, *(str(count[outcome]) for outcome in order)))
    text = table(("method", *map(str, order)), rows)
    silent = [cell for cell in found if cell.outcome == Outcome.SILENT]
    if not silent:
        return text + "\n\nNo cell is silently wrong."
    head = ("silently wrong", "horizon [s]", "noise [m]", "draw", "error [rad]", "in reported deviations")
    lines = [
        (
            c.panel.title,
            f"{c.horizon:g}",
            f"{c.noise:.0e}",
            str(c.seed),
            f"{c.error:.2g}",
            f"{c.deviations:.0f}",
        )
        for c in silent
    ]
    return f"{text}\n\n{table(head, lines)}"


def _number(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "not reached"
