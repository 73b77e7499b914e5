"""Values at instants over time: curves and bands, or, where the instants are few, marks and bars at each.

A line or a band through few instants would suggest values between them that were not computed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from shoal.trajectory import Array

FEW = 20
"""So many instants are shown one by one."""
WIDTH = 0.02
"""Of a bar, as a share of the time from the first instant to the last, or of a single instant."""


def curve(axes: Axes, times: Array, values: Array, **look: Any) -> None:
    """Values at these times [s]."""
    axes.plot(times, values, **(look | {"linestyle": "none", "marker": "o"} if len(times) <= FEW else look))


def band(axes: Axes, times: Array, lower: Array, upper: Array, **look: Any) -> None:
    """Fill the area between two values at these times [s]; values that are not finite are left out."""
    if len(times) <= FEW:
        axes.use_sticky_edges = False  # a bar would stand on the edge of the picture
        axes.bar(times, upper - lower, _width(times), bottom=lower, **{"edgecolor": look["color"], **look})
    else:
        axes.fill_between(times, lower, upper, **look)


def time_axis(axes: Axes, times: Array) -> None:
    """Label the axis, about a single instant with room beside its bar."""
    axes.set_xlabel("time [s]")
    if len(times) == 1:
        axes.set_xticks(times)
        axes.set_xlim(times[0] - 2.5 * _width(times), times[0] + 2.5 * _width(times))


def _width(times: Array) -> float:
    """Return the width of bars [s]: neighbours do not touch."""
    whole = WIDTH * float(times[-1] - times[0] or times[0] or 1.0)
    return min(whole, 0.8 * float(np.min(np.diff(times), initial=np.inf)))
