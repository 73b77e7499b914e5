"""The axis of time of pictures of bounds; a single instant, whose curves had no length to see, is a bar."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from shoal.trajectory import Array

WIDTH = 0.02
"""Of the bar, as a share of the instant."""


def instants(times: Array) -> Array:
    """The times [s] as they are, or the two ends of the bar."""
    return times if len(times) > 1 else times[0] + 0.5 * WIDTH * (times[0] or 1.0) * np.array([-1.0, 1.0])


def over(times: Array, values: NDArray[Any]) -> NDArray[Any]:
    """Values (..., times) at `instants(times)`."""
    return np.broadcast_to(values, (*values.shape[:-1], len(instants(times))))


def time_axis(axes: Axes, times: Array) -> None:
    """Label the axis, about a single instant with room beside the bar."""
    axes.set_xlabel("time [s]")
    if len(times) == 1:
        axes.set_xticks(times)
        axes.set_xlim(*(times[0] + 5 * (instants(times) - times[0])))
