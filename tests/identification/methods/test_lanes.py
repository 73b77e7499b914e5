"""Descents side by side: each is as good as one alone, they leave when they should, and bounds hold."""

from functools import cache

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.identification import Measurement
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import descend_many, differentiate_many, history
from shoal.identification.methods.least_squares import descend
from shoal_validation.inverse_precision.cases import PLAIN, rigid_problem, textbook


@cache
def data(horizon: float) -> Measurement:
    return textbook(rigid_problem(), horizon)


def made(horizon: float = 1.0, integrator: str = "dop853", **changes: object) -> ForwardModel:
    """The rigid double pendulum; data by scipy from Lagrange's equations."""
    problem = rigid_problem()
    names = problem.parameters
    bounded = {name: parameter.model_copy(update=changes) for name, parameter in names.items()}
    problem = problem.model_copy(update={"parameters": bounded})
    return ForwardModel(
        problem, problem.load_scene({**PLAIN, "solver.integrator": integrator}), get_engine("gauss"), data(horizon)
    )


def truth(model: ForwardModel) -> np.ndarray:
    return np.array([model.measurement.truth[name] for name in model.names])


def test_side_by_side_is_as_good_as_one_after_the_other() -> None:
    """The batch changes where points are simulated, not which ones: the answers are those of lone descents."""
    model = made()
    starts = truth(model) + np.array([[0.1, 0.1], [-0.2, 0.1], [0.3, -0.3]])
    together = descend_many(model, starts)
    for start, found in zip(starts, together, strict=True):
        alone = descend(model, start, lambda *_: None)
        if found.converged:
            assert found.point == pytest.approx(alone.point, abs=1e-6)
    assert sum(found.converged for found in together) >= 1
    assert min(together, key=lambda d: d.fitness).point == pytest.approx(truth(model), abs=1e-3)


def test_an_iteration_is_one_call_of_the_model() -> None:
    model = made(integrator="rk4")
    calls: list[int] = []
    inner = model.counter

    def counted(points: np.ndarray) -> np.ndarray:
        calls.append(len(points))
        return inner(points)

    model.residuals = counted  # type: ignore[method-assign]
    starts = truth(model) + np.array([[0.1, 0.1], [1.0, -1.5], [-1.5, 1.0]])
    found = descend_many(model, starts)
    assert calls[0] == 9
    assert len(calls) == max(len(descent.rows) for descent in found)
    assert sum(calls) == model.counter.evaluations == 3 * sum(len(descent.rows) for descent in found)


@pytest.mark.parametrize("count", [2, 6, 11])
def test_a_derivative_does_not_depend_on_who_else_is_simulated(count: int) -> None:
    """Lanes of a tile share the steps of an adaptive integrator; one split from its neighbours has no derivative."""
    model = made(5.0)
    points = np.random.default_rng(0).uniform(model.lower, model.upper, (count, 2))
    points[-1] = truth(model) + 0.05
    alone, crowded = differentiate_many(model, points[-1:])[1][0], differentiate_many(model, points)[1][-1]
    assert crowded == pytest.approx(alone, abs=2e-3 * float(np.abs(alone).max()))


def test_a_start_beside_another_leaves() -> None:
    """Two descents in one place would cost twice and find nothing more."""
    model = made()
    near = truth(model) + 0.1
    first, second = descend_many(model, np.array([near, near + 1e-7]))
    assert first.converged != second.converged
    assert min(len(first.rows), len(second.rows)) == 1


def test_a_hopeless_rival_is_given_up() -> None:
    model = made(2.0)
    starts = truth(model) + np.array([[0.05, 0.05], [2.5, -2.5]])
    patient, impatient = descend_many(model, starts), descend_many(model, starts, patience=100.0)
    assert len(impatient[1].rows) == 3 < len(patient[1].rows)
    assert not impatient[1].converged
    assert impatient[0].point == pytest.approx(patient[0].point, abs=1e-5)


def test_a_bound_that_keeps_the_answer_out_is_reached() -> None:
    """The other parameter still finds its best place beside the bound: nothing is lost by clipping the step."""
    free = made(0.5)
    low = float(truth(free)[0]) + 0.2
    model = made(0.5, lower=low)
    descent = descend(model, np.array([low + 0.5, low + 0.5]), lambda *_: None)
    assert descent.converged
    assert descent.point[0] == low
    others = np.column_stack([np.full(41, low), descent.point[1] + np.linspace(-0.02, 0.02, 41)])
    allowed = others[others[:, 1] >= low]
    assert model.cost(model.residuals(allowed)).min() >= descent.fitness * (1 - 1e-6)


def test_a_start_that_cannot_be_simulated_stops_nobody() -> None:
    model = made()
    inner = model.counter
    bad = truth(model) + 1.0

    def failing(points: np.ndarray) -> np.ndarray:
        found = inner(points).copy()
        found[np.linalg.norm(points - bad, axis=1) < 1e-2] = np.inf
        return found

    model.residuals = failing  # type: ignore[method-assign]
    failed, good = descend_many(model, np.array([bad, truth(model) + 0.1]))
    assert not failed.converged
    assert failed.fitness == np.inf
    assert good.converged
    assert np.isfinite(history([failed, good])[-1][1])


def test_differences_stay_inside_the_box() -> None:
    model = made()
    asked: list[np.ndarray] = []
    inner = model.counter

    def noted(points: np.ndarray) -> np.ndarray:
        asked.append(points)
        return inner(points)

    model.residuals = noted  # type: ignore[method-assign]
    residuals, jacobians = differentiate_many(model, np.array([model.upper, model.lower]))
    assert np.all((asked[0] <= model.upper) & (asked[0] >= model.lower))
    assert jacobians.shape == (2, residuals.shape[1], 2)
