"""The map of horizons as a picture, and its findings in words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from shoal_validation.document import table
from shoal_validation.uncertain.maps import GOOD, INSTANTS, MOST, Cell, Question

SILENT = "#a50f15"
DARK = 30.0
"""Cycles from which a cell is so dark that its number is white."""


def draw(cells: Sequence[Cell], path: Path) -> None:
    """A panel for each rate of chaos, a row for each method; as PNG."""
    methods = list(dict.fromkeys(one.method for one in cells))
    rates = list(dict.fromkeys(one.question.rate for one in cells))
    found = {(one.method, one.question): one for one in cells}
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(9.6, 1.9 + 0.27 * len(methods)), dpi=110, layout="constrained")
        axes = figure.subplots(1, len(rates), sharey=True, squeeze=False)[0]
        for place, rate in zip(axes, rates, strict=True):
            columns = list(dict.fromkeys(one.question for one in cells if one.question.rate == rate))
            _panel(place, methods, columns, found)
            place.set_title("no chaos" if rate == 0 else f"neighbours part\nby exp({rate:g} per cycle)", fontsize=9)
        axes[0].set_yticks(np.arange(len(methods)), methods)
        figure.suptitle(
            f"How many cycles ahead are bounds right to {GOOD:.0%} of their width, with {MOST} runs at most?\n"
            f"{INSTANTS[-1]:g} is as far as is looked. Columns: parameters, and the width of each interval.",
            fontsize=11, x=0.01, ha="left",
        )  # fmt: skip
        figure.legend(
            handles=[
                Patch(facecolor="white", edgecolor=SILENT, linewidth=2, label="outer bounds wrong, and nothing tells"),
                Patch(facecolor="white", edgecolor="none", label="in brackets: no outer bounds are told"),
            ],
            loc="outside lower left",
            ncols=2,
            frameon=False,
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _panel(place: Axes, methods: list[str], columns: list[Question], found: dict[tuple[str, Question], Cell]) -> None:
    ends = np.array([[found[method, one].horizon for one in columns] for method in methods])
    low, high = INSTANTS[0] / 2, INSTANTS[-1]
    place.imshow(np.log(np.maximum(ends, low)), cmap="Blues", vmin=np.log(low), vmax=np.log(4 * high), aspect="auto")
    for row, method in enumerate(methods):
        for column, one in enumerate(columns):
            cell = found[method, one]
            colour = "white" if cell.horizon > DARK else "black"
            number = f"{cell.horizon:.2g}" if cell.horizon < 100 else f"{cell.horizon:.0f}"
            text = "-" if not cell.horizon else number if cell.told else f"({number})"
            place.text(column, row, text, ha="center", va="center", color=colour, fontsize=7)
            if cell.silent:
                place.add_patch(Rectangle((column - 0.46, row - 0.44), 0.92, 0.88, fill=False, ec=SILENT, lw=1.5))
    place.set_xticks(np.arange(len(columns)), [f"{one.parameters}: {one.width:.0%}" for one in columns], rotation=60)
    place.tick_params(length=0)


def findings(cells: Sequence[Cell]) -> str:
    """A row for each method: the cells where it is right to the end, refuses or is undecided, or silently wrong,
    and the median horizon.
    """
    rows = []
    for method in dict.fromkeys(one.method for one in cells):
        mine = [one for one in cells if one.method == method]
        whole = sum(one.horizon >= one.question.times[-1] for one in mine)
        untold = sum(not one.told and one.runs > 0 for one in mine)
        refused = sum(one.runs == 0 for one in mine)
        middle = float(np.median([one.horizon for one in mine]))
        rows.append(
            [method, *map(str, (len(mine), whole, untold, refused, sum(one.silent for one in mine))), f"{middle:.2g}"]
        )
    head = ["method", "cells", "right to the end", "no outer bounds", "refused", "wrong in silence",
            "median horizon [cycles]"]  # fmt: skip
    return table(head, rows)
