"""Two pictures: every combination of the parts, and what each part alone changes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from shoal.trajectory import Array

from shoal_validation.ablation.factorial import combinations, effects, label

MARKS = {"iafsa": ("o", "#0072B2", "repaired"), "iafsa-printed": ("s", "#D55E00", "as printed")}
"""Marker, colour and words of each swarm."""

FARTHEST = -2.0
"""Effects of more decades are written at the edge, so that the others can be told apart."""


@dataclass(frozen=True)
class Panel:
    """Column of a chart: values by swarm, (2, 2, 2, 2, seeds), and the words around them."""

    values: dict[str, Array]
    title: str
    axis: str
    change: str
    limit: float | None = None
    limit_words: str = ""


def draw(panels: list[Panel], title: str, file: Path) -> None:
    """Combinations above, main effects below."""
    figure = Figure(figsize=(4.3 * len(panels), 9.4), layout="constrained")
    rows = figure.subplots(2, len(panels), squeeze=False, gridspec_kw={"height_ratios": [2.4, 1.0]})
    for number, (panel, above, below) in enumerate(zip(panels, rows[0], rows[1], strict=True)):
        _combinations(above, panel)
        _effects(below, panel)
        if number:  # the rows are those of the first column
            above.set_ylabel("")
            above.tick_params(labelleft=False)
            below.tick_params(labelleft=False)
    handles, labels = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=12, frameon=False)
    figure.suptitle(fill(title, 80), fontsize=12.5, x=0.01, ha="left")
    figure.savefig(file, dpi=110)


def _combinations(axes: Axes, panel: Panel) -> None:
    for shift, (swarm, values) in zip((-0.16, 0.16), panel.values.items(), strict=False):
        marker, colour, words = MARKS[swarm]
        table = values.reshape(16, -1)
        middle = np.median(table, axis=1)
        spread = np.abs(np.stack([table.min(axis=1), table.max(axis=1)]) - middle)
        places = np.arange(16) + shift
        axes.errorbar(middle, places, xerr=spread, fmt=marker, color=colour, capsize=2, markersize=7, label=words)
    if panel.limit is not None:
        axes.axvline(panel.limit, color="0.4", linestyle="--", label=panel.limit_words)
    axes.set_xscale("log")
    axes.set_yticks(range(16), [label(combination) for combination in combinations()], family="monospace", fontsize=12)
    axes.invert_yaxis()
    axes.set_ylabel("parts that are on", fontsize=12)
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel(panel.axis, fontsize=12)
    axes.set_title(panel.title, fontsize=11)


def _effects(axes: Axes, panel: Panel) -> None:
    for shift, (swarm, values) in zip((-0.16, 0.16), panel.values.items(), strict=False):
        marker, colour, _ = MARKS[swarm]
        found = effects(np.log10(values))
        middle = np.array([effect.mean for effect in found])
        spread = np.array([[e.mean - e.lower, e.upper - e.mean] for e in found]).T
        axes.errorbar(middle, np.arange(4) + shift, xerr=spread, fmt=marker, color=colour, capsize=4, markersize=8)
        if middle[0] < FARTHEST:
            words = f"◄ {middle[0]:.1f}"
            axes.annotate(words, (FARTHEST, shift), color=colour, fontsize=12, va="center")
            axes.set_xlim(left=FARTHEST)
    axes.axvline(0.0, color="black", linewidth=1.0)
    names = ["T traditional seed", "P previous seed *", "V velocity *", "M mutation *"]
    axes.set_yticks(range(4), names, fontsize=12)
    axes.set_ylim(3.6, -0.6)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel(f"{panel.change}\n(left: the part helps; * without T)", fontsize=11)
