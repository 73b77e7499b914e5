"""The limits of a night hold on every processor, and a method that is wrong does not keep them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal_validation.nightly import measure
from shoal_validation.nightly.measure import Measured
from shoal_validation.nightly.methods import RIGID, Method
from shoal_validation.nightly.page import render
from shoal_validation.nightly.plan import plan
from shoal_validation.nightly.result import Night, Verdict
from shoal_validation.nightly.run import judged
from shoal_validation.nightly.theory import MOTIONS
from shoal_validation.problems import get_problem
from shoal_validation.problems.in_space import swing, top
from shoal_validation.problems.one_angle import G

PROBLEMS = ("pendulum", "double-pendulum", "four-bar-2", "parallelogram", "slider-crank", "squeezer")
FIXED = [m for m in RIGID if not (m.by_theory or m.tolerance or m.name.startswith("radau5"))]
(DEFAULT,) = (m for m in RIGID if m.name == "default, verified")


@pytest.fixture(autouse=True)
def _once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody asks for a time here: the first call is the only one."""
    monkeypatch.setattr(measure, "LONG", 0.0)
    monkeypatch.setattr(measure, "ENOUGH", 0.0)


def found(problem: str, method: Method, values: Mapping[str, Any]) -> Measured:
    return measure.attempt(lambda: measure.motion(problem, method.engine, {**method.values, **values}))


def verdict(problem: str, method: Method, values: Mapping[str, Any]) -> Verdict:
    (line,) = (one for one in plan(problem) if (one.engine, one.method) == (method.engine, method.name))
    return judged(line, found(problem, method, values)).verdict


def rounded_otherwise(problem: str, draw: np.random.Generator) -> dict[str, Any]:
    """Gravity, or the torque that drives the squeezer, changed in the last places: as another processor rounds."""
    part = 1.0 + int(draw.integers(1, 9)) * float(np.finfo(float).eps)
    if problem == "squeezer":
        return {"loads.motor.torque": 0.033 * part}
    return {"gravity": [part * one for one in get_problem(problem).scene().gravity]}


Rate = Callable[[float, float], float]
ONE_ANGLE: dict[str, tuple[Rate, float, float]] = {
    "pendulum": (lambda a, w: -G * np.cos(a), 0.0, 0.0),
    "four-bar-2": (lambda a, w: G * 3.5 / 3.0 * np.sin(a), 0.0, 1.0),
    "four-bar-40": (lambda a, w: G * 60.5 / (41 / 3 + 40) * np.sin(a), 0.0, 1.0),
    "parallelogram": (lambda a, w: -4.0 * G * np.cos(a) / (4.0 / 3.0 + 2.0), np.pi / 2, -1.0),
    "slider-crank": (
        lambda a, w: -(G * np.cos(a) + np.sin(2 * a) * w * w) / (2 / 3 + 2 * np.sin(a) ** 2),
        np.pi / 4,
        6.0,
    ),
}


@pytest.mark.parametrize("problem", ONE_ANGLE)
def test_rate_and_growth_follow_from_the_equation_in_one_angle(problem: str) -> None:
    acceleration, *start = ONE_ANGLE[problem]
    times = np.linspace(0.0, get_problem(problem).times[-1], 1001)

    def run(change: tuple[float, float]) -> Any:
        """The motion, and beside it one from a changed start."""
        begin = np.add(start, change)
        known = {"t_eval": times, "rtol": 1e-10, "atol": 1e-10}
        return solve_ivp(lambda _, y: [y[1], acceleration(*y)], (0.0, times[-1]), begin, "DOP853", **known).y

    rate = float(np.max(np.abs(run((0.0, 0.0))[1])))
    size = 1e-4
    growth = [
        np.max(np.abs(run((size * a, size * w))[0] - run((-size * a, -size * w))[0])) / (2 * size)
        for a, w in ((1.0, 0.0), (0.0, rate))
    ]
    assert MOTIONS[problem].rate == pytest.approx(rate, rel=0.01)
    assert MOTIONS[problem].growth == pytest.approx(max(growth), rel=0.02)


def test_rate_and_growth_follow_from_the_equations_of_the_spherical_pendulum() -> None:
    times, start = np.linspace(0.0, get_problem("spherical-pendulum").times[-1], 1001), np.array([np.pi / 3, 0.0, 2.0])
    polar, polar_rate, _ = swing(tuple(start), times)
    rate = float(max(np.max(np.abs(polar_rate)), np.max(np.sin(start[0]) ** 2 * start[2] / np.sin(polar) ** 2)))
    growth = 0.0
    for change in 1e-4 * np.diag([1.0, rate, rate]):
        away = (swing(tuple(start + change), times) - swing(tuple(start - change), times)) / 2e-4
        growth = max(growth, float(np.max(np.abs(away[[0, 2]]))))
    assert MOTIONS["spherical-pendulum"].rate == pytest.approx(rate, rel=0.01)
    assert MOTIONS["spherical-pendulum"].growth == pytest.approx(growth, rel=0.02)


def test_growth_follows_from_the_equations_of_the_heavy_top() -> None:
    """Of the part of its spin that grows most, across its axis; a radian moves it by as much as its axis is long."""
    times, start = get_problem("heavy-top").times, np.array([0.0, 150.0, -4.61538])
    rate, growth = float(np.linalg.norm(start)), 0.0
    for change in 1e-5 * np.eye(3):
        away = (top(start + change, times) - top(start - change, times)) / 2e-5
        growth = max(growth, rate * float(np.max(np.linalg.norm(away, axis=1))))
    assert MOTIONS["heavy-top"].rate == pytest.approx(rate, rel=0.01)
    assert MOTIONS["heavy-top"].growth == pytest.approx(growth, rel=0.02)


