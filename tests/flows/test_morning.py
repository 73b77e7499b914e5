"""The morning page names what nobody should miss, and nothing else."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from shoal.home import home
from shoal_flows.flows.marked import _let_go
from shoal_flows.report import morning
from shoal_flows.report.drifts import DAY, WEEK, Study
from shoal_flows.tracking.store import open_run
from shoal_validation.nightly import history
from shoal_validation.nightly.result import Night, Result, Verdict


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where nights lie; no studies but those of a test."""
    monkeypatch.setattr(history, "folder", lambda: tmp_path)
    monkeypatch.setattr(morning, "machines", dict)
    return tmp_path


def stored(folder: Path, verdict: Verdict) -> None:
    line = Result("pendulum", "gauss", "rk4", "1e-9", "2e-3", 2e-3, 1e-9, "m", 0.1, "ok", verdict, "theory")
    night = Night("2026-01-02T02:00:00", "here", {}, False, None, 1.0, (line,), ("numpy: 2.4.5, now 2.4.6",))
    history.save(night, folder)


def test_a_run_that_is_not_to_be_trusted_is_named_with_its_reason() -> None:
    with open_run("Forward", "good motion") as run:
        run.judge("ok")
    with open_run("Forward", "rejected motion") as run:
        run.judge("failed", ["the mesh error is about 0.2 m"])
        with open_run("Forward", "a part of it", parent=run.run_id) as part:
            part.judge("failed", ["also wrong"])
    page = morning.morning(time.time() + 1)
    look, rest = page.split('id="runs"')
    assert "not to be trusted" in look
    assert "rejected motion</a>: the mesh error is about 0.2 m" in look
    assert "good motion" not in look
    assert "good motion" in rest
    assert "a part of it" not in page
    assert "good motion" not in morning.morning(time.time() + 2 * DAY)


def test_a_line_of_the_night_that_failed_and_what_changed_are_named(folder: Path) -> None:
    stored(folder, Verdict.FAILED)
    page = morning.morning(time.time() + 2 * DAY)
    assert "pendulum, gauss, rk4: failed" in page
    assert "numpy: 2.4.5, now 2.4.6" in page
    assert 'class="lead bad"' in page


def test_a_quiet_day_is_good(folder: Path) -> None:
    stored(folder, Verdict.PASSED)
    page = morning.morning(time.time() + 2 * DAY)
    assert (
        "0 runs in the last 24 hours; nightly validation: 1 of 1 lines passed; no parameter is known to drift." in page
    )
    assert 'class="lead good"' in page
    assert "Where to look" not in page


def test_a_drift_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    values = [5.0 + 0.5 * week for week in range(4)]
    studies = [
        Study("id", "name", WEEK * week, "identified", 0.0, {"k": (v, v - 0.1, v + 0.1)}, frozenset([str(week)]))
        for week, v in enumerate(values)
    ]
    monkeypatch.setattr(morning, "machines", lambda: {"press": studies})
    assert "press: k drifts by +0.5" in morning.morning(time.time() + 2 * DAY)


def test_the_end_of_a_flow_brings_the_page_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(morning, "refresh", lambda: written.append(home()))
    written: list[Path] = []
    _let_go(None, type("FlowRun", (), {"id": "none"}), None)
    assert written == [home()]
