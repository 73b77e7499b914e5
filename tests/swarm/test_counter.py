"""The audit counts exactly and its log agrees with what was evaluated."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoal.swarm import OPTIMIZERS, BudgetExhausted, EvaluationCounter, Iafsa, minimize

batches = st.lists(st.lists(st.floats(width=32), max_size=6), max_size=8)


def first(x: np.ndarray) -> np.ndarray:
    return x[:, 0]


@given(batches=batches)
def test_log_is_the_running_minimum(batches: list[list[float]]) -> None:
    counter = EvaluationCounter(first)
    for batch in batches:
        counter(np.array(batch).reshape(-1, 1))
    values = np.array([value if np.isfinite(value) else np.inf for batch in batches for value in batch])
    running = np.minimum.accumulate(values)
    assert counter.evaluations == values.size
    assert counter.failures == np.isinf(values).sum()
    evaluations, best = counter.history
    for number, value in zip(evaluations.astype(int), best, strict=True):
        assert running[number - 1] == value
    if values.size and np.isfinite(values).any():
        assert counter.best_value == running[-1] == best[-1] == counter.best[0]
        assert evaluations[-1] == values.size
        assert evaluations[0] == np.argmax(np.isfinite(values)) + 1
    else:
        assert counter.best_value == np.inf
        assert evaluations.size == 0


@pytest.mark.parametrize("name", OPTIMIZERS)
def test_counts_what_the_optimiser_asks_for(name: str) -> None:
    calls = 0

    def counted(x: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += len(x)
        return (x**2).sum(axis=1)

    counter = EvaluationCounter(counted)
    minimize(
        OPTIMIZERS[name](lower=-np.ones(2), upper=np.ones(2)), counter, rng=np.random.default_rng(0), iterations=10
    )
    assert counter.evaluations == calls
    if name != "afsa":
        assert calls == 40 * 11


def test_budget_is_never_exceeded() -> None:
    counter = EvaluationCounter(first, budget=5)
    counter(np.zeros((4, 1)))
    with pytest.raises(BudgetExhausted, match="4 of 5"):
        counter(np.zeros((2, 1)))
    assert counter.evaluations == 4
    counter(np.zeros((1, 1)))
    assert counter.evaluations == 5


@pytest.mark.parametrize("name", OPTIMIZERS)
def test_both_budgets_end_a_search_at_the_same_place(name: str) -> None:
    optimizer = OPTIMIZERS[name](lower=-np.ones(2), upper=np.ones(2))
    strict = EvaluationCounter(first, budget=333)
    ends = [
        minimize(optimizer, strict, rng=np.random.default_rng(0), iterations=1000),
        minimize(optimizer, first, rng=np.random.default_rng(0), budget=333),
    ]
    assert 250 < strict.evaluations <= 333
    assert ends[0].best_value == ends[1].best_value == strict.best_value


def test_residuals_pass_through_and_their_cost_is_logged() -> None:
    counter = EvaluationCounter(lambda x: x - 1.0, cost=lambda residuals: (residuals**2).sum(axis=1))
    assert np.array_equal(counter(np.array([[1.0, 2.0], [3.0, 1.0]])), [[0.0, 1.0], [2.0, 0.0]])
    assert (counter.best_value, counter.best.tolist()) == (1.0, [1.0, 2.0])


def test_a_call_that_raises_has_cost_too() -> None:
    def broken(x: np.ndarray) -> np.ndarray:
        raise OSError("no engine")

    counter = EvaluationCounter(broken)
    with pytest.raises(OSError, match="no engine"):
        counter(np.zeros((3, 1)))
    assert counter.evaluations == 3


def test_one_point_without_its_batch_is_refused() -> None:
    with pytest.raises(ValueError, match="batches"):
        EvaluationCounter(first)(np.zeros(2))


def test_a_search_needs_an_end() -> None:
    with pytest.raises(ValueError, match="iterations or budget"):
        minimize(Iafsa(lower=-np.ones(2), upper=np.ones(2)), first, rng=np.random.default_rng(0))


def test_callback_sees_every_iteration() -> None:
    seen: list[int] = []
    optimizer = Iafsa(lower=-np.ones(2), upper=np.ones(2))
    minimize(
        optimizer,
        first,
        rng=np.random.default_rng(0),
        iterations=4,
        callback=lambda state: seen.append(state.iteration),
    )
    assert seen == [0, 1, 2, 3, 4]


def test_evaluations_made_elsewhere_are_charged() -> None:
    counter = EvaluationCounter(lambda points: np.sum(points**2, axis=1))
    counter(np.array([[2.0]]))
    counter.charge(10, np.array([1.0]), 1.0)
    assert counter.evaluations == 11
    assert counter.best_value == 1.0
    assert counter.history[0].tolist() == [1.0, 11.0]
    assert counter.history[1].tolist() == [4.0, 1.0]
