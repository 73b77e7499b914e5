"""Where the markers of a simulated machine are, against time."""

from __future__ import annotations

from matplotlib.figure import Figure

from shoal.pictures.motion import Motion
from shoal.pictures.style import LINES, canvas, headline, styled

_MOST = 6


@styled
def paths(found: Motion, name: str) -> Figure:
    """x above, y below, a line for each of at most six markers."""
    figure, panels = canvas(5.0, nrows=2, sharex=True)
    shown = list(found.markers.items())[:_MOST]
    for panel, axis, k in zip(panels, "xy", (0, 1), strict=True):
        for (marker, path), look in zip(shown, LINES, strict=False):
            panel.plot(found.times, path[:, k], label=marker, **look)
        panel.set_ylabel(f"{axis} [m]")
    panels[-1].set_xlabel("time [s]")
    more = f" ({len(found.markers)} markers, {_MOST} are shown)" if len(found.markers) > _MOST else ""
    headline(figure, f"{name}: where the markers go until {found.times[-1]:.3g} s{more}")
    figure.align_ylabels()
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=len(shown))
    return figure
