"""A limit holds through all stages: what would take longer than is left is not begun, and the best so far is told."""

from __future__ import annotations

import time
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.identification import Problem, Verdict, identify
from shoal.identification.deadline import Deadline, TimeIsUp, unless_late
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
        assert "stopped after 1 s" in found.message or "no time was left" in found.message
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
