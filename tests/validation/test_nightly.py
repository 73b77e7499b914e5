"""The night: verdicts against limits and earlier nights, a crash that costs one line, files that are whole."""

from __future__ import annotations

import json
import math
import os
import re
import time
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from pathlib import Path

import pytest
from click.testing import CliRunner
from shoal.cli import main as shoal
from shoal.errors import InputError
from shoal_validation.nightly import history
from shoal_validation.nightly import main as command
from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured, motion
from shoal_validation.nightly.page import headline, render
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.result import Night, Result, Verdict
from shoal_validation.nightly.run import judged, run
from shoal_validation.nightly.worker import Worker
from shoal_validation.problems import PROBLEMS

HERE, ELSEWHERE = "processor A, 2 cores", "processor B, 8 cores"


def line(error: float = 1e-9, limit: float | None = 1e-6, method: str = "rk4", seconds: float = 0.1) -> Line:
    """A line of the plan whose run says what it is told."""
    return Line("pendulum", "gauss", method, limit, "made up", partial(Measured, "ok", error, seconds))


def result(error: float = 1e-9, seconds: float = 0.1) -> Result:
    return judged(line(), Measured("ok", error, seconds))


def night(*lines: Result, day: int = 1, machine: str = HERE) -> Night:
    return Night(f"2026-01-{day:02}T02:00:00", machine, {"python": "3.11"}, True, None, 1.0, lines)


def stored(tmp_path: Path, nights: list[Night], machine: str = HERE) -> list[Night]:
    """Nights as they come back from their files."""
    for one in nights:
        history.save(one, tmp_path)
    return history.load(tmp_path, machine)[0]


@pytest.mark.parametrize(
    ("error", "seconds", "verdict"),
    [
        (2.9e-9, 0.149, Verdict.PASSED),
        (3.1e-9, 0.1, Verdict.LESS_ACCURATE),
        (1e-9, 0.151, Verdict.SLOWER),
        (2e-6, 0.1, Verdict.FAILED),
        (math.nan, 0.1, Verdict.FAILED),
    ],
)
def test_verdict_against_the_median_of_earlier_nights(
    tmp_path: Path, error: float, seconds: float, verdict: Verdict
) -> None:
    # One night was wild: the median does not care.
    nights = [night(result(), day=day) for day in range(1, 7)] + [night(result(5e-7, 9.0), day=7)]
    assert history.compare(result(error, seconds), stored(tmp_path, nights)).verdict is verdict


def test_small_changes_are_noise(tmp_path: Path) -> None:
    nights = stored(tmp_path, [night(result(1e-12, 1e-3))])
    assert history.compare(result(9e-11, 5.9e-3), nights).verdict is Verdict.PASSED
    assert history.compare(result(1.1e-10, 1e-3), nights).verdict is Verdict.LESS_ACCURATE
    assert history.compare(result(1e-12, 6.1e-3), nights).verdict is Verdict.SLOWER


def test_only_the_last_seven_nights_count(tmp_path: Path) -> None:
    nights = [night(result(seconds=0.01), day=day) for day in range(1, 9)]
    nights += [night(result(seconds=0.1), day=day) for day in range(9, 16)]
    assert history.compare(result(seconds=0.1), stored(tmp_path, nights)).verdict is Verdict.PASSED


def test_another_machine_has_no_history(tmp_path: Path) -> None:
    assert stored(tmp_path, [night(result(), machine=ELSEWHERE)]) == []


def test_failed_nights_are_no_yardstick(tmp_path: Path) -> None:
    wrong = judged(line(), Measured("diverged", math.nan, 1e-3, "the motion is not finite"))
    compared = history.compare(result(), stored(tmp_path, [night(wrong)]))
    assert (compared.verdict, compared.usual_seconds) == (Verdict.PASSED, None)


