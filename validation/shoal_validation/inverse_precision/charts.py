"""Pictures: error against evaluations and time; classes over horizon and noise."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from shoal.trajectory import Array

from shoal_validation.inverse_precision.cases import Case
from shoal_validation.inverse_precision.contenders import OWN_MODEL
from shoal_validation.inverse_precision.horizon_noise import Cell, Panel, worst
from shoal_validation.inverse_precision.measure import CLOSE, Run
from shoal_validation.judge import Outcome

STYLES = {
    "least-squares": ("#000000", "-", "o"),
    "least-squares, random start": ("#000000", ":", "x"),
    "casadi": ("#666666", "--", "D"),
    "afsa": ("#D55E00", ":", "^"),
    "iafsa-printed": ("#D55E00", "--", "s"),
    "iafsa-unseeded": ("#D55E00", "-.", "v"),
    "iafsa": ("#D55E00", "-", ">"),
    "differential evolution": ("#0072B2", "-", "P"),
    "dual annealing": ("#0072B2", "--", "X"),
    "DIRECT": ("#0072B2", ":", "d"),
    "SHGO": ("#0072B2", "-.", "p"),
    "CMA-ES with restarts": ("#009E73", "-", "*"),
}
"""Colour, line and marker: black local, orange the paper's swarms, blue scipy, green pycma."""
_LINE = 95
"""Characters in a line of a title."""
SPARE = (("#CC79A7", line, mark) for line, mark in (("-", "h"), ("--", "H"), (":", "<"), ("-.", "8")))
CLASSES = {
    Outcome.HOLDS: ("#DDEEFF", ""),
    Outcome.INACCURATE: ("#F0E442", "i"),
    Outcome.REFUSED: ("#FFFFFF", "R"),
    Outcome.FAILED: ("#BBBBBB", "F"),
    Outcome.SILENT: ("#D55E00", "W"),
}
"""Colour and letter."""


def draw_case(case: Case, runs: list[Run], file: Path) -> None:
    """Median over the seeds of the error of the best point so far; bars at the end from the best to the worst seed."""
    figure = Figure(figsize=(8.6, 7.4), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, spent, words in zip(axes, ("evaluations", "seconds"), ("counted evaluations", "time [s]"), strict=True):
        for method in dict.fromkeys(run.method for run in runs):
            _draw_method(axis, [run for run in runs if run.method == method and not run.refused], spent)
        axis.axhline(floor(runs), color="0.5", linewidth=1.0)
        axis.text(0.01, floor(runs), "error of the best fit", transform=axis.get_yaxis_transform(),
                  va="bottom", color="0.35", fontsize=10)  # fmt: skip
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel(words, fontsize=12)
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=11)
    axes[0].set_ylabel("largest error of an angle [rad]", fontsize=12)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=11, frameon=False)
    figure.suptitle(f"{fill(headline(runs), _LINE)}\n{fill(case.about, _LINE)}", fontsize=12, x=0.01, ha="left")
    figure.savefig(file, dpi=110)


def floor(runs: list[Run]) -> float:
    """Error at the best fit of our model that any method found [rad]: what the model's own error leaves."""
    ours = (run for run in runs if not run.refused and run.method not in OWN_MODEL)
    return min(ours, key=lambda run: run.fitness).error


def headline(runs: list[Run]) -> str:
    """Methods that reach the truth, by evaluations, and those that do not."""
    won = {name: cheapest for name in _methods(runs) if np.isfinite(cheapest := reach(runs, name, "evaluations"))}
    if not won:
        return f"None of {len(_methods(runs))} methods arrives"
    first = min(won, key=lambda name: won[name])
    return (
        f"{first} needs the fewest evaluations, {won[first]:.0f}, to {CLOSE:g} rad; "
        f"{len(won)} of {len(_methods(runs))} methods arrive"
    )


def reach(runs: list[Run], method: str, spent: str) -> float:
    """Median over the seeds of what was spent when the run came close to the truth to stay; infinite where not."""
    return float(np.median([_arrival(run, spent) for run in runs if run.method == method]))


def _arrival(run: Run, spent: str) -> float:
    away = np.flatnonzero(run.errors > CLOSE)
    after = int(away[-1]) + 1 if away.size else 0
    return float(getattr(run, spent)[after]) if after < len(run.errors) else float("inf")


