"""Long and chaotic records: single shooting over growing horizons finds what one over the whole record does not."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, identify, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import least_squares
from shoal.identification.methods.progressive import first_horizon, fit, progressive
from shoal_validation.inverse_precision.cases import rigid_problem
from shoal_validation.inverse_precision.chaos import CHAOTIC, SOLVER, record, with_friction


def forward(problem: Problem, data: Measurement) -> ForwardModel:
    return ForwardModel(problem, problem.load_scene(SOLVER), get_engine("gauss"), data)


def silent(*_: float) -> None:
    return None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_chaotic_motion_of_ten_seconds_is_found_from_its_tip(seed: int) -> None:
    problem = rigid_problem()
    data = record(problem, CHAOTIC, 10.0, seed=seed)
    estimate = identify(problem, method="progressive", measurement=data, values=SOLVER)
    for name, true in estimate.truth.items():
        assert estimate.parameters[name].value == pytest.approx(true, abs=1e-3)
    # The record allows no more: both evaluations and work are of the whole search.
    assert estimate.work < 100
    assert estimate.evaluations > estimate.work


@pytest.mark.slow
def test_a_single_shot_over_the_same_record_fails() -> None:
    """Protects the test above: the record is as hard as it says."""
    problem = rigid_problem()
    model = forward(problem, record(problem, CHAOTIC, 10.0))
    shot = least_squares(model, np.random.default_rng(0), silent)
    assert shot.fitness > 0.1 * model.rows.signal**2


def test_work_counts_the_simulated_time_of_every_run(watched: Callable[..., Any]) -> None:
    problem = rigid_problem()
    model = forward(problem, record(problem, CHAOTIC, 3.0))
    engine = watched(model)
    progressive(model, np.random.default_rng(0), silent)
    assert len(engine.ends) == model.counter.evaluations
    assert sum(engine.ends) / 3.0 == pytest.approx(model.work)


def test_the_first_horizon_has_numbers_enough() -> None:
    problem = rigid_problem()
    few = record(problem, CHAOTIC, 10.0, rate=2.0)
    assert first_horizon(forward(problem, few)) == pytest.approx(1.5)
    assert first_horizon(forward(problem, record(problem, CHAOTIC, 10.0))) == pytest.approx(0.5)


def test_what_a_short_horizon_does_not_tell_stays_near_its_start() -> None:
    """Friction hardly shows in half a second; without trust it runs to a bound."""
    problem = with_friction()
    model = forward(problem, measure(problem, problem.load_scene()))
    start = np.array([*CHAOTIC, 0.5])
    part = model.until(0.1)
    assert 0.1 < fit(part, start).point[2] < 0.9


@pytest.mark.slow
def test_friction_is_found_with_the_angles() -> None:
    problem = with_friction()
    estimate = identify(problem, method="progressive", values=SOLVER)
    assert estimate.parameters["friction"].value == pytest.approx(0.2, abs=1e-3)
    assert estimate.parameters["theta1"].value == pytest.approx(CHAOTIC[0], abs=1e-3)


def test_failed_simulations_cost_infinity_and_stop_nothing(watched: Callable[..., Any]) -> None:
    problem = rigid_problem()
    model = forward(problem, record(problem, CHAOTIC, 1.0))
    watched(model, fails=lambda values: np.ones(1, dtype=bool))
    outcome = progressive(model, np.random.default_rng(0), silent)
    assert outcome.fitness == np.inf
    assert model.counter.failures > 0


def test_a_start_that_cannot_be_simulated_is_left_for_one_that_can(watched: Callable[..., Any]) -> None:
    """The other elbow branch is infinite wherever it is looked at; the right one is found none the less."""
    problem = rigid_problem()
    model = forward(problem, record(problem, CHAOTIC, 1.0))
    first = problem.parameters[model.names[0]].path
    engine = watched(model, fails=lambda values: values[first] > CHAOTIC[0] + 0.2)
    outcome = progressive(model, np.random.default_rng(0), silent)
    assert outcome.point == pytest.approx(np.array(CHAOTIC), abs=1e-3)
    assert engine.failures > 0
