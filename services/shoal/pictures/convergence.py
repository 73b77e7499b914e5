"""Fitness against counted evaluations: what each method pays for what it finds."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from shoal.identification import Estimate
from shoal.pictures.style import GREY, METHODS, OTHER, canvas, headline, log_ticks, styled
from shoal.pictures.units import fitness_unit


@styled
def convergence(estimates: Mapping[str, Estimate], title: str) -> Figure:
    """Best fitness so far over the evaluations, both logarithmic; a marker stands where a method ended."""
    figure, axes = canvas(4.6)
    several = len({estimate.method for estimate in estimates.values()}) < len(estimates)
    for name, estimate in estimates.items():
        style = METHODS.get(estimate.method, OTHER)
        line = {key: value for key, value in style.items() if key != "marker"}
        counted, best = estimate.history
        if len(counted):
            axes.plot(counted, best, drawstyle="steps-post", **line)
        axes.plot(
            [estimate.evaluations],
            [estimate.fitness],
            **{**style, "linestyle": "none", "markersize": 8},
            label=f"{name if several else estimate.method} ({estimate.evaluations})",
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    floor = [(e.model_error_rms, e) for e in estimates.values() if e.model_error_rms is not None]
    if floor:
        error, estimate = min(floor, key=lambda pair: pair[0])
        level = estimate.measurement.first.things * error**2
        axes.axhline(level, color=GREY, linewidth=1, linestyle=(0, (1, 2)))
        axes.annotate("error of mesh and steps", (1, level), (0, -4), textcoords="offset points", va="top", color=GREY)
        axes.set_ylim(bottom=min(level / 6, axes.get_ylim()[0]))
    low, high = axes.get_ylim()
    axes.set_ylim(low, max(2 * high, 100 * low))
    log_ticks(axes)
    headline(figure, title)
    axes.set_xlabel("model evaluations, every one counted")
    axes.set_ylabel(f"best fitness so far [{fitness_unit(next(iter(estimates.values())))}]")
    figure.legend(title="method (evaluations)", loc="outside lower left", ncols=3)
    return figure