def _methods(runs: list[Run]) -> list[str]:
    return list(dict.fromkeys(run.method for run in runs if not run.refused))


def _draw_method(axis: Axes, runs: list[Run], spent: str) -> None:
    if not runs:
        return
    method = runs[0].method
    if method not in STYLES:
        STYLES[method] = next(SPARE)
    colour, line, mark = STYLES[method]
    firsts = [getattr(run, spent)[0] for run in runs]
    lasts = [max(getattr(run, spent)[-1], run.spent if spent == "evaluations" else run.wall) for run in runs]
    grid = np.geomspace(max(firsts), max(*lasts, 1.001 * max(firsts)), 200)
    middle = np.median([best_so_far(getattr(run, spent), run.errors, grid) for run in runs], axis=0)
    axis.plot(grid, middle, color=colour, linestyle=line, linewidth=1.8)
    ends = np.array([run.error for run in runs])
    bars = np.abs(np.array([[ends.min()], [ends.max()]]) - middle[-1])
    axis.errorbar(grid[-1:], middle[-1:], yerr=bars, color=colour, linestyle=line, marker=mark, markersize=9,
                  capsize=4, label=method)  # fmt: skip


def best_so_far(spent: Array, errors: Array, grid: Array) -> Array:
    """Error of the best point when so much was spent, a step function, (grid,)."""
    index = np.searchsorted(spent, grid, side="right") - 1
    found: Array = errors[np.maximum(index, 0)]
    return found


def draw_map(panels: list[Panel], cells: list[Cell], file: Path) -> None:
    """A panel per method, a cell per horizon and noise, coloured and lettered by its worst class."""
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(8.6, 2.9 * rows + 1.2), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, panel in zip(grid, panels, strict=False):
        _draw_panel(axis, panel, [cell for cell in cells if cell.panel == panel])
    for axis in grid[len(panels) :]:
        axis.set_axis_off()
    silent = sum(worst_of.outcome == Outcome.SILENT for worst_of in worst_cells(cells))
    figure.suptitle(f"Rigid double pendulum, both angles from the tip: {silent} silently wrong cells", fontsize=12)
    words = ", ".join(f"{letter or 'blank'}: {outcome}" for outcome, (_, letter) in CLASSES.items())
    figure.supxlabel(fill(f"{words}; the number is the error [rad]", _LINE), fontsize=11)
    figure.savefig(file, dpi=110)


def worst_cells(cells: list[Cell]) -> list[Cell]:
    """The worst draw of each cell."""
    groups: dict[tuple[object, ...], list[Cell]] = {}
    for cell in cells:
        groups.setdefault((cell.panel, cell.horizon, cell.noise), []).append(cell)
    return [worst(group) for group in groups.values()]


def _draw_panel(axis: Axes, panel: Panel, cells: list[Cell]) -> None:
    horizons = sorted({cell.horizon for cell in cells})
    noises = sorted({cell.noise for cell in cells})
    order = list(CLASSES)
    codes = np.zeros((len(noises), len(horizons)))
    for cell in worst_cells(cells):
        row, column = noises.index(cell.noise), horizons.index(cell.horizon)
        outcome = Outcome(cell.outcome)
        codes[row, column] = order.index(outcome)
        error = f"{cell.error:.0e}" if np.isfinite(cell.error) else ""
        axis.text(column, row, f"{CLASSES[outcome][1]}\n{error}".strip(), ha="center", va="center", fontsize=10)
    colours = ListedColormap([colour for colour, _ in CLASSES.values()])
    axis.imshow(codes, cmap=colours, vmin=-0.5, vmax=len(order) - 0.5, aspect="auto", origin="lower")
    axis.set_xticks(range(len(horizons)), [f"{horizon:g}" for horizon in horizons], fontsize=11)
    axis.set_yticks(range(len(noises)), [f"{noise:.0e}" for noise in noises], fontsize=11)
    axis.set_xlabel("horizon [s]", fontsize=12)
    axis.set_ylabel("noise [m]", fontsize=12)
    axis.set_title(panel.title.replace(", noise", "\nnoise"), fontsize=11)
