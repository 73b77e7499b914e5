"""Functions of time and samples of motions in exported scripts, which hold the text of these: they know numpy alone."""

from __future__ import annotations

from typing import Any

import numpy as np


def ramp(x: Any) -> Any:
    """From 0 at x = 0 to 1 at x = 1 with two continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def in_pieces(clock: dict[str, float], edges: list[float], pieces: list[Any], which: list[int] | None = None) -> Any:
    """A function of time that is one of the pieces from each edge to the next; which: their numbers, else in order."""

    def of_time(t: float) -> float:
        t = np.float64(min(t, clock["until"]))  # a step that ends at an edge ends on the left side of it
        row = int(np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(edges) - 2))
        piece = pieces[row if which is None else which[row]]
        with np.errstate(all="ignore"):
            value = float(piece(t))
            # such as sin(t)/t at 0
            return value if np.isfinite(value) else float(piece(t - 1e-6) + piece(t + 1e-6)) / 2

    return of_time


def polynomials(clock: dict[str, float], knots: list[float], coefficients: list[Any], derivative: bool = False) -> Any:
    """A table over time: a polynomial of t - knots[k] from each knot on, highest power first; at rest beyond the ends.

    derivative: its rate instead
    """

    def of_time(t: float) -> float:
        t = min(float(t), clock["until"])
        row = int(np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(knots) - 2))
        if not derivative:
            return float(np.polyval(coefficients[row], np.clip(t, knots[0], knots[-1]) - knots[row]))
        inside = knots[0] <= t < knots[-1]
        return float(np.polyval(np.polyder(coefficients[row]), t - knots[row])) if inside else 0.0

    return of_time


def sampled(wanted: Any, times: Any, places: Any, speeds: Any) -> Any:
    """Places (times, columns) at the wanted times, cubic Hermite polynomials between steps."""
    row = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    size = (times[row] - times[row - 1])[:, None]
    s = (wanted - times[row - 1])[:, None] / size
    before, after = places[row - 1], places[row]
    found = (1 + 2 * s) * (1 - s) ** 2 * before + s**2 * (3 - 2 * s) * after
    return found + size * (s * (1 - s) ** 2 * speeds[row - 1] + s**2 * (s - 1) * speeds[row])
