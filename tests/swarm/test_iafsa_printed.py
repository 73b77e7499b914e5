"""The printed algorithm does what is printed, its flaws included."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.swarm import IafsaPrinted, minimize

LOWER, UPPER = np.array([-np.pi, -1.0]), np.array([np.pi, 2.0])


def bowl(x: np.ndarray) -> np.ndarray:
    return ((x - 0.3) ** 2).sum(axis=1)


def test_eq_17_by_hand() -> None:
    """Three swarms replayed from the same random stream, written out as in the paper."""
    optimizer = IafsaPrinted(lower=LOWER, upper=UPPER, size=6, w=0.6, c1=1.1, c2=1.3, rho=2.0)
    state = optimizer.init(np.random.default_rng(3))
    rng = np.random.default_rng(3)
    x = LOWER + rng.random((6, 2)) * (UPPER - LOWER)
    v = np.zeros((6, 2))
    for _ in range(3):
        assert np.allclose(optimizer.ask(state), x, rtol=1e-13)
        state = optimizer.tell(state, bowl(x))
        p = x
        p_g = p[np.argmin(bowl(p))]
        r = rng.random((4, 6, 2))
        v = 0.6 * v + 1.1 * r[0] * (p - x) + 1.3 * r[1] * (p_g - x) + 2.0 * r[2] * (r[3] - x)
        x = x + v


def test_steps_3_6_and_3_7_return_the_better_of_two_swarms() -> None:
    optimizer = IafsaPrinted(lower=LOWER, upper=UPPER)
    state = optimizer.init(np.random.default_rng(0))
    previous = np.inf
    got_worse = False
    for _ in range(50):
        values = bowl(optimizer.ask(state))
        before = state.group_value
        state = optimizer.tell(state, values)
        assert state.group_value == min(previous, values.min())
        assert bowl(state.group_best[None])[0] == state.group_value
        got_worse |= state.group_value > before
        previous = values.min()
    assert got_worse


def test_memory_is_erased_so_c1_has_no_effect() -> None:
    ends = [
        minimize(IafsaPrinted(lower=LOWER, upper=UPPER, c1=c1), bowl, rng=np.random.default_rng(0), iterations=20)
        for c1 in (0.0, 1.5)
    ]
    assert np.array_equal(ends[0].fish, ends[1].fish)


def test_any_threshold_stops_at_the_first_iteration_without_progress() -> None:
    optimizer = IafsaPrinted(lower=LOWER, upper=UPPER, epsilon=1e-12)
    end = minimize(optimizer, bowl, rng=np.random.default_rng(0), iterations=100)
    assert end.finished
    assert end.iteration < 10
    endless = minimize(IafsaPrinted(lower=LOWER, upper=UPPER), bowl, rng=np.random.default_rng(0), iterations=100)
    assert not endless.finished


def test_swarm_keeps_stirring_but_stays_finite() -> None:
    end = minimize(IafsaPrinted(lower=LOWER, upper=UPPER), bowl, rng=np.random.default_rng(0), iterations=2000)
    assert 0.1 < np.std(end.fish) < 10.0


@pytest.mark.parametrize(
    ("seeds", "last_two"),
    [
        ({"traditional": [1.0, 0.5]}, [[1.0, 0.5], [1.0, 0.5]]),
        ({"traditional": [1.0, 0.5], "previous": [0.2, 0.1]}, [[0.2, 0.1], [1.0, 0.5]]),
    ],
)
def test_step_3_2_puts_the_seeds_last(seeds: dict[str, list[float]], last_two: list[list[float]]) -> None:
    optimizer = IafsaPrinted(lower=LOWER, upper=UPPER, **{name: np.array(x) for name, x in seeds.items()})
    assert optimizer.ask(optimizer.init(np.random.default_rng(0)))[-2:].tolist() == last_two


def test_terms_can_be_switched_off() -> None:
    """Without inertia and mutation the best fish rests and the others approach it."""
    optimizer = IafsaPrinted(lower=LOWER, upper=UPPER, c2=0.9, use_velocity=False, use_mutation=False)
    end = minimize(optimizer, bowl, rng=np.random.default_rng(0), iterations=100)
    assert np.ptp(end.fish, axis=0).max() < 1e-6
