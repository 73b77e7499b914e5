"""Identified parameters over time: the studies of each machine in MLflow, and how their parameters drift."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from scipy.special import stdtrit

from shoal_flows.tracking.data import whole
from shoal_flows.tracking.store import answering, connect

DAY = 86400.0
WEEK = 7 * DAY
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


def drift_of(name: str, studies: Sequence[Study]) -> tuple[list[Study], Drift | None]:
    """Return the independent studies of a parameter, and the line through its values."""
    good = independent([study for study in studies if name in study.values])
    values = [study.values[name] for study in good]
    times, widths = [study.started for study in good], [upper - lower for _, lower, upper in values]
    return good, drift(times, [value for value, _, _ in values], widths)


def words(name: str, line: Drift | None, count: int) -> str:
    """Describe a chart in words; count: of recordings."""
    if line is None:
        some = f"{count} recording" + ("s" if count != 1 else "")
        return f"{name}: {some} with a trusted study, too few to tell a drift"
    if not line.real:
        return f"{name} = {line.middle:.5g}; no drift beyond ± {line.either:.2g} per week in {count} recordings"
    part = f" ({100 * line.per_week / abs(line.middle):+.2g} %)" if line.middle else ""
    return f"{name} drifts by {line.per_week:+.3g} ± {line.either:.2g} per week{part}"
