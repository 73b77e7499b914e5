"""Verdicts on wrong models: data of other engines and of scipy, none of which may be called identified."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Estimate, Measurement, Problem, Verdict, identify, load_problem, measure
from shoal.identification.conclude import conclude
from shoal.identification.diagnostics.judgement import Judgement, judge
from shoal.identification.findings import BETTER_MINIMUM
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome
from shoal.identification.methods.lanes import descend_each, differentiate_many
from shoal.identification.methods.least_squares import descend
from shoal_validation.coverage.cases import NOISE, tip
from shoal_validation.coverage.cases import noise as correlated

RECORDINGS = Path(__file__).parents[4] / "shared" / "data" / "multiarm_kaheman"
ANGLE = {"lower": -np.pi, "upper": np.pi}
TRUTH = {"theta1": np.pi / 4, "theta2": np.pi / 6}


def problem(noise: float | None, markers: tuple[str, ...] = ("B",), source: dict[str, Any] | None = None) -> Problem:
    data = {
        "name": "double-pendulum",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "theta1": {"path": "initial.OA.angle", **ANGLE},
            "theta2": {"path": "initial.AB.angle", **ANGLE},
        },
        "channels": [{"marker": m, "quantity": q, "column": m + q} for m in markers for q in ("x", "y")],
        "noise": noise,
        "source": source or {"kind": "file"},
    }
    return Problem.parse(data, "double-pendulum")


def textbook(problem: Problem, clock: float = 1.0, **machine: float) -> Measurement:
    """Tip by Lagrange's equations with 1 mm of noise, recorded by a clock that is off by a factor."""
    times = np.arange(1, 151) / 100
    points = tip(times / clock, **TRUTH, **machine)
    points = points + 1e-3 * np.random.default_rng(4).standard_normal(points.shape)
    return Measurement.single(times, tuple(problem.channels), points, "scipy DOP853", TRUTH, problem.noise)


def fit(noise: float | None, values: dict[str, Any] | None = None, **data: float) -> Estimate:
    stated = problem(noise)
    return identify(stated, method="least-squares", measurement=textbook(stated, **data), values=values)


@pytest.mark.parametrize("noise", [1e-3, None])
def test_the_right_model_is_identified(noise: float | None) -> None:
    """Nothing below would mean anything if this were rejected too."""
    estimate = fit(noise)
    assert estimate.verdict is Verdict.IDENTIFIED
    assert not estimate.residual_tests.systematic
    assert estimate.residual_tests.white
    for name, true in TRUTH.items():
        assert estimate.parameters[name].lower <= true <= estimate.parameters[name].upper


