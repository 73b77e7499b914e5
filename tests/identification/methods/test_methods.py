"""What every method promises: repeatable by its seed, inside the box, counted, and no run stopped by a failure."""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.identification import METHODS, Measurement, Problem, load_problem, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods import Outcome, get_method
from shoal_validation.inverse_precision.cases import PLAIN, rigid_problem, textbook

SWARMS = ["afsa", "iafsa", "iafsa-unseeded", "iafsa-printed"]
GLOBAL = ["multi-start", "hybrid", "differential-evolution", "cma-es"]
SHOOTING = {"casadi", "casadi-multiple"}


def marked(names: Iterable[str]) -> list[object]:
    return [pytest.param(name, marks=pytest.mark.slow) if name in ("afsa", "iafsa-printed") else name for name in names]


@cache
def data(horizon: float) -> Measurement:
    return textbook(rigid_problem(), horizon)


def made(horizon: float = 0.5, problem: Problem | None = None) -> ForwardModel:
    """The rigid double pendulum, all angles allowed; data by scipy from Lagrange's equations."""
    problem = problem or rigid_problem()
    return ForwardModel(problem, problem.load_scene(PLAIN), get_engine("gauss"), data(horizon))


def solve(name: str, model: ForwardModel, seed: int = 1) -> Outcome:
    return get_method(name)(model, np.random.default_rng(seed), lambda *_: None)


def error(model: ForwardModel, outcome: Outcome) -> float:
    return max(abs(x - model.measurement.truth[name]) for name, x in zip(model.names, outcome.point, strict=True))


@pytest.mark.parametrize("name", marked(METHODS))
@pytest.mark.by_day(2)
def test_a_method_is_repeatable_counted_and_right(name: str) -> None:
    """The global random state must not matter, and the best point is one that was evaluated."""
    np.random.seed(0)  # noqa: NPY002 - to show that it is not used
    model, again = made(), made()
    one = solve(name, model)
    np.random.seed(1)  # noqa: NPY002
    other = solve(name, again)
    assert np.array_equal(one.point, other.point)
    assert one.fitness == other.fitness
    assert model.counter.evaluations == again.counter.evaluations
    assert np.all((one.point >= model.lower) & (one.point <= model.upper))
    assert one.fitness == pytest.approx(model.counter.best_value, rel=1e-6)
    assert np.all(np.diff([row[1] for row in one.iterations]) <= 0)
    assert error(model, one) < (0.1 if name == "afsa" else 1e-3)


@pytest.mark.parametrize("name", marked(name for name in METHODS if name not in SHOOTING))
@pytest.mark.by_day(2)
def test_failed_simulations_stop_no_method(name: str, watched: Callable[..., Any]) -> None:
    """A third of the box cannot be simulated; the search goes on around it."""
    model = made()
    first = model.problem.parameters[model.names[0]].path
    watched(model, fails=lambda values: np.abs(values[first] + 1.5) < 1.0)
    outcome = solve(name, model)
    assert error(model, outcome) < (0.1 if name == "afsa" else 1e-3)
    if name in (*GLOBAL, *SWARMS):
        assert model.counter.failures > 0


@pytest.mark.parametrize("name", marked(GLOBAL))
@pytest.mark.by_day(2)
def test_one_parameter_is_enough(name: str) -> None:
    problem = rigid_problem()
    only = {"theta2": problem.parameters["theta2"]}
    model = made(problem=problem.model_copy(update={"parameters": only}))
    assert error(model, solve(name, model)) < 1e-3


def test_multi_start_draws_the_waterfall() -> None:
    """Over 2 s the box has more than one minimum: they come sorted, apart, and really are minima."""
    model = made(2.0)
    outcome = solve("multi-start", model)
    assert error(model, outcome) < 1e-3
    values = [outcome.fitness, *(fitness for _, fitness in outcome.minima)]
    assert len(values) > 2
    assert values == sorted(values)
    points = np.array([outcome.point, *(point for point, _ in outcome.minima)])
    gaps = np.abs(points[:, None] - points[None]).max(axis=2) / (model.upper - model.lower).max()
    assert gaps[~np.eye(len(points), dtype=bool)].min() > 1e-3
    around = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 8, endpoint=False)])
    for point, fitness in outcome.minima[:2]:
        assert np.all(model.fitness(np.clip(point + 0.01 * around, model.lower, model.upper)) > fitness)


@pytest.mark.slow
def test_multiple_shooting_holds_where_single_shooting_is_lost() -> None:
    """Over 5 s from a start that is off by a tenth of a radian; data by scipy, model by CasADi's own equations."""
    pytest.importorskip("casadi")
    from shoal.engines.casadi.multiple_shooting import identify_by_segments
    from shoal.engines.casadi.shooting import identify_initial_angles

    model = made(5.0)
    scene = model.scene.with_values({"solver.step": 2e-3})
    truth = np.array([model.measurement.truth[name] for name in model.names])
    record = model.measurement.first
    paths = ["initial.OA.angle", "initial.AB.angle"]
    arguments = (scene, paths, truth + 0.1, model.lower, model.upper, record.times, "B", record.values)
    single, multiple = identify_initial_angles(*arguments), identify_by_segments(*arguments, segments=20)
    assert multiple.values == pytest.approx(truth, abs=1e-6)
    assert multiple.evaluations < single.evaluations
    assert np.max(np.abs(single.values - truth)) > 0.1


def test_multiple_shooting_refuses_what_would_take_minutes() -> None:
    pytest.importorskip("casadi")
    problem = load_problem("paper-case-1-same-mesh")
    model = ForwardModel(problem, problem.load_scene(), get_engine("gauss"), measure(problem, problem.load_scene()))
    with pytest.raises(InputError, match="56; use casadi"):
        solve("casadi-multiple", model)
