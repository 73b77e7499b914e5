"""Studies over time: a drift that is put in is found, one that is not there is not claimed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.figure import Figure
from shoal.cli import main
from shoal.errors import InputError
from shoal_flows.report import overview
from shoal_flows.report.drifts import WEEK, Drift, Study, drift, independent
from shoal_flows.tracking.data import Data, inputs
from shoal_flows.tracking.store import connect, experiment

STUDIES, TRUE, SLOPE, NOISE = 30, 250.0, -1.5, 0.8
"""Of a spring [N/m] that softens [N/m per week]."""


def test_a_drift_is_found_within_its_interval_and_none_is_claimed_without_one() -> None:
    random, times = np.random.default_rng(3), WEEK * np.arange(STUDIES)
    covered = claimed = 0
    for _ in range(200):
        noise = NOISE * random.standard_normal(STUDIES)
        widths = np.full(STUDIES, 2 * 1.96 * NOISE)
        line = drift(times, TRUE + SLOPE * times / WEEK + noise, widths)
        assert line is not None
        covered += abs(line.per_week - SLOPE) <= line.either
        still = drift(times, TRUE + noise, widths)
        assert still is not None
        claimed += still.real
    # Of 200 intervals of 95 %, 190 are expected, 9 more or less at three standard deviations.
    assert covered >= 181
    assert claimed <= 19


def test_scatter_beyond_the_intervals_widens_that_of_the_slope() -> None:
    random, times = np.random.default_rng(4), WEEK * np.arange(STUDIES)
    values = TRUE + 10 * NOISE * random.standard_normal(STUDIES)
    told = drift(times, values, np.full(STUDIES, 2 * 1.96 * NOISE))
    unknown = drift(times, values, np.full(STUDIES, np.nan))
    assert told is not None
    assert unknown is not None
    assert told.either == pytest.approx(unknown.either)
    assert drift(times[:2], values[:2], values[:2]) is None


def study(started: float, value: float, *data: str, verdict: str = "identified") -> Study:
    """One study of recordings by their digests, its interval that of a standard deviation of 1."""
    return Study("id", "name", started, verdict, 0.0, {"k": (value, value - 1.96, value + 1.96)}, frozenset(data))


def told(studies: list[Study]) -> Drift | None:
    good = independent(studies)
    return drift([one.started for one in good], [one.values["k"][0] for one in good], [3.92] * len(good))


def test_a_recording_that_is_identified_again_is_no_new_evidence() -> None:
    """Whatever is repeated: noise is called a drift in 5 % of the cases, and two recordings are too few."""
    random, hour, repeats = np.random.default_rng(1), 3600.0, 5
    claimed, cases = 0, 400
    for _ in range(cases):
        values = random.standard_normal(6)
        studies = [
            study(WEEK * week + hour * again, value, f"recording {week}")
            for week, value in enumerate(values)
            for again in range(repeats)
        ]
        line = told(studies)
        assert line is not None
        claimed += line.real
        assert told([one for one in studies if one.started < 1.5 * WEEK]) is None
    # 20 are expected, 13 more or less at three standard deviations; each study on its own would give some 170.
    assert claimed <= 33


def test_the_newest_answer_counts_at_the_time_of_the_first_study() -> None:
    again = [study(WEEK * week, week, f"{week}") for week in range(4)]
    # All in one night by another model: what they tell of the weeks stays, and the slope is of the new values.
    night = [study(50 * WEEK + week, 3.0 * week, f"{week}") for week in range(4)]
    line = told(again + night)
    assert line is not None
    assert line.per_week == pytest.approx(3.0)
    doubted = study(60 * WEEK, 99.0, "0", verdict="not converged")
    without = study(61 * WEEK, 99.0)
    together = study(62 * WEEK, 99.0, "0", "1", "2", "3")
    assert told([*again, *night, doubted, without, together]) == line


@pytest.fixture(scope="module")
def machine() -> str:
    """A machine of thirty weeks, one of whose studies cannot be trusted."""
    client: Any = connect()
    from mlflow.entities import Metric

    place, random = experiment(client, "Identification"), np.random.default_rng(5)
    for week in range(STUDIES):
        value = TRUE + SLOPE * week + NOISE * random.standard_normal() if week != 7 else 900.0
        verdict = "identified" if week != 7 else "not converged"
        tags = {"kind": "study", "machine": "old-press", "verdict": verdict, "mlflow.runName": f"week {week}"}
        run = client.create_run(place, start_time=int(1000 * (1.75e9 + WEEK * week)), tags=tags).info.run_id
        numbers = {"final/k": value, "interval/k/lower": value - 1.6, "interval/k/upper": value + 1.6}
        client.log_inputs(run, inputs([Data("press.csv", f"{week:016x}", "{}", "{}", "{}")]))
        client.log_batch(run, [Metric(name, number, 0, 0) for name, number in numbers.items()])
    return "old-press"


def test_the_page_tells_the_drift_of_a_machine(machine: str, tmp_path: Path) -> None:
    page = tmp_path / "press.html"
    done = CliRunner().invoke(main, ["report", "--all", "--machine", machine, "--out", str(page)])
    assert done.exit_code == 0, done.output
    text = page.read_text()
    assert "30 studies, of which 1 have an answer that cannot be used." in text
    # 1.5 of 228 N/m is 0.66 %.
    assert "k drifts by -1.5" in text
    assert "(-0.6" in text
    assert "week 29" in text
    assert "http" not in text.replace("http://www.w3.org", "")


def test_a_chart_is_drawn_once_and_nothing_of_it_is_cut_off(machine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page has many; the layout that measures what is written draws everything twice."""
    drawn, draw = [], Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, renderer: drawn.append(self) or draw(self, renderer))
    page = overview.overview(machine)
    (figure,) = drawn
    assert page.count("<img") == 1
    (axes,) = figure.axes
    frame, title = figure.bbox, figure._suptitle.get_window_extent()
    for part in (title, axes.get_tightbbox()):
        assert frame.x0 <= part.x0
        assert part.x1 <= frame.x1
        assert frame.y0 <= part.y0
        assert part.y1 <= frame.y1
    assert axes.get_tightbbox().y1 <= title.y0
    # What the axis is, and the date to which its ticks belong, do not run together.
    label, date = axes.xaxis.label.get_window_extent(), axes.xaxis.offsetText.get_window_extent()
    assert label.x1 < date.x0 or not axes.xaxis.offsetText.get_text()


def test_the_axis_of_a_single_study_is_a_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overview, "machines", lambda: {"press": [study(1.75e9, 5.0, "one")]})
    drawn, draw = [], Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, renderer: drawn.append(self) or draw(self, renderer))
    page = overview.overview("press")
    assert "1 recording with a trusted study, too few to tell a drift" in page
    (axes,) = drawn[0].axes
    # A date of matplotlib's is in days.
    assert np.ptp(axes.get_xlim()) == pytest.approx(1)
    label, date = axes.xaxis.label.get_window_extent(), axes.xaxis.offsetText.get_window_extent()
    assert axes.xaxis.offsetText.get_text()
    assert label.x1 < date.x0


def test_a_machine_without_studies_is_one_line(machine: str) -> None:
    with pytest.raises(InputError, match=rf"--machine: no study of 'other'; there are .*{machine}"):
        overview.overview("other")


@pytest.mark.parametrize("given", [[], ["--all", "run"], ["run", "--machine", "old-press"]])
def test_either_runs_or_all(given: list[str]) -> None:
    assert CliRunner().invoke(main, ["report", *given]).exit_code == 2
