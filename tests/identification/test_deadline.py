"""A limit holds through all stages: what would take longer than is left is not begun, and the best so far is told."""

from __future__ import annotations

import time
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import Problem, Verdict, identify
from shoal.identification.conclude import Options
from shoal.identification.deadline import Deadline, TimeIsUp, unless_late
from shoal.mechanics.simulate import simulate
from shoal.scene import load_scene

SCENE = load_scene("single-pendulum")
TIMES = np.linspace(0.0, 1000.0, 11)[1:]


class Clock:
    """A clock that only simulations move: `pace` seconds for each simulated second, and `fixed` for each run."""

    def __init__(self, pace: float) -> None:
        self.now, self.pace, self.fixed, self.ends = 0.0, pace, 0.0, list[float]()
        self.steps = list[int]()

    def run(self, scene: Any, times: Any) -> Any:
        self.now += self.fixed + self.pace * float(times[-1])
        self.ends.append(float(times[-1]))
        self.steps.append(scene.solver.max_steps)
        return SimpleNamespace(steps=int(100 * times[-1]))


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock(0.01)
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    return clock


def test_a_run_that_would_take_longer_is_not_begun(clock: Clock) -> None:
    limited = Deadline(5.0)
    with pytest.raises(TimeIsUp):
        limited.run("kind", SCENE, TIMES, clock.run)
    assert max(clock.ends) < 100.0, "only its beginning was run, to see its pace"
    assert limited.cost == pytest.approx(10.0)


def test_a_run_for_which_there_is_time_is_made_once_its_pace_is_known(clock: Clock) -> None:
    limited = Deadline(100.0)
    for _ in range(3):
        limited.run("kind", SCENE, TIMES, clock.run)
    assert clock.ends.count(1000.0) == 3
    assert len(clock.ends) == 4
    assert clock.steps[-1] < SCENE.solver.max_steps, "other parameters may need shorter steps"


def test_what_every_run_costs_is_not_multiplied_by_its_length(clock: Clock) -> None:
    """Two seconds of assembling and ten of motion are twelve; by the pace of the beginning they were 522."""
    clock.fixed = 2.0
    limited = Deadline(30.0)
    limited.run("kind", SCENE, TIMES, clock.run)
    assert clock.ends[-1] == 1000.0
    assert limited.cost == pytest.approx(12.0)


def test_pauses_do_not_count_and_the_answer_has_a_little_more(clock: Clock) -> None:
    limited = Deadline(10.0)
    with limited.paused():
        clock.now += 100.0
    limited.check()
    clock.now += 10.0
    with pytest.raises(TimeIsUp):
        limited.check()
    assert unless_late(lambda: limited.check() or 1, 2) == 2
    limited.extend()
    limited.extend()
    assert limited.remaining == pytest.approx(2.0)


def problem(**changes: Any) -> Problem:
    source = {"kind": "engine", "engine": "gauss", "stop": 2.0, "count": 40, "noise": 1e-3}
    parameters = {name: {"path": f"initial.{name}.angle", "lower": -3.0, "upper": 3.0} for name in ("OA", "AB")}
    channels = [{"marker": "B", "quantity": "x"}, {"marker": "B", "quantity": "y"}]
    stated = {"name": "limited", "scene": "rigid-double-pendulum", "parameters": parameters, "channels": channels}
    return Problem.parse({**stated, "source": source, **changes}, "limited")


class Hurried(Deadline):
    """Time for so many calls of the engine that move something."""

    left = 0

    def run(self, kind: object, scene: Any, times: Any, run: Any) -> Any:
        if times[-1] > 0.0:
            if type(self).left <= 0:
                raise TimeIsUp
            type(self).left -= 1
        return run(scene, times)


@pytest.mark.parametrize("calls", [1, 3, 8, 30])
@pytest.mark.parametrize("method", ["auto", "multi-start"])
def test_wherever_time_ends_the_best_so_far_is_the_answer(
    monkeypatch: pytest.MonkeyPatch, calls: int, method: str
) -> None:
    monkeypatch.setattr(import_module("shoal.identification.identify"), "Deadline", Hurried)
    monkeypatch.setattr(Hurried, "left", calls)
    found = identify(problem(), method=method, time_limit=1.0)
    assert np.isfinite(found.fitness)
    assert found.verdict in (Verdict.FAILED, Verdict.IDENTIFIED)
    if found.verdict is Verdict.FAILED:
        assert {"search-stopped", "no-time-to-judge", "not-stationary"} & {*found.codes}, found.message
        assert not any(value.identifiable for value in found.parameters.values()) or calls > 1
    tests = found.residual_tests
    if tests.made:
        assert tests.size**2 * tests.rows == pytest.approx(found.fitness * len(found.measurement.first.times))
    else:
        assert tests.sentences() == []


