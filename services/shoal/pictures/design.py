"""Optimal experiment design: the information of each sensor, and the gain of a longer measurement."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shoal.identification.design import Design
from shoal.pictures.style import BLACK, BLUE, GREY, LINES, ORANGE, canvas, headline, log_ticks, styled

_SHOWN = 8


@styled
def design(found: Design) -> Figure:
    """Left, the weakest parameter by each candidate, alone and beside the best; right, over the duration."""
    rows = shown(found)
    figure, (above, below) = canvas(4.4 + 0.6 * len(rows) + 2.2, nrows=2)
    _candidates(above, found, rows)
    _durations(below, found, rows[: len(LINES)])
    headline(figure, says(found))
    return figure


def shown(found: Design) -> list[int]:
    """Return the sensors to draw: the best of every kind, then the best of the others, by rank."""
    first = {sensor.quantity: k for k, (sensor, _) in reversed([*enumerate(found.ranked)])}
    best = sorted(first.values())
    others = (k for k in range(len(found.ranked)) if k not in best)
    return sorted([*best, *others][:_SHOWN])


def _candidates(panel: Axes, found: Design, rows: list[int]) -> None:
    shown = [found.ranked[k] for k in rows]
    beside = dict(found.second)
    places = np.arange(len(shown))
    alone = [found.aim.score(precision) for _, precision in shown]
    pairs = [found.aim.score(beside[candidate]) if candidate in beside else np.nan for candidate, _ in shown]
    dots: dict[str, Any] = {"linestyle": "none", "markersize": 9}
    panel.plot(alone, places, marker="o", color=BLUE, label="alone", **dots)
    panel.plot(pairs, places, marker="D", color=ORANGE, label="beside the best", **dots)
    panel.axvline(found.aim.score(found.now), color=BLACK, linestyle="--", linewidth=1, label="as now")
    panel.set_xscale("log")
    log_ticks(panel)
    panel.set_yticks([])
    for place, (candidate, _) in zip(places, shown, strict=True):
        over = panel.get_yaxis_transform()
        panel.annotate(candidate.label, (0, place), (4, 8), textcoords="offset points", fontsize=11, xycoords=over)
    panel.set_ylim(len(shown) - 0.6, -0.8)
    panel.set_xlabel(f"{score_of(found)}; to the left is better")
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)


def _durations(panel: Axes, found: Design, rows: list[int]) -> None:
    for k, look in zip(rows, LINES, strict=False):
        panel.plot(found.times, found.course[k], label=found.ranked[k][0].label, **look)
    panel.axvline(found.duration, color=GREY, linewidth=1)
    panel.annotate(
        "today",
        (found.duration, 0),
        (4, 4),
        textcoords="offset points",
        va="bottom",
        color=GREY,
        xycoords=panel.get_xaxis_transform(),
    )
    panel.set_yscale("log")
    finite = found.course[np.isfinite(found.course)]
    if finite.size:
        panel.set_ylim(finite.min() / 2, min(finite.max(), 1e4 * finite.min()))
    log_ticks(panel)
    panel.set_xlabel("duration of the measurement [s]")
    panel.set_ylabel(score_of(found))
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), fontsize=10.5)


def score_of(found: Design) -> str:
    """Describe the criterion of the comparison."""
    return f"std of {found.aim.parameter} / range" if found.aim.parameter else "largest std / range"


def says(found: Design) -> str:
    """Return the best measurement in a line."""
    best, precision = found.ranked[0]
    gain = found.aim.score(found.now) / found.aim.score(precision)
    parts = [f"{found.problem}: measure {best.label}"]
    if np.isfinite(gain) and gain > 1.05:
        parts.append(f"{_times(gain)} sharper than now")
    if found.second:
        second, both = found.second[0]
        parts.append(f"then {second.label}, {_times(found.aim.score(precision) / found.aim.score(both))} sharper again")
    return "; ".join(parts)


def _times(gain: float) -> str:
    """A gain to two digits, 110 and not 1.1e+02."""
    return f"{float(f'{gain:.2g}'):g} times"
