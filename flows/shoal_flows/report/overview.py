"""All studies of a machine over time as a page: each parameter with its intervals, and how it drifts."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from jinja2 import PackageLoader
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from shoal.errors import InputError
from shoal.pictures.drawn import Drawn
from shoal.pictures.pages import environment, software
from shoal.pictures.style import BLUE, GREY, VERMILION, canvas, headline, styled

from shoal_flows.report.drifts import DAY, Drift, Study, drift_of, machines, words


def overview(machine: str | None = None) -> str:
    """The page of one machine, or of all, as HTML without a reference to anything outside. Raises InputError."""
    found = machines()
    if machine is not None and machine not in found:
        there = f"there are {', '.join(found)}" if found else "there are no studies yet; `shoal run identify` makes one"
        raise InputError(f"--machine: no study of {machine!r}; {there}")
    if not found:
        raise InputError("--all: there are no studies yet; `shoal run identify` makes one")
    shown = {name: studies for name, studies in found.items() if machine in (None, name)}
    count = sum(map(len, shown.values()))
    doubted = sum(not study.trusted for studies in shown.values() for study in studies)
    template = environment(PackageLoader("shoal_flows", "report")).get_template("overview.html.j2")
    return template.render(
        title=machine or "All machines",
        trusted=doubted == 0,
        lead=f"{count} studies" + (f", of which {doubted} have an answer that cannot be used." if doubted else "."),
        machines=[_section(name, studies) for name, studies in shown.items()],
        provenance=[("versions", software())],
    )


def _section(machine: str, studies: Sequence[Study]) -> dict[str, Any]:
    names = list(dict.fromkeys(name for study in studies for name in study.values))
    rows = [[study.day, study.name, *(_shown(study, name) for name in names), study.verdict] for study in studies]
    return {
        "name": machine,
        "pictures": [_drawn(name, [study for study in studies if name in study.values]).embedded() for name in names],
        "headings": ["begun (UTC)", "study", *(f"{name}, 95 % interval" for name in names), "verdict"],
        "rows": rows[::-1],
    }


def _shown(study: Study, name: str) -> str:
    value, lower, upper = study.values.get(name, (np.nan,) * 3)
    if np.isnan(value):
        return ""
    return f"{value:.6g}" + ("" if np.isnan(lower) else f" [{lower:.6g}, {upper:.6g}]")


def _drawn(name: str, studies: Sequence[Study]) -> Drawn:
    good, line = drift_of(name, studies)
    says = words(name, line, len(good))
    trusted = sum(study.trusted for study in studies)
    alt = (
        f"{name} over the time of {len(studies)} studies, {trusted} of them trusted, of {len(good)} recordings. {says}."
    )
    caption = (
        "Points with 95 % intervals, one for each recording: its newest answer that can be used, at the time of its "
        "first study, which is not that of the measurement. Crosses are answers that cannot be used and do not count. "
        "Dashed: the line."
    )
    doubted = [study for study in studies if not study.trusted]
    return Drawn(name, _figure(name, good, doubted, line, says), alt, caption)


@styled
def _figure(name: str, good: Sequence[Study], doubted: Sequence[Study], line: Drift | None, says: str) -> Figure:
    figure, axes = canvas()
    for some, look in ((good, {"color": BLUE, "fmt": "o"}), (doubted, {"color": VERMILION, "fmt": "x"})):
        if some:
            value, lower, upper = np.array([study.values[name] for study in some]).T
            # An interval of an answer that cannot be used may span all there is.
            bars = np.nan_to_num(np.abs([value - lower, upper - value])) if some is good else None
            # Many bars would run together and hide the points.
            thin = {"elinewidth": min(1.0, 60 / len(some)), "ecolor": (look["color"], 0.5), "linewidth": 1}
            axes.errorbar(
                [_date(s.started) for s in some], value, bars, markersize=min(4, 300 / len(some)), **thin, **look
            )
    if line is not None:
        ends = np.array([good[0].started, good[-1].started])
        axes.plot([_date(end) for end in ends], line.at(ends), color=GREY, linestyle="--")
    times = [study.started for study in (*good, *doubted)]
    if times and max(times) == min(times):
        # The axis of a single instant would span years.
        axes.set_xlim(_date(times[0] - DAY / 2), _date(times[0] + DAY / 2))
    locator = AutoDateLocator()  # type: ignore[no-untyped-call]
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    # At the right is the date to which the ticks belong.
    axes.set_xlabel("time of the study (UTC)", loc="left")
    axes.set_ylabel(name)
    headline(figure, says)
    _lay_out(figure, axes)
    return figure


def _lay_out(figure: Figure, axes: Axes) -> None:
    """Room for what is written around the axes. The layout that measures it draws everything twice: a page has many."""
    width, height = 72.0 * figure.get_size_inches()
    letters = max(map(len, axes.yaxis.get_major_formatter().format_ticks(list(axes.get_yticks()))), default=0)
    lines = figure.get_suptitle().count("\n") + 1
    with rc_context({"figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)
    left, bottom, right, top = 34 + 8 * letters, 50, 18, 26 + 17 * lines
    axes.set_position((left / width, bottom / height, (width - left - right) / width, (height - bottom - top) / height))


def _date(when: float) -> datetime:
    return datetime.fromtimestamp(when, UTC)
