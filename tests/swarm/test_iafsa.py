"""The repaired swarm converges on what smooth identification problems look like."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoal.swarm import Iafsa, minimize
from shoal.swarm.box import reflect


def valley(x: np.ndarray) -> np.ndarray:
    """Quadratic of condition 1e3 with turned axes; minimum at (0.7854, 0.5236)."""
    turn = np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
    return ((x - [0.7854, 0.5236]) @ turn) ** 2 @ np.array([1.0, 1e3])


def rosenbrock(x: np.ndarray) -> np.ndarray:
    return (1 - x[:, 0]) ** 2 + 100 * (x[:, 1] - x[:, 0] ** 2) ** 2


def rastrigin(x: np.ndarray) -> np.ndarray:
    return 10 * x.shape[1] + (x**2 - 10 * np.cos(2 * np.pi * x)).sum(axis=1)


def reached(function, half_width: float, **settings) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Best values after 100 iterations from 20 seeds."""
    optimizer = Iafsa(lower=np.full(2, -half_width), upper=np.full(2, half_width), **settings)
    return np.array(
        [minimize(optimizer, function, rng=np.random.default_rng(s), iterations=100).best_value for s in range(20)]
    )


@pytest.mark.parametrize(("function", "half_width"), [(valley, np.pi), (rosenbrock, 2.0)])
def test_converges_without_seeds(function, half_width: float) -> None:  # type: ignore[no-untyped-def]
    assert reached(function, half_width).max() < 1e-15


def test_finds_the_global_basin_of_rastrigin() -> None:
    """Every other minimum lies at 0.99 or above."""
    assert (reached(rastrigin, 5.12) < 0.5).sum() >= 18


def test_mutation_earns_its_cost_in_a_valley() -> None:
    assert np.median(reached(valley, np.pi, use_mutation=False)) > 1e6 * np.median(reached(valley, np.pi))


def test_seeds_are_the_last_fish_and_are_found() -> None:
    bounds = {"lower": np.full(2, -2.0), "upper": np.full(2, 2.0)}
    traditional, previous = np.array([1.0, 1.0]), np.array([-0.5, 0.25])
    optimizer = Iafsa(**bounds, traditional=traditional, previous=previous)
    first = optimizer.ask(optimizer.init(np.random.default_rng(0)))
    assert np.allclose(first[-2:], [previous, traditional], rtol=0, atol=1e-15)
    end = minimize(optimizer, rosenbrock, rng=np.random.default_rng(0), iterations=0)
    assert end.best_value < 1e-28


def test_tolerance_ends_the_search_early() -> None:
    optimizer = Iafsa(lower=np.full(2, -2.0), upper=np.full(2, 2.0), tolerance=1e-6)
    end = minimize(optimizer, rosenbrock, rng=np.random.default_rng(0), iterations=1000)
    assert end.finished
    assert end.iteration < 100
    assert end.best_value < 1e-10


def test_values_that_agree_end_the_search() -> None:
    """About a minimum of 1, where closer fish gain nothing; not where all values are the same, which tells nothing."""
    box = {"lower": np.full(2, -2.0), "upper": np.full(2, 2.0), "value_tolerance": 1e-6}
    end = minimize(Iafsa(**box), lambda x: 1.0 + rosenbrock(x), rng=np.random.default_rng(0), iterations=1000)
    assert end.finished
    assert end.iteration < 100
    assert end.best_value < 1.0 + 1e-6
    assert np.ptp(end.memory_values) <= 1e-6 * end.best_value
    plateau = minimize(Iafsa(**box), lambda x: np.ones(len(x)), rng=np.random.default_rng(0), iterations=5)
    assert plateau.iteration == 5


@pytest.mark.parametrize("wrong", [{"mutation": 1.5}, {"size": 1}, {"traditional": np.zeros(3)}])
def test_wrong_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="found"):
        Iafsa(lower=np.zeros(2), upper=np.ones(2), **wrong)  # type: ignore[arg-type]


@given(unit=st.floats(-5, 5), velocity=st.floats(-5, 5))
def test_walls_reflect_and_take_the_velocity(unit: float, velocity: float) -> None:
    folded, slowed = reflect(np.array([unit]), np.array([velocity]))
    assert 0.0 <= folded[0] <= 1.0
    assert np.isclose(np.cos(np.pi * folded[0]), np.cos(np.pi * unit))
    assert slowed[0] == (velocity if 0.0 <= unit <= 1.0 else 0.0)
