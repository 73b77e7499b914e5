"""Nights of one's own machines: what a scene of the library expects, who tells that it is so, and what has changed."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.special import ellipj, ellipk
from shoal import library
from shoal.cli import main as shoal
from shoal.errors import InputError
from shoal.scene.load import scene_library
from shoal.shelf import shelf
from shoal_validation.nightly import main as command
from shoal_validation.nightly.hold import Held, hold
from shoal_validation.nightly.measure import attempt
from shoal_validation.nightly.own import lines
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.result import Verdict
from shoal_validation.nightly.worker import Worker

PENDULUM = (scene_library() / "single-pendulum.yaml").read_text(encoding="utf-8")
TIMES = np.linspace(0.1, 2.0, 20)
ANGLE = 2 * np.arcsin(np.sqrt(0.5) * ellipj(ellipk(0.5) - np.sqrt(9.81) * TIMES, 0.5)[0])
"""Of a mass point on 1 m that is released horizontally, by elliptic functions."""
TRUE_X = float(np.sin(ANGLE)[-1])


@pytest.fixture(autouse=True)
def own_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))


@pytest.fixture
def within(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines are measured in this process."""
    monkeypatch.setattr(Worker, "measure", lambda _, run, timeout: attempt(run))


@pytest.fixture
def arm(tmp_path: Path) -> Callable[..., library.Entry]:
    """Adds the pendulum with what is expected of it, and perhaps another mass."""

    def add(*expected: str, mass: float = 1.0, table: str | None = None) -> library.Entry:
        (tmp_path / "run.csv").write_text(table or recording())
        text = PENDULUM.replace("mass: 1.0", f"mass: {mass}")
        listed = "".join(f"  {line}\n" for line in expected)
        (tmp_path / "arm.yaml").write_text(f"{text}\nexpect:\n{listed}" if listed else text)
        return library.add(tmp_path / "arm.yaml")

    return add


def recording(noise: float = 0.0) -> str:
    """The pendulum as elliptic functions have it, in the columns of `shoal simulate --out`; noise: [m]"""
    x = np.sin(ANGLE) + noise * np.random.default_rng(0).standard_normal(len(TIMES))
    rows = [f"{t:.6f},{a:.12f},{b:.12f}\n" for t, a, b in zip(TIMES, x, -np.cos(ANGLE), strict=True)]
    return "".join(["t,A.x,A.y\n", *rows])


def night(day: int) -> Held:
    return hold(list(lines()), now=datetime(2026, 3, day, 2, tzinfo=UTC))


VALUE = f"tip: {{kind: value, marker: A, quantity: x, at: 2.0, value: {TRUE_X:.12f}, tolerance: 1.0e-9}}"
RECORDED = "run: {kind: recording, path: run.csv, tolerance: 1.0e-9}"
ENGINE = "other: {kind: engine, engine: exudyn, tolerance: 1.0e-4}"
AS_BEFORE = "still: {kind: as-before, tolerance: 1.0e-9}"


@pytest.mark.slow
def test_each_kind_of_expectation_is_met_by_a_right_machine_and_charted(arm: Callable[..., library.Entry]) -> None:
    entry = arm(VALUE, RECORDED, ENGINE, AS_BEFORE)
    night(1)
    held = night(2)
    found = {line.method: line for line in held.night.lines}
    assert list(found) == ["tip", "run", "other", "still"]
    assert {line.verdict for line in found.values()} <= {Verdict.PASSED, Verdict.SLOWER}, [
        line.complaint for line in found.values()
    ]
    assert {(line.problem, line.version) for line in found.values()} == {("library/arm", entry.version)}
    assert 0 < found["run"].error < 1e-9
    assert found["still"].error == 0.0
    assert f"A.x = {TRUE_X:g} m at 2 s" in found["tip"].expected
    assert 'aria-label="error over 2 nights' in held.text
    assert "A scene of the library." in held.text
    # What is kept for the next night is read again.
    assert len(json.loads(held.file.read_text())["lines"][3]["points"]) == 100


