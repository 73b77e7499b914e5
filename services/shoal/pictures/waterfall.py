"""Local minima found, and how much worse they fit than the best."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.style import BLUE, GREY, VERMILION, canvas, headline, log_ticks, styled
from shoal.pictures.units import fitness_unit


@styled
def waterfall(estimate: Estimate) -> Figure:
    """Fitness of the distinct places where local searches ended, best first, on a logarithmic axis."""
    values = sorted([estimate.fitness, *(other["fitness"] for other in estimate.minima)])
    places = np.arange(1, len(values) + 1)
    figure, axes = canvas(3.6)
    axes.plot(places, values, "-", color=GREY, linewidth=1)
    axes.plot(places[1:], values[1:], "o", color=BLUE, markersize=6, label="where other searches ended")
    axes.plot(places[:1], values[:1], "*", color=VERMILION, markersize=14, label="the answer")
    axes.set_yscale("log")
    axes.margins(y=0.15)
    log_ticks(axes)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlim(0.5, max(len(values), 2) + 0.5)
    headline(figure, _says(estimate.problem, values))
    axes.set_xlabel("place where a search ended, best first")
    axes.set_ylabel(f"fitness [{fitness_unit(estimate)}]")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return figure


def _says(name: str, values: list[float]) -> str:
    if len(values) < 2:
        return f"{name}: every search ended in one place"
    ratio = values[1] / max(values[0], 1e-300)
    factor = f"{100 * (ratio - 1):.2g} %" if ratio < 2 else f"{float(f'{ratio:.2g}'):,.0f} times"
    return f"{name}: {len(values)} ends of searches; the second fits {factor} worse"
