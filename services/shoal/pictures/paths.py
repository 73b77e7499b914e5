"""Positions of the markers of a simulated machine over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.contacts import mark_impacts, mark_times
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.style import LINES, canvas, headline, styled
from shoal.trajectory import Array

_MOST = 6


@styled
def paths(found: DrawnMotion, title: str) -> Figure:
    """x above, y below it, in space z below them, a line for each of at most six paths."""
    axes = "xyz"[: found.ground.shape[1]]
    figure, panels = canvas(1.4 + 1.8 * len(axes), nrows=len(axes), sharex=True)
    lines = _lines(found)
    shown = lines[:_MOST]
    for panel, axis, k in zip(panels, axes, range(len(axes)), strict=True):
        for (names, path, hits), look in zip(shown, LINES, strict=False):
            panel.plot(found.times, path[:, k], label=names, **look)
            mark_impacts(panel, found.times, np.stack([found.times, path[:, k]], axis=1), hits)
        panel.set_ylabel(f"{axis} [m]")
    mark_times(panels[-1], found.events)
    panels[-1].set_xlabel("time [s]")
    more = f" ({_MOST} of {len(lines)} paths are shown)" if len(lines) > _MOST else ""
    headline(figure, f"{title}{more}")
    figure.align_ylabels()
    # The lowest panel has the marks of events too.
    handles, names = panels[-1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower left", ncols=min(4, len(names)))
    return figure


def _lines(found: DrawnMotion) -> list[tuple[str, Array, Array]]:
    """The paths of the markers by name, with times of impacts [s]; markers in one place all the time share a path."""
    groups: list[tuple[list[str], Array]] = []
    for marker, path in found.markers.items():
        alike = next((names for names, other in groups if np.allclose(path, other, rtol=0.0, atol=1e-9)), None)
        if alike is None:
            groups.append(([marker], path))
        else:
            alike.append(marker)
    none = np.zeros(0)
    return [(", ".join(names), path, found.struck.get(names[0], none)) for names, path in groups]
