"""What each marker would tell, and what a longer measurement gains."""

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
    figure, (above, below) = canvas(3.4 + 0.42 * min(_SHOWN, len(found.ranked)) + 2.2, nrows=2)
    _candidates(above, found)
    _durations(below, found)
    headline(figure, _says(found))
    return figure


def _candidates(panel: Axes, found: Design) -> None:
    shown = found.ranked[:_SHOWN]
    beside = dict(found.second)
    places = np.arange(len(shown))
    alone = [found.aim.score(precision) for _, precision in shown]
    pairs = [found.aim.score(beside[candidate]) if candidate in beside else np.nan for candidate, _ in shown]
    dots: dict[str, Any] = {"linestyle": "none", "markersize": 9}
    panel.plot(alone, places, marker="o", color=BLUE, label="alone", **dots)
    panel.plot(pairs, places, marker="D", color=ORANGE, label=f"beside {shown[0][0].label}", **dots)
    panel.axvline(found.aim.score(found.now), color=BLACK, linestyle="--", linewidth=1, label="as now")
    panel.set_xscale("log")
    log_ticks(panel)
    panel.set_yticks(places, [candidate.label for candidate, _ in shown])
    panel.set_ylim(len(shown) - 0.5, -0.5)
    panel.set_xlabel(f"{_score(found)}; to the left is better")
    panel.legend(loc="upper center", bbox_to_anchor=(0.4, -0.28), ncols=3)


def _durations(panel: Axes, found: Design) -> None:
    for (candidate, _), row, look in zip(found.ranked, found.course, LINES, strict=False):
        panel.plot(found.times, row, label=candidate.label, **look)
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
    panel.set_ylabel(_score(found))
    panel.legend(ncols=2, fontsize=10.5)


def _score(found: Design) -> str:
    return f"std of {found.aim.parameter} / range" if found.aim.parameter else "largest std / range"


def _says(found: Design) -> str:
    best, precision = found.ranked[0]
    gain = found.aim.score(found.now) / found.aim.score(precision)
    parts = [f"{found.problem}: measure {best.label}"]
    if np.isfinite(gain) and gain > 1.05:
        parts.append(f"{gain:.2g} times sharper than now")
    if found.second:
        second, both = found.second[0]
        parts.append(
            f"then {second.label}, {found.aim.score(precision) / found.aim.score(both):.2g} times sharper again"
        )
    return "; ".join(parts)
