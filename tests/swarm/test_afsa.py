"""The published behaviours, one by one, with swarms of a few fish."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.swarm import Afsa, minimize
from shoal.swarm.afsa import AfsaState, Stage


def started(fish: list[list[float]], values: list[float], **settings: float) -> tuple[Afsa, AfsaState]:
    """A search in the unit box whose first swarm is given."""
    optimizer = Afsa(lower=np.zeros(2), upper=np.ones(2), size=len(fish), **settings)  # type: ignore[arg-type]
    state = optimizer.init(np.random.default_rng(0))
    object.__setattr__(state, "moves", np.array(fish))
    return optimizer, optimizer.tell(state, np.array(values))


def test_swarming_asks_for_the_centre_of_the_neighbours_and_steps_towards_it() -> None:
    optimizer, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2)
    assert state.stage is Stage.CENTRE
    assert state.owners.tolist() == [0, 1, 2]
    assert np.allclose(state.moves[0], [0.5, 0.55])
    state = optimizer.tell(state, np.array([0.0, 9.0, 9.0]))
    assert state.stage is Stage.SOCIAL
    assert state.owners.tolist() == [0, 0, 1]
    to_centre, to_leader = state.moves[0] - [0.4, 0.5], state.moves[1] - [0.4, 0.5]
    assert np.allclose(np.cross(np.append(to_centre, 0), [0.1, 0.05, 0]), 0)
    assert np.allclose(np.cross(np.append(to_leader, 0), [0.1, 0.1, 0]), 0)
    assert 0 < np.linalg.norm(to_centre) <= optimizer.step
    assert 0 < np.linalg.norm(to_leader) <= optimizer.step


def test_the_better_behaviour_is_taken_and_the_others_forage() -> None:
    optimizer, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2)
    state = optimizer.tell(state, np.array([0.0, 9.0, 9.0]))
    chosen = state.moves[1]
    state = optimizer.tell(state, np.array([3.5, 3.2, 5.0]))
    assert np.array_equal(state.fish[0], chosen)
    assert state.values.tolist() == [3.2, 3.0, 2.0, 1.0]
    assert state.stage is Stage.TRY
    assert state.owners.tolist() == [1, 2, 3]


def test_a_crowded_fish_neither_swarms_nor_follows() -> None:
    _, state = started([[0.4, 0.5], [0.5, 0.5], [0.5, 0.6], [0.9, 0.9]], [4.0, 3.0, 2.0, 1.0], visual=0.2, crowding=0.5)
    assert state.stage is Stage.TRY
    assert state.owners.tolist() == [0, 1, 2, 3]


def test_foraging_moves_towards_what_it_found_else_at_random() -> None:
    optimizer, state = started([[0.2, 0.2], [0.8, 0.8]], [1.0, 1.0], visual=0.1, step=0.05, try_number=2)
    seen = state.moves[0]
    assert np.all(np.abs(state.moves - state.fish) <= 0.1)
    state = optimizer.tell(state, np.array([0.5, np.nan]))
    assert (state.stage, state.owners.tolist(), state.tries) == (Stage.TRY, [1], 2)
    state = optimizer.tell(state, np.array([2.0]))
    assert (state.stage, state.owners.tolist()) == (Stage.ARRIVE, [0, 1])
    way, goal = state.moves[0] - [0.2, 0.2], seen - [0.2, 0.2]
    assert np.isclose(way @ goal, np.linalg.norm(way) * np.linalg.norm(goal))
    assert np.linalg.norm(way) <= 0.05
    assert np.all(np.abs(state.moves[1] - 0.8) <= 0.05)
    moves = state.moves
    state = optimizer.tell(state, np.array([7.0, 8.0]))
    assert (state.iteration, state.values.tolist(), state.best_value) == (1, [7.0, 8.0], 0.5)
    assert np.array_equal(state.fish, moves)


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


@pytest.mark.parametrize("wrong", [{"size": 1}, {"try_number": 0}, {"visual": 0.0}, {"step": -1.0}])
def test_wrong_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"needs|positive"):
        Afsa(lower=np.zeros(2), upper=np.ones(2), **wrong)  # type: ignore[arg-type]