def test_an_answer_where_none_is_expected_is_a_failure() -> None:
    """Otherwise an engine that turns silently wrong would pass as one that refuses."""
    refused = Measured("refused", math.nan, math.nan, "engine casadi cannot do closed loops")
    assert judged(line(limit=None), refused).verdict is Verdict.NOT_POSSIBLE
    assert judged(line(limit=None), Measured("ok", 1e-9, 0.1)).verdict is Verdict.FAILED
    assert judged(line(limit=None), Measured("crashed", math.nan, math.nan)).verdict is Verdict.FAILED
    assert judged(line(), refused).verdict is Verdict.FAILED


def test_a_night_survives_its_file_and_is_never_replaced(tmp_path: Path) -> None:
    one = night(result(), result(math.nan))
    assert stored(tmp_path, [one]) == [one]
    with pytest.raises(FileExistsError):
        history.save(one, tmp_path)


def test_files_that_are_no_nights_are_named(tmp_path: Path) -> None:
    data = night(result()).to_json()
    texts = ["{", "[]", json.dumps({**data, "version": 99}), json.dumps({**data, "lines": [{}]})]
    for number, text in enumerate(texts):
        (tmp_path / f"night-{number}.json").write_text(text)
    nights, unread = history.load(tmp_path, HERE)
    assert (nights, len(unread)) == ([], len(texts))


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "index.html"
    history.write_whole(target, "old")

    def full(handle: int) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space"):
        history.write_whole(target, "new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("index.html", "old")]


@pytest.mark.slow
def test_a_crash_costs_one_line() -> None:
    """The lines after it are measured by a new process."""
    crash = replace(line(method="crash"), run=partial(os._exit, 7))
    found = run([line(method="before"), crash, line(method="after")]).lines
    assert [one.verdict for one in found] == [Verdict.PASSED, Verdict.FAILED, Verdict.PASSED]
    assert found[1].status == "crashed"
    assert "status 7" in found[1].found


def test_a_run_that_hangs_is_stopped() -> None:
    with Worker() as worker:
        assert worker.measure(partial(time.sleep, 60), 0.2).status == "timeout"


@pytest.mark.slow
def test_a_real_line_is_measured_in_the_worker() -> None:
    real = Line("pendulum", "gauss", "default", 1e-9, "order 8", partial(motion, "pendulum", "gauss", {}))
    impossible = Line("four-bar-2", "casadi", "cvodes", 1e-9, "", partial(motion, "four-bar-2", "casadi", {}))
    passed, refused = run([real, impossible]).lines
    assert passed.verdict is Verdict.PASSED
    assert passed.error is not None
    assert 0 < passed.error < 1e-9
    assert passed.seconds is not None
    assert passed.seconds > 0
    assert refused.verdict is Verdict.FAILED
    assert "cannot do closed loops" in refused.found


@pytest.mark.parametrize(("second", "verdict"), [(0.01, Verdict.PASSED), (0.2, Verdict.SLOWER)])
def test_a_line_that_seems_slower_is_measured_again(
    second: float, verdict: Verdict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others on the machine may have slowed it down: the better of two tries counts."""
    tries = [Measured("ok", 1e-9, 0.1), Measured("ok", 1e-9, second)]
    monkeypatch.setattr(Worker, "measure", lambda *_: tries.pop(0))
    found = run([line()], [night(result(seconds=0.01))]).lines[0]
    assert (found.verdict, found.seconds, tries) == (verdict, min(0.1, second), [])


@pytest.fixture(autouse=True)
def own_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A night that fails keeps models of other tests from being champions."""
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))


FAKE = [line(method="good"), line(error=0.25, limit=1e-3, method="bad")]


@pytest.mark.slow
def test_a_failing_line_exits_3_and_names_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "plan", lambda only, quick: FAKE)
    done = CliRunner().invoke(shoal, ["validate"])
    assert done.exit_code == 3
    (complaint,) = [text for text in done.stderr.splitlines() if "bad: failed" in text]
    named = ("pendulum", "gauss", "bad", "expected at most 1.0e-03 m from elliptic functions", "found 2.5e-01 m")
    assert all(part in complaint for part in named)
    assert "1 of 2 lines passed; 1 failed." in done.stdout
    assert all(len(text) <= 80 for text in done.stdout.splitlines() if not text.startswith("page"))


