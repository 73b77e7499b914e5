"""Machines with contacts, drawn at random, against a formulation that shares no code with the mechanics."""

from __future__ import annotations

import pytest
from shoal_validation.random_contacts.study import judged


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize(
    "seed", [5, 7, 100, 114, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(8, 40))]
)
def test_a_machine_drawn_at_random_moves_as_newton_and_euler_say(seed: int) -> None:
    assert judged(seed).verdict in ("right", "refused", "not judged")


@pytest.mark.slow  # half a minute
def test_most_machines_are_judged_and_right() -> None:
    verdicts = [judged(seed).verdict for seed in range(40, 52)]
    assert verdicts.count("right") >= 8