@pytest.mark.slow
def test_a_top_that_spins_fast_precesses_as_textbooks_say() -> None:
    """Steadily at m g l / (C s), with a nutation that falls with the square of its spin; 15 kg at 1 m, C = 0.46875."""
    spin, times = 4000.0, np.linspace(0.0, 4.0, 3)
    azimuth = 15.0 * G / (0.46875 * spin) * times
    steady = np.stack([-np.sin(azimuth), np.cos(azimuth), 0.0 * times], axis=1)
    assert top([0.0, spin, 0.0], times) == pytest.approx(steady, abs=2e-3)


def test_the_spherical_pendulum_is_where_elliptic_functions_put_it() -> None:
    """At 1 s, as computed by others."""
    published = [-0.738316659552752, -0.431492043650700, -0.518365823037175]
    assert get_problem("spherical-pendulum").reference.points[9] == pytest.approx(published, abs=1e-11)


def check_processors(problem: str, method: Method, draws: int, agree: float) -> None:
    """Runs that round otherwise end within a third of the limit, and agree in the figure."""
    draw = np.random.default_rng(14)
    errors = [found(problem, method, rounded_otherwise(problem, draw)).error for _ in range(draws)]
    limit = method.limits[problem]
    assert limit is not None
    assert max(errors) < limit / 3
    assert max(errors) < agree * min(errors)


def test_other_roundings_change_where_adaptive_steps_land() -> None:
    """Which the limit from theory allows for; the error itself is another one each time."""
    check_processors("parallelogram", DEFAULT, 6, agree=np.inf)


@pytest.mark.parametrize("name", ["rk4", "leapfrog", "rk4, proximal"])
def test_other_roundings_leave_the_error_of_a_fixed_step(name: str) -> None:
    (method,) = (m for m in FIXED if m.name == name)
    check_processors("parallelogram", method, 3, agree=1.05)


@pytest.mark.slow
@pytest.mark.parametrize("problem", PROBLEMS)
def test_every_limit_holds_whatever_the_rounding(problem: str) -> None:
    """100 draws of the default and of CasADi, 5 of each other method."""
    for method in RIGID:
        if method.tolerance is None and method.limits.get(problem) is not None:
            draws, agree = (100, np.inf) if method.by_theory else (5, 1.05)
            check_processors(problem, method, draws, agree)


def faults(problem: str, method: Method) -> list[dict[str, Any]]:
    """Three times the step; for what is adaptive a tolerance of 1e-6, and a mass that is wrong by 1e-4.

    The mass of the pendulum, a single point, does not show.
    """
    scene = get_problem(problem).scene()
    if method.by_theory:
        name, body = next(iter(scene.bodies.items()))
        wrong = [{f"bodies.{name}.mass": body.mass * (1.0 + 1e-4)}] if problem != "pendulum" else []
        if method.engine == "gauss":
            wrong.append({"solver.relative_tolerance": 1e-6, "solver.absolute_tolerance": 1e-7})
        return wrong
    if problem == "parallelogram" and method.name in ("rk4, augmented-lagrangian", "rk4, proximal"):
        # What a singular position leaves of an iteration does not follow the step.
        return [{"bodies.left.mass": 1.001}]
    return [{"solver.step": 3.0 * scene.solver.step}]


@pytest.mark.parametrize("method", [DEFAULT, *FIXED], ids=lambda method: f"{method.engine}, {method.name}")
@pytest.mark.parametrize(
    "problem",
    ["parallelogram", *(pytest.param(one, marks=pytest.mark.slow) for one in PROBLEMS if one != "parallelogram")],
)
def test_a_limit_can_fail(problem: str, method: Method) -> None:
    if method.limits.get(problem) is None:
        pytest.skip("no answer is expected")
    assert verdict(problem, method, {}) is Verdict.PASSED
    for values in faults(problem, method):
        assert verdict(problem, method, values) is Verdict.FAILED, values


def test_figures_show_the_difference() -> None:
    (line,) = (one for one in plan("parallelogram") if one.method == "default, verified")
    line = replace(line, limit=1.0e-9)
    result = judged(line, Measured("ok", 1.04e-9, 0.1))
    assert result.verdict is Verdict.FAILED
    assert result.expected.startswith("at most 1.00e-09 m from")
    assert result.found.startswith("1.04e-09 m in")
    text = render(Night("2026-01-02T02:00:00", "here", {}, True, None, 1.0, (result,)), [])
    assert "<td>1.04e-09 m</td><td>1.00e-09 m</td>" in text
    assert judged(line, Measured("ok", 2.0e-9, 0.1)).found.startswith("2.0e-09 m in")
    close = judged(line, Measured("ok", float(np.nextafter(1e-9, 1.0)), 0.1))
    assert close.expected.split()[2] != close.found.split()[0]


def test_noise_is_no_loss_of_accuracy() -> None:
    lines = {one.method: one for one in plan("parallelogram") if one.engine == "gauss"}
    assert lines["default, verified"].noise == lines["default, verified"].limit
    assert lines["rk4"].noise == 1e-10