def test_json_is_one_object_and_all_passed_exits_0(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "plan", lambda only, quick: FAKE[:1])
    done = CliRunner().invoke(shoal, ["validate", "--json", "--only", "pendulum"])
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["status"], found["counts"]["passed"], found["only"]) == ("ok", 1, "pendulum")
    assert json.loads(Path(found["file"]).read_text())["lines"] == found["lines"]
    assert Path(found["page"]).read_text().startswith("<!DOCTYPE html>")


def test_an_unknown_problem_is_bad_input() -> None:
    done = CliRunner().invoke(shoal, ["validate", "--only", "nothing"])
    assert done.exit_code == 2
    assert re.fullmatch(r"shoal: --only: no problem 'nothing'; there are pendulum, .*\n", done.stderr)
    with pytest.raises(InputError):
        plan("nothing")


class Links(HTMLParser):
    """Every address on a page, and whether every chart says what it shows."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.charts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [value or "" for name, value in attrs if name in ("href", "src", "srcset", "data")]
        if tag == "svg":
            self.charts.append(dict(attrs).get("aria-label") or "")


def test_the_page_names_failures_draws_trends_and_asks_for_nothing() -> None:
    before = [night(*(judged(one, Measured("ok", 1e-4, 0.1)) for one in FAKE), day=day) for day in (1, 2)]
    last = night(*(judged(one, one.run()) for one in FAKE), day=3)
    text = render(last, before)
    assert "pendulum, gauss, bad" in text
    assert "at most 1.0e-03 m from elliptic functions" in text
    page = Links(text)
    assert len(page.charts) == 6  # Error and time of both lines; the failed one is shown on top again.
    assert all("over 3 nights" in alt for alt in page.charts)
    assert all(address.startswith(("#", "night-")) for address in page.addresses)
    assert "http" not in text


def test_headline_counts_what_was_asked() -> None:
    passed, refused = result(), judged(line(limit=None), Measured("refused", math.nan, math.nan))
    assert headline(night(passed, refused)) == "1 of 1 lines passed; 1 more give no answer, as expected."


def test_text_from_engines_is_escaped_on_the_page() -> None:
    wrong = judged(line(), Measured("failed", math.nan, math.nan, "<script>alert(1)</script>"))
    assert "<script>" not in render(night(wrong), [])


def test_the_plan_covers_every_problem_and_engine_with_limits_above_the_references_own_error() -> None:
    lines = plan()
    keys = [(one.problem, one.engine, one.method) for one in lines]
    assert len(set(keys)) == len(keys)
    motions = [one for one in lines if one.unit == "m"]
    assert {one.problem for one in motions} == set(PROBLEMS)
    for name in PROBLEMS:
        engines = {one.engine for one in motions if one.problem == name}
        # exudyn-ge repeats what exudyn does with rigid bodies; forty loops more slowly than that is worth.
        assert engines >= {"gauss", "exudyn", "casadi"}
        assert "exudyn-ge" in engines or name == "four-bar-40" or PROBLEMS[name].scene().dimensions == 3
    for one in motions:
        assert one.limit is None or one.limit >= PROBLEMS[one.problem].reference.error
    quick = plan(quick=True)
    assert {one.problem for one in quick} == {one.problem for one in lines if one.unit not in ("cells", "machines")}
    assert len(quick) < len(lines)


@pytest.mark.slow
def test_a_quick_night_passes_within_three_minutes() -> None:
    done = CliRunner().invoke(shoal, ["validate", "--quick", "--json"])
    found = json.loads(done.stdout)
    assert done.exit_code == 0, done.stderr
    assert found["status"] == "ok"
    assert found["wall_s"] < 180
