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
from shoal_flows.report.overview import WEEK, drift
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


def test_a_machine_without_studies_is_one_line(machine: str) -> None:
    with pytest.raises(InputError, match=rf"--machine: no study of 'other'; there are .*{machine}"):
        overview.overview("other")


@pytest.mark.parametrize("given", [[], ["--all", "run"], ["run", "--machine", "old-press"]])
def test_either_runs_or_all(given: list[str]) -> None:
    assert CliRunner().invoke(main, ["report", *given]).exit_code == 2
