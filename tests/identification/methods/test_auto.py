"""The method of a user who does not choose: which one it takes, that it says why, and what it costs."""

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import identify, load_problem
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.auto import auto, false_minima
from shoal.identification.methods.growth import growth
from shoal.identification.methods.lanes import descend_many, differentiate_many
from shoal_validation.inverse_precision.cases import rigid_problem
from shoal_validation.inverse_precision.chaos import CHAOTIC, GENTLE, ROUGH, SOLVER, record


def forward(start: tuple[float, float], horizon: float, seed: int = 0) -> ForwardModel:
    problem = rigid_problem()
    data = record(problem, start, horizon, seed=seed)
    return ForwardModel(problem, problem.load_scene(SOLVER), get_engine("gauss"), data)


@pytest.mark.by_day(1)
@pytest.mark.parametrize("name", ["paper-case-1", "paper-case-1-same-mesh"])
def test_a_short_record_costs_no_more_than_least_squares(name: str) -> None:
    estimate = identify(load_problem(name), method="auto")
    same = identify(load_problem(name), method="least-squares")
    assert estimate.evaluations == same.evaluations <= 20
    assert estimate.work == pytest.approx(estimate.evaluations)
    assert estimate.choice.startswith("least-squares: a deviation grows")
    assert {n: v.value for n, v in estimate.parameters.items()} == {n: v.value for n, v in same.parameters.items()}


def test_growth_tells_chaos_from_a_gentle_swing() -> None:
    sizes = []
    for start, horizon in ((GENTLE, 5.0), (CHAOTIC, 10.0)):
        model = forward(start, horizon)
        sizes.append(growth(model, differentiate_many(model, np.array([start]))[1][0]))
    assert sizes[0] < 10
    assert sizes[1] > 1e4


def test_a_chaotic_record_is_fitted_progressively_and_that_is_said() -> None:
    model = forward(CHAOTIC, 6.0)
    outcome = auto(model, np.random.default_rng(0), lambda *_: None)
    assert outcome.point == pytest.approx(np.array(CHAOTIC), abs=1e-3)
    assert outcome.choice.startswith("progressive: a deviation grows")
    assert "over 6 s" in outcome.choice


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_ten_chaotic_seconds_of_ten_draws(seed: int) -> None:
    model = forward(CHAOTIC, 10.0, seed)
    outcome = auto(model, np.random.default_rng(0), lambda *_: None)
    assert outcome.point == pytest.approx(np.array(CHAOTIC), abs=1e-3)
    assert model.work <= 150


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_false_minima_near_by_are_listed_and_not_returned(seed: int) -> None:
    model = forward(ROUGH, 5.0, seed)
    outcome = auto(model, np.random.default_rng(0), lambda *_: None)
    assert outcome.point == pytest.approx(np.array(ROUGH), abs=1e-3)
    listed = [point for point, fitness in outcome.minima if fitness > 100 * outcome.fitness]
    near = [point for point in listed if 0.01 < np.max(np.abs(point - ROUGH)) < 0.3]
    assert near
    # They are minima: a descent from a little beside them comes back.
    back = descend_many(model, near[0][None] + 1e-5)[0]
    assert back.point == pytest.approx(near[0], abs=1e-4)


def test_where_there_is_one_minimum_none_is_listed() -> None:
    model = forward(GENTLE, 5.0)
    assert false_minima(model, np.array(GENTLE)) == []


@pytest.mark.slow
def test_a_wrong_model_makes_it_try_the_others_and_name_them() -> None:
    model = forward(GENTLE, 3.0)
    wrong = ForwardModel(model.problem, model.scene.with_values({"gravity.1": -5.0}), model.engine, model.measurement)
    outcome = auto(wrong, np.random.default_rng(0), lambda *_: None)
    steps = [step.partition(":")[0] for step in outcome.choice.split("; then ")]
    assert steps[:3] == ["least-squares", "progressive", "multiple-shooting"]
    assert wrong.counter.best_value == pytest.approx(outcome.fitness, rel=1e-6)