@pytest.mark.slow
@pytest.mark.usefixtures("within")
def test_a_machine_that_is_not_as_expected_fails_and_the_night_says_since_when(
    arm: Callable[..., library.Entry], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = arm(VALUE, RECORDED)
    night(1)
    second = arm(VALUE.replace(f"{TRUE_X:.12f}", "0.0"), RECORDED, table=recording(noise=1e-3))
    held = night(2)
    tip, run = held.night.lines
    assert (tip.verdict, run.verdict) == (Verdict.FAILED, Verdict.FAILED)
    assert tip.error == pytest.approx(abs(TRUE_X), abs=1e-9)
    assert run.error == pytest.approx(1e-3, rel=0.5)
    assert held.night.changes == (
        f"library/arm: version {second.version}, was {first.version}",
        "library/arm, gauss, tip: failed, was passed",
        "library/arm, gauss, run: failed, was passed",
    )
    assert "Since the night before" in held.text
    monkeypatch.setattr(command, "plan", lambda only, quick: list(lines()))
    done = CliRunner().invoke(shoal, ["validate"])
    assert done.exit_code == 3
    assert "library/arm, gauss, tip: failed; expected at most 1.0e-09 m from A.x = 0 m at 2 s; found" in done.stderr


@pytest.mark.usefixtures("within")
def test_a_motion_is_compared_with_the_night_before_as_long_as_the_scene_is_the_same(
    arm: Callable[..., library.Entry],
) -> None:
    arm(AS_BEFORE)
    held = night(1)
    # As if the program had computed something else then.
    data = json.loads(held.file.read_text())
    data["lines"][0]["points"][0] += 3e-6
    data["lines"][0]["points"][1] += 4e-6
    held.file.write_text(json.dumps(data))
    (line,) = night(2).night.lines
    assert line.verdict is Verdict.FAILED
    assert line.error == pytest.approx(5e-6, rel=1e-6)
    assert night(3).night.lines[0].verdict is Verdict.PASSED
    arm(AS_BEFORE, mass=2.0)
    (line,) = night(4).night.lines
    assert (line.verdict, line.error, line.usual_seconds) == (Verdict.PASSED, 0.0, None)


@pytest.mark.usefixtures("within")
def test_a_scene_that_cannot_be_read_any_more_costs_its_lines_and_not_the_night(
    arm: Callable[..., library.Entry], tmp_path: Path
) -> None:
    (tmp_path / "run-7.csv").write_text(recording())
    library.add(tmp_path / "run-7.csv")
    arm("run: {kind: recording, path: run-7, tolerance: 1.0e-9}", VALUE)
    shelf().remove("recordings", "run-7")
    run, tip = night(1).night.lines
    assert run.verdict is Verdict.FAILED
    assert "expect.run: path: run-7: no such file, nor recording of the library" in run.found
    assert tip.verdict is Verdict.PASSED


def test_expectations_are_of_the_plan_by_name_and_are_no_part_of_the_machine(
    arm: Callable[..., library.Entry],
) -> None:
    assert not any(line.problem == "library/arm" for line in plan())
    bare, stated = arm(), arm(VALUE)
    assert [line.method for line in plan("arm", quick=True)] == ["tip"] == [line.method for line in plan("library/arm")]
    with pytest.raises(InputError, match=r"--only: no problem 'nothing'; there are pendulum, .*, library/arm$"):
        plan("nothing")
    scenes = [library.load_scene(f"arm@{entry.version}") for entry in (bare, stated)]
    assert scenes[0].fingerprint == scenes[1].fingerprint


@pytest.mark.parametrize(
    ("expected", "why"),
    [
        (
            "tip: {kind: value, marker: Z, quantity: x, at: 1.0, value: 0.0, tolerance: 1.0}",
            "expect.tip.marker: no mar",
        ),
        ("tip: {kind: value, marker: A, quantity: x, at: 1.0, value: 0.0, tolerance: 0}", "expect.tip.tolerance: "),
        ("run: {kind: recording, path: gone, tolerance: 1.0}", "expect.run: path: gone: no such file, nor recording"),
        ("run: {kind: recording, path: ../run.txt, tolerance: 1.0}", "expect.run.path: ../run.txt cannot be read"),
        ("other: {kind: engine, engine: nobody, tolerance: 1.0}", "expect.other: engine: no engine 'nobody'"),
        ("still: {kind: yesterday, tolerance: 1.0}", "expect.still"),
    ],
)
def test_what_is_wrong_with_an_expectation_is_refused_with_its_field(
    arm: Callable[..., library.Entry], expected: str, why: str
) -> None:
    with pytest.raises(InputError) as refused:
        arm(expected)
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)
    assert library.entries("scenes") == []