@pytest.mark.by_day(1)
@pytest.mark.parametrize("noise", [1e-3, pytest.param(None, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("values", "data"),
    [
        ({"bodies.AB.length": 1.8}, {}),
        pytest.param({"gravity.1": -8.0}, {}, marks=pytest.mark.slow),
        pytest.param({}, {"friction": 3.0}, marks=pytest.mark.slow),
        ({}, {"clock": 1.26}),
    ],
    ids=["length", "gravity", "friction", "clock"],
)
def test_wrong_models_are_not_answers(noise: float | None, values: dict[str, Any], data: dict[str, float]) -> None:
    estimate = fit(noise, values, **data)
    assert estimate.verdict is Verdict.REJECTED, estimate.message
    assert estimate.advice


def test_a_small_fault_is_seen_against_a_stated_noise() -> None:
    """A residual of twice the stated noise that is not white; the cause is named."""
    estimate = fit(1e-3, friction=0.03)
    assert 1.2 < estimate.residual_tests.ratio < 5.0
    assert estimate.verdict is Verdict.REJECTED
    assert estimate.suspects[0].name == "friction of O"
    assert not estimate.residual_tests.white


def recorded(stated: Problem, more: np.ndarray) -> Measurement:
    """The right machine with something added to what is seen of its tip, (150, 2)."""
    times = np.arange(1, 151) / 100
    points = tip(times, **TRUTH) + more
    return Measurement.single(times, tuple(stated.channels), points, "scipy DOP853", TRUTH, stated.noise)


def judged(noise: float | None, more: np.ndarray) -> Estimate:
    stated = problem(noise)
    return identify(stated, method="least-squares", measurement=recorded(stated, more))


@pytest.mark.slow
def test_a_noise_that_was_stated_too_small_is_told_and_no_wrong_model() -> None:
    draws = np.random.default_rng(5).standard_normal((150, 2))
    estimate = judged(1e-3, 1.3e-3 * draws)
    assert estimate.verdict is Verdict.IDENTIFIED
    assert "noise-understated" in estimate.codes
    assert judged(1e-3, 4e-3 * draws).verdict is Verdict.REJECTED


@pytest.mark.slow
@pytest.mark.parametrize("noise", [None, 3e-3])
def test_correlated_noise_and_digits_are_no_wrong_model(noise: float | None) -> None:
    """AR(1) with a memory of ten samples, as large as stated, on positions rounded to six digits."""
    for seed in range(1 if noise else 4):
        estimate = judged(noise, np.round(3e-3 / NOISE * correlated(150, 0.9, seed), 6))
        assert estimate.verdict is Verdict.IDENTIFIED, estimate.message
        assert all(estimate.parameters[n].lower <= x <= estimate.parameters[n].upper for n, x in TRUTH.items())


def test_steps_of_the_digits_alone_are_no_wrong_model() -> None:
    exact = tip(np.arange(1, 151) / 100, **TRUTH)
    for digits in (3, 6, 15):
        assert judged(None, np.round(exact, digits) - exact).verdict is Verdict.IDENTIFIED


@pytest.mark.slow
def test_what_explains_no_more_than_a_constant_is_rejected() -> None:
    stated = problem(None)
    measurement = recorded(stated, np.zeros((150, 2)))
    run = replace(measurement.first, values=0.3 * np.random.default_rng(2).standard_normal((150, 2)))
    estimate = identify(stated, method="least-squares", measurement=replace(measurement, recordings={"r": run}))
    assert not estimate.verdict.trusted


def test_an_end_that_has_not_converged_is_no_answer() -> None:
    model = model_of(problem(1e-3))
    end = descend(model, np.array(list(TRUTH.values())), lambda *_: None)
    outcome = Outcome(end.point, end.fitness, [], "no convergence after 60 iterations", converged=False)
    assert concluded(model, outcome).verdict is Verdict.FAILED


def test_a_better_minimum_that_was_met_is_descended_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fits for suspects leave off early: where one is better, its end is the answer, and not where it left off."""
    model = model_of(problem(1e-3))
    (met,) = descend_each(
        [model], [np.array([0.5, 0.9])], lambda _, at: differentiate_many(model, np.array(at)), most=3
    )
    asked: list[int] = []

    def judged(*of: Any) -> Judgement:
        asked.append(1)
        return judge(*of) if len(asked) > 1 else Judgement([BETTER_MINIMUM.found("")], better=met)

    assert not met.converged
    monkeypatch.setattr("shoal.identification.conclude.judge", judged)
    estimate = concluded(model, Outcome(np.array([-0.5, 2.2]), 1.0, [], ""))
    assert estimate.verdict is Verdict.IDENTIFIED, estimate.message
    assert all(known.lower <= TRUTH[name] <= known.upper for name, known in estimate.parameters.items())


@pytest.mark.slow
def test_a_rigid_model_of_a_flexible_machine_is_rejected() -> None:
    """Data: Exudyn's beams."""
    values = {"bodies.OA.element": "rigid", "bodies.AB.element": "rigid", "solver.integrator": "rk4"}
    estimate = identify(load_problem("paper-case-1"), method="least-squares", values=values)
    assert estimate.verdict is Verdict.REJECTED


@pytest.mark.slow
def test_exchanged_markers_are_rejected() -> None:
    """Data: Exudyn, with the columns of A and B exchanged in the whole recording."""
    source = {"kind": "engine", "engine": "exudyn", "stop": 1.0, "count": 100, "noise": 1e-3}
    stated = problem(None, ("A", "B"), source)
    measurement = measure(stated, stated.load_scene())
    run = measurement.first
    wrong = replace(measurement, recordings={"recording": replace(run, values=run.values[:, [2, 3, 0, 1]])})
    assert identify(stated, method="least-squares", measurement=measurement).verdict is Verdict.IDENTIFIED
    estimate = identify(stated, method="least-squares", measurement=wrong)
    assert estimate.verdict is Verdict.REJECTED
    assert estimate.suspects[0].name == "columns of A and B"


def concluded(model: ForwardModel, outcome: Outcome) -> Estimate:
    return conclude(model, outcome, "test", 0)


def model_of(stated: Problem) -> ForwardModel:
    return ForwardModel(stated, stated.load_scene(), get_engine("gauss"), textbook(stated))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-3, None])
def test_a_false_minimum_is_left(noise: float | None) -> None:
    """A descent from far away ends where the motion is another one; a refit for a suspect finds the way out."""
    model = model_of(problem(noise))
    end = descend(model, np.array([-0.5, 2.2]), lambda *_: None)
    assert np.max(np.abs(end.point - list(TRUTH.values()))) > 0.1
    estimate = concluded(model, Outcome(end.point, end.fitness, [], ""))
    assert estimate.verdict is Verdict.IDENTIFIED
    assert all(known.lower <= TRUTH[name] <= known.upper for name, known in estimate.parameters.items())
    assert "from a refit" in estimate.choice


def test_a_search_that_has_not_ended_has_failed() -> None:
    model = model_of(problem(1e-3))
    point = np.array(list(TRUTH.values()))
    outcome = Outcome(point, float(model.fitness(point[None])[0]), [], "stopped after 1 s", ended=False)
    estimate = concluded(model, outcome)
    assert estimate.verdict is Verdict.FAILED
    assert (estimate.codes, estimate.message) == (["search-stopped"], "stopped after 1 s")


def test_equal_minima_are_ambiguous_and_whole_turns_are_not() -> None:
    model = model_of(problem(1e-3))
    end = descend(model, np.array(list(TRUTH.values())), lambda *_: None)
    turned, mirrored = end.point + np.array([2 * np.pi, 0.0]), end.point[::-1]
    for other, verdict in ((turned, Verdict.IDENTIFIED), (mirrored, Verdict.AMBIGUOUS)):
        estimate = concluded(model, Outcome(end.point, end.fitness, [], "", [(other, 1.001 * end.fitness)]))
        assert estimate.verdict is verdict
    assert "mirror images" in estimate.message
    clearly_worse = Outcome(end.point, end.fitness, [], "", [(mirrored, 1.4 * end.fitness)])
    assert concluded(model, clearly_worse).verdict is Verdict.IDENTIFIED


@pytest.mark.slow
@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the recordings are not here")
def test_a_real_machine_is_not_rejected_for_a_small_systematic_residual() -> None:
    estimate = identify(
        load_problem("kaheman-double"), method="least-squares", data=str(RECORDINGS / "double_1kHz.csv.gz")
    )
    assert estimate.verdict is Verdict.COMBINATION
    assert estimate.residual_tests.systematic
    assert not estimate.residual_tests.white
    assert "systematic-residual" in estimate.codes
