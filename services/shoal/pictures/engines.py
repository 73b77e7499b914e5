"""One scene on several engines: the motions over each other, and what lies between them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.figure import Figure

from shoal.engines.compare import Comparison
from shoal.pictures.style import BLACK, ENGINES, GREY, OTHER, VERMILION, canvas, headline, log_ticks, styled

_WIDTHS = (5.0, 3.0, 1.8)
_PAIRS = (BLACK, VERMILION, GREY)
_LINES = ("-", "--", ":", "-.")


@styled
def engines(comparison: Comparison, marker: str, title: str) -> Figure:
    """Above, x, y and in space z of a marker by every engine; below, the distance of each pair, logarithmic."""
    figure, (above, below) = canvas(6.2, nrows=2, sharex=True, height_ratios=[1.2, 1])
    for k, (name, motion) in enumerate(comparison.trajectories.items()):
        style = {**ENGINES.get(name, OTHER), "linewidth": _WIDTHS[min(k, 2)]}
        path = motion.marker(marker)
        for j, coordinate in enumerate(path.T):
            above.plot(motion.times, coordinate, label=None if j else name, **style)
    times, path = next((m.times, m.marker(marker)) for m in comparison.trajectories.values())
    for axis, value in zip("xyz", path[-1], strict=False):
        above.annotate(axis, (times[-1], value), (6, 0), textcoords="offset points", va="center")
    for k, ((one, a), (other, b)) in enumerate(combinations(comparison.trajectories.items(), 2)):
        distance = np.linalg.norm(a.marker(marker) - b.marker(marker), axis=1)
        style = {"color": _PAIRS[k % 3], "linestyle": _LINES[k % 4]}
        below.plot(a.times, 1e6 * distance, label=f"{one}, {other}", **style)
    below.set_yscale("log")
    log_ticks(below)
    headline(figure, title)
    above.set_ylabel(f"position of {marker} [m]")
    above.legend()
    below.set_ylabel("distance [µm]")
    below.set_xlabel("time [s]")
    if len(comparison.trajectories) > 1:
        below.legend(loc="lower right")
    return figure
