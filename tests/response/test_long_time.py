"""Bounds after many cycles, against motions in closed form."""

from __future__ import annotations

import math

import numpy as np
import one_body
import pytest
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal_validation.uncertain.problems import Motion, Problem, pendulum, rod, two

PENDULUM = one_body.pendulum(
    gravity=[0.0, -9.81 / 0.98],
    initial={"OA": {"angle": 1.0 - np.pi / 2}},
    solver={"duration": 1000.0, "samples": 10, "integrator": "dop853", "relative_tolerance": 1e-13},
)
"""Swings as one of length 0.98 (1 + inertia) m."""
FINE = {1: 400_001, 2: 1001}
"""Places along each axis of the box, at which its bounds are looked for."""


def three(u: Array, times: Array) -> Array:
    """More frequencies than a torus has."""
    return np.asarray(two(u, times) + 0.5 * np.sin(np.cos(4.711 * (1 + 0.01 * u[:, 0]) * times) + 1))


def asked(motion: Motion, parameters: int, times: Array, method: str = "auto", **options: float) -> ModelResponse:
    problem, count = Problem("motion", parameters, tuple(times), motion), len(times)
    one, at = np.zeros(count, dtype=int), problem.at
    return respond(at(times), problem.inputs, count, method=method, groups=one, instants=times, over_time=at, **options)


def exact(motion: Motion, parameters: int, times: Array) -> tuple[Array, Array]:
    """Bounds by a grid, which lie inside the true ones by its width squared."""
    return Problem("motion", parameters, tuple(times), motion).reference(FINE)


@pytest.mark.parametrize("method", ["auto", "time-warp", "torus"])
@pytest.mark.by_day(1)
def test_a_pendulum_for_a_thousand_seconds(method: str) -> None:
    """Within 1e-7 rad with nine runs, where polynomials at single instants need hundreds."""
    times = np.array([10.0, 100.0, 500.0, 999.0, 1000.0])
    answer = asked(pendulum, 1, times, method)
    lower, upper = exact(pendulum, 1, times)
    assert answer.bounds is not None
    within = 1e-7 if method != "torus" else 1e-6
    for found, true in (
        (answer.bounds.lower, lower),
        (answer.bounds.lower_outer, lower),
        (answer.bounds.upper, upper),
        (answer.bounds.upper_outer, upper),
    ):
        assert np.abs(found - true).max() < within
    assert np.all(answer.bounds.lower_outer <= lower)
    assert np.all(answer.bounds.upper_outer >= upper)
    assert answer.runs.own <= 9
    assert method != "auto" or "time warp" in answer.found.why


@pytest.mark.slow
@pytest.mark.parametrize(
    ("motion", "end", "within", "runs", "how"),
    [
        (rod, 200.0, 1e-6, 40, "time warp"),
        pytest.param(two, 100.0, 1e-6, 25, "torus", marks=pytest.mark.slow),
    ],
)
def test_two_parameters(motion: Motion, end: float, within: float, runs: int, how: str) -> None:
    times = np.array([0.4 * end, end])
    answer = asked(motion, 2, times)
    lower, upper = exact(motion, 2, times)
    assert answer.bounds is not None
    assert how in answer.found.why
    assert answer.runs.own <= runs
    assert answer.bounds.gap <= within
    grid = 2e-4
    assert np.all(answer.bounds.lower_outer <= lower)
    assert np.all(answer.bounds.upper_outer >= upper)
    assert np.all(answer.bounds.lower >= lower - grid)
    assert np.all(answer.bounds.upper <= upper + grid)


def test_named_runs_attain_the_bounds() -> None:
    """To within the error that is told, at instants that no run was made for."""
    times = np.linspace(0, 300.0, 6)[1:]
    answer = asked(pendulum, 1, times)
    assert answer.bounds is not None
    for at, bound, outer, sign in (
        (answer.bounds.at_lower, answer.bounds.lower, answer.bounds.lower_outer, 1),
        (answer.bounds.at_upper, answer.bounds.upper, answer.bounds.upper_outer, -1),
    ):
        run = np.array([pendulum(u[None, :, None], np.array([t]))[0, 0] for u, t in zip(at, times, strict=True)])
        assert np.all(sign * (run - bound) <= 1e-12)
        assert np.all(sign * (run - outer) >= -1e-12)


@pytest.mark.slow
def test_what_no_method_of_cycles_suits_is_refused() -> None:
    """By name; `auto` goes on without them, and says what it found."""
    times = np.array([60.0])
    for method in ("time-warp", "torus"):
        with pytest.raises(InputError, match=f"method: {method}"):
            asked(three, 1, times, method)
    answer = asked(three, 1, times)
    assert answer.bounds is not None
    lower, upper = exact(three, 1, times)
    assert np.all(answer.bounds.lower_outer <= lower)
    assert np.all(answer.bounds.upper_outer >= upper)
    assert "torus" not in answer.found.why.split("(")[0]


def test_methods_of_cycles_need_a_course() -> None:
    model = Answers(np.zeros((1, 1)), np.ones(1, dtype=bool))
    known = Inputs((UncertainParameter("u", Interval(0.0, 1.0), {"u": 1.0}),))
    with pytest.raises(InputError, match="at its instants only"):
        respond(lambda _: model, known, 1, method="torus")


@pytest.mark.slow
def test_a_machine_for_a_thousand_seconds() -> None:
    """The pendulum of the engine, with an inertia that makes it 0.98 to 1.02 m long."""
    scene = Scene.parse(PENDULUM)
    times = np.array([500.0, 1000.0])
    found = uncertain(scene, {"bodies.OA.inertia": (0.0, 1.02 / 0.98 - 1)}, times, verify=False)
    assert found.ok
    assert found.bounds is not None
    lower, upper = exact(pendulum, 1, times)
    angles = [found.column("A", "angle", of) + math.pi / 2 for of in (found.bounds.lower, found.bounds.upper)]
    assert np.abs(angles[0] - lower).max() < 1e-7
    assert np.abs(angles[1] - upper).max() < 1e-7
    # Each bound is attained by a run of its own.
    assert found.evaluations - found.controls <= 9 + 2 * len(times)
