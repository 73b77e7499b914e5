"""Cost and error of the chosen model among the models that were tried."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.numbers import length
from shoal.pictures.style import BLACK, BLUE, VERMILION, canvas, headline, log_ticks, styled

if TYPE_CHECKING:
    from shoal.selection import Selection
    from shoal.selection.run import Candidate


@styled
def ladder(found: Selection) -> Figure:
    """Estimated error at the markers over the cost of a run, both logarithmic; below the dashed line is good enough."""
    figure, axes = canvas(4.4)
    others = [
        candidate
        for candidate in found.candidates
        if candidate is not found.chosen and np.isfinite(candidate.error) and candidate.error > 0
    ]
    look = {"linestyle": "none", "markeredgecolor": "black"}
    axes.plot(
        [_cost(candidate) for candidate in others],
        [candidate.error for candidate in others],
        marker="o",
        color=BLUE,
        markersize=7,
        label=f"other models with a known error ({len(others)} of {len(found.candidates) - 1})",
        **look,
    )
    chosen = found.chosen
    axes.plot([_cost(chosen)], [chosen.error], marker="*", color=VERMILION, markersize=16, **look)
    axes.plot([], [], marker="*", color=VERMILION, markersize=13, label=f"chosen: {chosen.name}", **look)
    axes.axhline(
        found.tolerance, color=BLACK, linestyle="--", linewidth=1, label=f"tolerance {length(found.tolerance)}"
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(0.15)
    log_ticks(axes)
    axes.set_xlabel("cost of one run (steps times unknowns)")
    axes.set_ylabel("estimated error [m]")
    headline(figure, _says(found))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=1)
    return figure


def _cost(candidate: Candidate) -> float:
    """Steps times unknowns: unlike a time it is the same on every machine, under any load."""
    return float(candidate.trajectory.steps * candidate.trajectory.model["unknowns"])


def _says(found: Selection) -> str:
    error = length(found.errors.total)
    if found.met:
        return f"{found.chosen.scene.name}: the cheapest model within {length(found.tolerance)} is off by about {error}"
    return f"{found.chosen.scene.name}: no model within {length(found.tolerance)}; the best is off by about {error}"