def test_where_nothing_was_found_the_cost_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("shoal.identification.identify"), "Deadline", Hurried)
    monkeypatch.setattr(Hurried, "left", 0)
    with pytest.raises(InputError, match="time_limit: nothing was found in 1 s"):
        identify(problem(), time_limit=1.0)


class Expiring(Deadline):
    """A limit that is over after so many looks at the clock, wherever they are; the answer gets a few more."""

    looks, grace = 0, 0

    @property
    def remaining(self) -> float:
        if self._end == -np.inf:
            return -np.inf
        type(self).looks -= 1
        return 1e3 if type(self).looks >= 0 else -1.0

    def extend(self) -> None:
        if not self._extended:
            self._extended = True
            type(self).looks = max(type(self).looks, 0) + type(self).grace


def exchanged(folder: Path) -> Problem:
    """A double pendulum whose markers are exchanged in the recording: the longest way to a verdict."""
    scene = load_scene("rigid-double-pendulum")
    times = np.linspace(0.0, 1.0, 60)
    moved = simulate(scene, times)
    noise = np.random.default_rng(0).normal(0.0, 1e-3, (len(times), 4))
    columns = np.column_stack([times, np.column_stack([moved.marker(name) for name in ("B", "A")]) + noise])
    path = folder / "exchanged.csv"
    np.savetxt(path, columns, delimiter=",", header="t,Ax,Ay,Bx,By", comments="")
    channels = [{"marker": m, "quantity": q, "column": f"{m}{q}"} for m in "AB" for q in "xy"]
    return problem(channels=channels, source={"kind": "file", "path": str(path)})


CASES: dict[str, tuple[dict[str, Any], int]] = {
    "auto": ({}, 24),
    "multi-start": ({"method": "multi-start"}, 174),
    "all options": ({"options": Options(profiles=True, bootstrap=5, sample=20)}, 310),
    "held out": ({"hold_out": [(1.5, 2.0)]}, 57),
    "tolerance": ({"tolerance": 1e-3}, 42),
    "exchanged": ({"method": "multi-start"}, 1800),
}
"""What is asked for, and about how often the clock is looked at until the end."""


def ends_clearly(case: str, looks: int, grace: int, folder: Path) -> None:
    """Assert that the time may end at this look: an answer with a status, or one line that names the limit."""
    asked = exchanged(folder) if case == "exchanged" else problem()
    Expiring.looks, Expiring.grace = looks, grace
    try:
        found = identify(asked, time_limit=1.0, **CASES[case][0])
    except InputError as error:
        refused = str(error)
    else:
        refused = ""
    if refused:
        assert refused.startswith("time_limit: nothing was found in 1 s")
        return
    assert np.isfinite(found.fitness)
    if Expiring.looks < 0 and found.verdict is Verdict.FAILED:
        assert "not-simulated" not in found.codes
        assert "stopped after 1 s" in found.message or "time was left" in found.message, found.message
    if found.verdict.trusted:
        assert np.isfinite([[p.lower, p.upper] for p in found.parameters.values()]).all()


@pytest.mark.parametrize("case", [case for case in CASES if case != "exchanged"])
@pytest.mark.by_day(2)
def test_at_whatever_look_the_time_ends_the_answer_has_a_status(
    case: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(import_module("shoal.identification.identify"), "Deadline", Expiring)
    rng = np.random.default_rng(len(case))
    for looks in rng.integers(0, CASES[case][1], 2).tolist():
        ends_clearly(case, looks, int(rng.integers(0, 12)), tmp_path)
    printed = capfd.readouterr()
    assert "Traceback" not in printed.out + printed.err


def test_time_that_ends_while_an_answer_is_written_up_is_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever that is: what needs no further run is the answer."""
    module = import_module("shoal.identification.surroundings")
    combinations = module.combinations

    def late(model: Any, *rest: Any) -> Any:
        if model.deadline.remaining > 0.0:
            raise TimeIsUp
        return combinations(model, *rest)

    monkeypatch.setattr(module, "combinations", late)
    found = identify(problem(), time_limit=1e3)
    assert found.verdict is Verdict.FAILED
    (stopped,) = [one for one in found.findings if one.kind.code == "search-stopped"]
    assert stopped.text == "no time was left to judge the answer"
    assert np.isfinite(found.fitness)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_time_may_end_at_any_look(case: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(import_module("shoal.identification.identify"), "Deadline", Expiring)
    most, rng = CASES[case][1], np.random.default_rng(0)
    for looks in range(0, most, max(most // 30, 1)):
        ends_clearly(case, looks, int(rng.integers(0, 30)), tmp_path)
