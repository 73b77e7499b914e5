"""The published behaviours, one by one, with swarms of a few fish."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shoal.swarm import Afsa, minimize
from shoal.swarm.afsa import AfsaState, Stage


def started(fish: list[list[float]], values: list[float], **settings: Any) -> tuple[Afsa, AfsaState]:
    """A search in the unit box whose first swarm is given."""
    optimizer = Afsa(lower=np.zeros(2), upper=np.ones(2), size=len(fish), **settings)
    state = optimizer.init(np.random.default_rng(0))
    state = replace(state, moves=np.array(fish), point=np.array(fish))
    return optimizer, optimizer.tell(state, np.array(values))


def stages(state: AfsaState) -> list[Stage]:
    return [Stage(stage) for stage in state.stage]


def test_swarming_asks_for_the_centre_of_the_neighbours_and_steps_towards_it() -> None:
    optimizer, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2)
    assert stages(state) == [Stage.CENTRE, Stage.CENTRE, Stage.CENTRE, Stage.TRY]
    assert np.allclose(state.point[0], [0.5, 0.55])
    state = optimizer.tell(state, np.array([0.0, 9.0, 9.0, 9.0]))
    assert stages(state) == [Stage.SWARM, Stage.FOLLOW, Stage.TRY, Stage.TRY]
    to_centre, to_leader = state.point[0] - [0.4, 0.5], state.point[1] - [0.5, 0.5]
    assert np.allclose(np.cross(np.append(to_centre, 0), [0.1, 0.05, 0]), 0)
    assert np.allclose(np.cross(np.append(to_leader, 0), [0.0, 0.1, 0]), 0)
    assert 0 < np.linalg.norm(to_centre) <= optimizer.step
    assert 0 < np.linalg.norm(to_leader) <= optimizer.step


@pytest.mark.parametrize("swarmed", [3.5, 3.1])
def test_the_better_behaviour_is_taken_and_the_others_forage(swarmed: float) -> None:
    optimizer, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2)
    state = optimizer.tell(state, np.array([0.0, 9.0, 9.0, 9.0]))
    towards_centre = state.point[0]
    state = optimizer.tell(state, values_of(state, [swarmed, 5.0, 9.0, 9.0]))
    assert stages(state)[:2] == [Stage.FOLLOW, Stage.TRY]
    towards_leader = state.point[0]
    state = optimizer.tell(state, values_of(state, [3.2, 9.0, 9.0, 9.0]))
    assert stages(state)[0] is Stage.DONE
    assert np.array_equal(state.found[0], towards_centre if swarmed < 3.2 else towards_leader)
    assert state.found_values[0] == min(swarmed, 3.2)
    assert state.values.tolist() == [4.0, 3.0, 2.0, 1.0]


def values_of(state: AfsaState, by_fish: list[float]) -> np.ndarray:
    """One value a fish, in the order in which they ask."""
    return np.array(by_fish)[state.owners]


def test_a_crowded_fish_neither_swarms_nor_follows() -> None:
    _, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2, crowding=0.5)
    assert stages(state) == [Stage.TRY] * 4
    assert state.owners.tolist() == [0, 1, 2, 3]


def test_foraging_moves_towards_what_it_found_else_at_random() -> None:
    optimizer, state = started([[0.2, 0.2], [0.8, 0.8]], [1.0, 1.0], visual=0.1, step=0.05, try_number=2)
    seen = state.point[0]
    assert np.all(np.abs(state.point - state.fish) <= 0.1)
    state = optimizer.tell(state, np.array([0.5, np.nan]))
    assert stages(state) == [Stage.ARRIVE, Stage.TRY]
    assert state.tries.tolist() == [1, 2]
    way, goal = state.point[0] - [0.2, 0.2], seen - [0.2, 0.2]
    assert np.isclose(way @ goal, np.linalg.norm(way) * np.linalg.norm(goal))
    assert np.linalg.norm(way) <= 0.05
    state = optimizer.tell(state, values_of(state, [7.0, 2.0]))
    assert stages(state) == [Stage.DONE, Stage.ARRIVE]
    assert state.owners.tolist() == [1]
    assert np.all(np.abs(state.point[1] - 0.8) <= 0.05)
    places = state.point
    state = optimizer.tell(state, np.array([8.0]))
    assert (state.iteration, state.values.tolist(), state.best_value) == (1, [7.0, 8.0], 0.5)
    assert np.array_equal(state.fish, places)


@pytest.mark.parametrize("batch", [1, 7, 32])
def test_how_many_are_evaluated_at_once_changes_nothing_of_the_search(batch: int) -> None:
    def search(batch: int | None) -> tuple[list[AfsaState], list[int]]:
        optimizer = Afsa(lower=np.full(2, -6.0), upper=np.full(2, 6.0), batch=batch)
        state, iterations, sizes = optimizer.init(np.random.default_rng(1)), list[AfsaState](), list[int]()
        while state.iteration < 6:
            points = optimizer.ask(state)
            x, y = points.T
            before = state.iteration
            state = optimizer.tell(state, (x**2 + y - 11) ** 2 + (x + y**2 - 7) ** 2)
            iterations += [state] if state.iteration > before else []
            sizes.append(len(points))
        return iterations, sizes

    (together, all_sizes), (apart, sizes) = search(None), search(batch)
    assert max(sizes) == batch
    assert sum(sizes) == sum(all_sizes)
    for one, other in zip(together, apart, strict=True):
        assert np.array_equal(one.fish, other.fish)
        assert np.array_equal(one.values, other.values)
        assert one.best_value == other.best_value


@pytest.mark.slow
def test_accuracy_is_limited_by_the_step() -> None:
    """Sphere in [-5, 5]^2, 40 fish, 100 iterations; medians of 20 seeds measured: 1.5e-4 and 1.9e-6."""

    def median(visual: float) -> float:
        optimizer = Afsa(lower=np.full(2, -5.0), upper=np.full(2, 5.0), visual=visual, step=visual / 10)
        ends = [
            minimize(optimizer, lambda x: (x**2).sum(axis=1), rng=np.random.default_rng(seed), iterations=100)
            for seed in range(7)
        ]
        return float(np.median([end.best_value for end in ends]))

    assert 1e-6 < median(0.3) < 1e-3
    assert median(0.1) < 1e-5


@pytest.mark.parametrize("wrong", [{"size": 1}, {"try_number": 0}, {"visual": 0.0}, {"step": -1.0}, {"batch": 0}])
def test_wrong_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"needs|positive"):
        Afsa(lower=np.zeros(2), upper=np.ones(2), **wrong)  # type: ignore[arg-type]
