"""One picture per map: a panel per method, cells coloured and lettered by what became of the run."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from shoal_validation.judge import Outcome
from shoal_validation.stability.contract import Axis, Cell
from shoal_validation.stability.survey import Result

LOOK = {
    Outcome.HOLDS: ("H", "#c6dbef", ""),
    Outcome.INACCURATE: ("i", "#f7e08a", ""),
    Outcome.REFUSED: ("R", "#ffffff", ""),
    Outcome.FAILED: ("F", "#d9d9d9", ""),
    Outcome.DIVERGED: ("X", "#b3b3b3", ""),
    Outcome.DRIFTED: ("D", "#b9a3cf", ""),
    Outcome.ENERGY: ("E", "#8fcdb4", ""),
    Outcome.OUT_OF_REACH: ("O", "#cfa878", ""),
    Outcome.SILENT: ("S", "#a50f15", "xx"),
}
"""Letter, colour and hatch of each class."""
WORDS = {
    Outcome.REFUSED: "refused before it ran",
    Outcome.FAILED: "failed: the solver gave up",
    Outcome.DIVERGED: "diverged: no numbers left",
    Outcome.DRIFTED: "drifted: joints opened",
}
BRANCH = "b: went on along the wrong branch"
COLUMNS = 3


def draw(result: Result, path: Path) -> None:
    """Write the picture of one map as PNG."""
    panels = result.panels
    columns = min(COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    height = 0.85 + 0.27 * len(result.y.values)
    with mpl.rc_context({"font.size": 11, "hatch.linewidth": 0.5, "hatch.color": "#ff9c9c"}):
        figure = Figure(figsize=(8.6, rows * height + 2.8), dpi=110, layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False)
        for place, panel in zip(axes.flat, panels, strict=False):
            _panel(place, panel.cells, result.x, result.y)
            place.set_title(textwrap.fill(panel.method, 26), fontsize=10, fontweight="bold" if panel.ours else "normal")
        for place in axes.flat[len(panels) :]:
            place.set_axis_off()
        _label(axes, len(panels), result)
        said = (textwrap.fill(text, 90) for text in (f"{result.summary.capitalize()}.", result.question))
        figure.suptitle("\n".join(said), fontsize=12, x=0.01, ha="left")
        figure.legend(handles=_legend(result), loc="outside lower center", ncols=2, frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _panel(place: Any, cells: tuple[Cell, ...], x: Axis, y: Axis) -> None:
    kinds = list(LOOK)
    shape = (len(y.values), len(x.values))
    numbers = np.array([kinds.index(cell.outcome) for cell in cells]).reshape(shape)
    colours = ListedColormap([colour for _, colour, _ in LOOK.values()])
    place.pcolormesh(numbers, cmap=colours, vmin=-0.5, vmax=len(kinds) - 0.5, edgecolors="#888888", linewidth=0.5)
    for number, cell in enumerate(cells):
        row, column = divmod(number, shape[1])
        letter, colour, hatch = LOOK[cell.outcome]
        if hatch:
            place.fill([column, column + 1, column + 1, column], [row, row, row + 1, row + 1], colour, hatch=hatch)
        text = letter + ("b" if cell.branch else "")
        dark = cell.outcome is Outcome.SILENT
        style = {"color": "white" if dark else "black", "fontweight": "bold" if dark else "normal"}
        place.text(column + 0.5, row + 0.48, text, ha="center", va="center", fontsize=10, **style)


def _label(axes: Any, count: int, result: Result) -> None:
    """Values on the outer panels only."""
    rows, columns = axes.shape
    for number, place in enumerate(axes.flat[:count]):
        row, column = divmod(number, columns)
        lowest = row == rows - 1 or number + columns >= count
        place.set_xticks(np.arange(len(result.x.values)) + 0.5, result.x.labels if lowest else [])
        place.set_yticks(np.arange(len(result.y.values)) + 0.5, result.y.labels if column == 0 else [])
        place.tick_params(length=0, labelsize=9)
        if lowest:
            place.tick_params(axis="x", rotation=45)
            place.set_xlabel(textwrap.fill(result.x.title, 28), fontsize=10)
        if column == 0:
            place.set_ylabel(textwrap.fill(result.y.title, 20), fontsize=10)


def _legend(result: Result) -> list[Patch]:
    present = {cell.outcome for panel in result.panels for cell in panel.cells}
    handles = [
        Patch(facecolor=colour, edgecolor="#888888", hatch=hatch, label=f"{letter}: {WORDS.get(kind, kind)}")
        for kind, (letter, colour, hatch) in LOOK.items()
        if kind in present
    ]
    if any(cell.branch for panel in result.panels for cell in panel.cells):
        handles.append(Patch(facecolor="none", label=BRANCH))
    return handles
