"""One scene on several engines: the motions over each other, and what lies between them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.figure import Figure

from shoal.engines.compare import Comparison
from shoal.pictures.style import BLACK, ENGINES, GREY, ORANGE, OTHER, VERMILION, canvas, headline, log_ticks, styled
from shoal.trajectory import Array

_WIDTHS = (5.0, 3.0, 1.8)
_PAIRS = (BLACK, VERMILION, GREY)
_LINES = ("-", "--", ":", "-.")


@styled
def engines(comparison: Comparison, marker: str, title: str) -> Figure:
    """Above, x, y and in space z of a marker by every engine; below, the distance of each pair, logarithmic.

    Of one engine there is nothing below.
    """
    pairs = list(combinations(comparison.trajectories.items(), 2))
    rows = 2 if pairs else 1
    figure, panels = canvas(3.1 * rows, nrows=rows, sharex=True, squeeze=False, height_ratios=[1.2, 1][:rows])
    above, last = panels[0, 0], panels[-1, 0]
    for k, (name, motion) in enumerate(comparison.trajectories.items()):
        style = {**ENGINES.get(name, OTHER), "linewidth": _WIDTHS[min(k, 2)]}
        path = motion.marker(marker)
        for j, coordinate in enumerate(path.T):
            above.plot(motion.times, coordinate, label=None if j else name, **style)
    times, path = next((m.times, m.marker(marker)) for m in comparison.trajectories.values())
    for axis, value in _names(path[-1], float(np.ptp(above.get_ylim()))):
        above.annotate(axis, (times[-1], value), (6, 0), textcoords="offset points", va="center")
    for k, ((one, a), (other, b)) in enumerate(pairs):
        distance = np.linalg.norm(a.marker(marker) - b.marker(marker), axis=1)
        style = {"color": _PAIRS[k % 3], "linestyle": _LINES[k % 4]}
        last.plot(a.times, 1e6 * distance, label=f"{one}, {other}", **style)
    if pairs and comparison.errors.total:
        last.axhline(1e6 * comparison.errors.total, color=ORANGE, linestyle="--", label="known error of the model")
    headline(figure, title)
    above.set_ylabel(f"position of {marker} [m]")
    above.legend()
    last.set_xlabel("time [s]")
    if pairs:
        last.set_yscale("log")
        log_ticks(last)
        last.set_ylabel("distance [µm]")
        last.legend(loc="lower right")
    return figure


def _names(ends: Array, height: float) -> list[tuple[str, float]]:
    """Names of coordinates where their curves end; of those closer than a line of text, in one: "x, z"."""
    found: list[tuple[str, float]] = []
    for k in np.argsort(-ends, kind="stable"):
        if found and found[-1][1] - ends[k] < 0.08 * height:
            found[-1] = f"{found[-1][0]}, {'xyz'[k]}", found[-1][1]
        else:
            found.append(("xyz"[k], float(ends[k])))
    return found
