"""What every optimiser in the list promises, whatever the function does."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoal.swarm import OPTIMIZERS, EvaluationCounter, minimize

ALL = pytest.mark.parametrize("name", OPTIMIZERS)
few = settings(max_examples=15)
seeds = st.integers(0, 2**32 - 1)
boxes = st.lists(
    st.tuples(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3)).map(lambda side: (side[0], side[0] + side[1])),
    min_size=1,
    max_size=4,
)


def build(name: str, box: list[tuple[float, float]], **settings: Any) -> Any:
    lower, upper = np.array(box).T
    return OPTIMIZERS[name](lower=lower, upper=upper, **settings)


def waves(x: np.ndarray) -> np.ndarray:
    return np.sin(7 * x).sum(axis=1) + 0.01 * (x**2).sum(axis=1)


def faulty(x: np.ndarray) -> np.ndarray:
    """Fails on a third of the points, in every way a simulation can."""
    values = waves(x)
    kind = np.floor(x[:, 0] * 1e4).astype(int) % 9
    return np.select([kind == 0, kind == 1, kind == 2], [np.nan, np.inf, -np.inf], values)


@ALL
@few
@given(box=boxes, seed=seeds)
def test_best_is_the_minimum_of_everything_told_and_monotone(
    name: str, box: list[tuple[float, float]], seed: int
) -> None:
    optimizer = build(name, box, size=7)
    state = optimizer.init(np.random.default_rng(seed))
    assert (state.best_value, state.iteration) == (np.inf, -1)
    points, values = np.empty((0, len(box))), np.empty(0)
    iteration = state.iteration
    for _ in range(25):
        candidates = optimizer.ask(state)
        told = faulty(candidates)
        state = optimizer.tell(state, told)
        points = np.concatenate([points, candidates])
        values = np.concatenate([values, np.where(np.isfinite(told), told, np.inf)])
        assert state.best_value == values.min()
        assert np.array_equal(state.best, points[np.argmin(values)])
        assert iteration <= state.iteration <= iteration + 1
        iteration = state.iteration


@pytest.mark.parametrize("name", [name for name in OPTIMIZERS if name != "iafsa-printed"])
@few
@given(box=boxes, seed=seeds)
def test_bounds_hold(name: str, box: list[tuple[float, float]], seed: int) -> None:
    lower, upper = np.array(box).T

    def outside_is_better(x: np.ndarray) -> np.ndarray:
        assert np.all(x >= lower)
        assert np.all(x <= upper)
        return -np.abs(x).sum(axis=1)

    minimize(build(name, box, size=8), outside_is_better, rng=np.random.default_rng(seed), iterations=20)


@ALL
@few
@given(seed=seeds)
def test_same_seed_same_search(name: str, seed: int) -> None:
    logs: list[list[np.ndarray]] = [[], []]
    for log in logs:
        optimizer = build(name, [(-2, 2), (0, 3)], size=9)

        def logged(x: np.ndarray, log: list[np.ndarray] = log) -> np.ndarray:
            log.append(x)
            return waves(x)

        minimize(optimizer, logged, rng=np.random.default_rng(seed), iterations=6)
    assert len(logs[0]) == len(logs[1])
    assert all(np.array_equal(a, b) for a, b in zip(*logs, strict=True))


@ALL
def test_a_state_is_never_modified(name: str) -> None:
    optimizer = build(name, [(-2, 2), (0, 3)], size=9)
    rng = np.random.default_rng(5)
    state = optimizer.init(rng)
    assert rng.random() == np.random.default_rng(5).random()
    for _ in range(12):
        values = waves(optimizer.ask(state))
        kept = copy.deepcopy(state)
        once, twice, later = (optimizer.tell(s, values) for s in (state, state, kept))
        assert np.array_equal(optimizer.ask(once), optimizer.ask(twice))
        assert np.array_equal(optimizer.ask(once), optimizer.ask(later))
        state = once


@ALL
def test_writing_on_the_candidates_does_no_harm(name: str) -> None:
    def careless(x: np.ndarray) -> np.ndarray:
        values = waves(x)
        x[:] = np.nan
        return values

    optimizer = build(name, [(-2, 2), (0, 3)], size=9)
    ends = [minimize(optimizer, function, rng=np.random.default_rng(1), iterations=5) for function in (waves, careless)]
    assert np.array_equal(ends[0].best, ends[1].best)


@ALL
def test_a_function_that_always_fails_ends_the_same_way(name: str) -> None:
    optimizer = build(name, [(-2, 2), (0, 3)], size=9)
    end = minimize(optimizer, lambda x: np.full(len(x), np.nan), rng=np.random.default_rng(1), iterations=10)
    assert (end.best_value, end.iteration, end.best.shape) == (np.inf, 10, (2,))


@ALL
def test_wrong_number_of_values_is_refused(name: str) -> None:
    optimizer = build(name, [(-2, 2), (0, 3)], size=9)
    state = optimizer.init(np.random.default_rng(1))
    with pytest.raises(ValueError, match="9 candidates"):
        optimizer.tell(state, np.zeros(8))


@ALL
@pytest.mark.parametrize("box", [[(1, 1)], [(1, 0)], [(0, np.inf)], [(np.nan, 1)]])
def test_wrong_bounds_are_refused(name: str, box: list[tuple[float, float]]) -> None:
    with pytest.raises(ValueError, match="lower"):
        build(name, box)


@ALL
@pytest.mark.by_day(1)
def test_finds_the_bottom_of_a_bowl(name: str) -> None:
    """Best of the sphere in [-5, 5]^2 after 100 iterations of 40 fish; medians measured: 1.5e-4, 9e-23, 5e-4.

    Whoever has a better word for himself than the last one says so here.
    """
    reached = {"afsa": 2e-3, "iafsa": 1e-18}.get(name, 5e-3)
    for seed in range(5):
        counter = EvaluationCounter(lambda x: (x**2).sum(axis=1))
        end = minimize(build(name, [(-5, 5)] * 2), counter, rng=np.random.default_rng(seed), iterations=100)
        assert end.best_value < reached
        assert (end.best_value, end.best.tolist()) == (counter.best_value, counter.best.tolist())
