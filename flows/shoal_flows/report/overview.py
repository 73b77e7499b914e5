"""All studies of a machine over time, from MLflow: each parameter with its intervals, and how it drifts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from jinja2 import PackageLoader
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure
from scipy.special import stdtrit
from shoal.errors import InputError
from shoal.pictures.drawn import Drawn
from shoal.pictures.pages import environment, software
from shoal.pictures.style import BLUE, GREY, VERMILION, canvas, headline, styled

from shoal_flows.tracking.data import whole
from shoal_flows.tracking.store import answering, connect

_DAY = 86400.0
WEEK = 7 * _DAY
_FEWEST = 3
"""Recordings, without which nothing is said of a drift."""
_TRUSTED = "identified"
"""How the verdicts begin of answers that can be used."""


@dataclass(frozen=True)
class Study:
    """One study. values: (value, lower, upper) by parameter, interval nan where none was kept; started [s].

    data: identifies the recordings that it was fitted to, in whole or in part.
    """

    run_id: str
    name: str
    started: float
    verdict: str
    fitness: float
    values: dict[str, tuple[float, float, float]]
    data: frozenset[str]

    @property
    def day(self) -> str:
        """When it began, UTC."""
        return datetime.fromtimestamp(self.started, UTC).strftime("%Y-%m-%d %H:%M")

    @property
    def trusted(self) -> bool:
        """Return whether its answer can be used."""
        return self.verdict.startswith(_TRUSTED)


@dataclass(frozen=True)
class Drift:
    """A straight line through the trusted values. per_week, either: its slope and half of its 95 % interval [1/week];
    middle: its value at the mean time.
    """

    per_week: float
    either: float
    middle: float
    mean: float

    @property
    def real(self) -> bool:
        """Return whether the interval of the slope leaves out zero."""
        return abs(self.per_week) > self.either

    def at(self, when: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """The line's value at times [s]."""
        return np.asarray(self.middle + self.per_week * (when - self.mean) / WEEK)


@answering()
def machines() -> dict[str, list[Study]]:
    """All studies with an answer, by machine, oldest first. Raises ComputationError."""
    found: dict[str, list[Study]] = {}
    for run in _runs(connect()):
        metrics, tags = run.data.metrics, run.data.tags
        # Studies of earlier versions do not name the machine.
        machine = tags.get("machine") or run.data.params.get("problem", "")
        names = [n.removeprefix("final/") for n in metrics if n.startswith("final/") and n not in _FIGURES]
        values = {
            name: tuple(metrics.get(key, np.nan) for key in (f"final/{name}", *_interval(name))) for name in names
        }
        if values:
            fitness, started = metrics.get("final/fitness", np.nan), run.info.start_time / 1e3
            sets = [one.dataset for one in run.inputs.dataset_inputs]
            data = frozenset(whole(one.digest, one.source) for one in sets)
            one = Study(run.info.run_id, run.info.run_name, started, tags.get("verdict", ""), fitness, values, data)
            found.setdefault(machine, []).append(one)
    return found


_FIGURES = ("final/fitness", "final/rms")


def _interval(name: str) -> tuple[str, str]:
    return f"interval/{name}/lower", f"interval/{name}/upper"


def _runs(client: Any) -> Iterator[Any]:
    experiment, token = client.get_experiment_by_name("Identification"), None
    while experiment is not None:
        page = client.search_runs(
            [experiment.experiment_id],
            "tags.kind = 'study'",
            max_results=1000,
            order_by=["start_time"],
            page_token=token,
        )
        yield from page
        token = page.token
        if not token:
            return


def independent(studies: Sequence[Study]) -> list[Study]:
    """Return the trusted studies that share no recording, oldest first: the same samples again are no new evidence.

    Of several of the same recordings the newest counts, at the time when these were first studied, which is the nearest
    to their measurement; of others that overlap that of fewer recordings. One without known data does not count.
    """
    first: dict[frozenset[str], float] = {}
    for study in studies:
        first[study.data] = min(study.started, first.get(study.data, np.inf))
    taken: set[str] = set()
    found = []
    for study in sorted(studies, key=lambda study: (len(study.data), -study.started)):
        if study.trusted and study.data and not taken & study.data:
            taken |= study.data
            found.append(replace(study, started=first[study.data]))
    return sorted(found, key=lambda study: study.started)


def drift(times: Sequence[float], values: Sequence[float], widths: Sequence[float]) -> Drift | None:
    """The weighted straight line through independent values over times [s]; None where there are too few.

    widths: of the 95 % intervals; values count by them where all are known. What the values scatter beyond their
    intervals widens that of the slope (the Birge ratio); a scatter below them does not narrow it.
    """
    when, y, wide = (np.asarray(numbers, dtype=float) for numbers in (times, values, widths))
    if len(when) < _FEWEST or np.ptp(when) == 0:
        return None
    known = bool(np.all(np.isfinite(wide)) and np.all(wide > 0))
    weight = (2 * 1.96 / wide) ** 2 if known else np.ones_like(y)
    mean = float(np.sum(weight * when) / np.sum(weight))
    x = (when - mean) / WEEK
    slope = float(np.sum(weight * x * y) / np.sum(weight * x**2))
    middle = float(np.sum(weight * y) / np.sum(weight))
    scatter = float(np.sum(weight * (y - middle - slope * x) ** 2) / (len(y) - 2))
    std = np.sqrt((max(scatter, 1.0) if known else scatter) / np.sum(weight * x**2))
    return Drift(slope, float(stdtrit(len(y) - 2, 0.975) * std), middle, mean)


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
    good = independent(studies)
    values = [study.values[name] for study in good]
    line = drift([s.started for s in good], [v for v, _, _ in values], [upper - lower for _, lower, upper in values])
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


def words(name: str, line: Drift | None, count: int) -> str:
    """Describe a chart in words; count: of recordings."""
    if line is None:
        some = f"{count} recording" + ("s" if count != 1 else "")
        return f"{name}: {some} with a trusted study, too few to tell a drift"
    if not line.real:
        return f"{name} = {line.middle:.5g}; no drift beyond ± {line.either:.2g} per week in {count} recordings"
    part = f" ({100 * line.per_week / abs(line.middle):+.2g} %)" if line.middle else ""
    return f"{name} drifts by {line.per_week:+.3g} ± {line.either:.2g} per week{part}"


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
        axes.set_xlim(_date(times[0] - _DAY / 2), _date(times[0] + _DAY / 2))
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
