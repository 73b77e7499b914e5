"""Machines with contacts, drawn at random, against a formulation that shares no code with the mechanics."""

from __future__ import annotations

import pytest
from shoal_validation.random_contacts.machines import pushed
from shoal_validation.random_contacts.study import judged

MENDED = 40, 100, 114, 115
"""Of these a slip turned to and fro at rest, touching balls struck twice, a jammed rod stuck, friction turned back."""


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize(
    "seed", [5, 7, *MENDED, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(8, 40))]
)
def test_a_machine_drawn_at_random_moves_as_newton_and_euler_say(seed: int) -> None:
    assert judged(seed).verdict in (("right",) if seed in MENDED else ("right", "refused", "not judged"))


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize("seed", [0, 2, 3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 30))])
def test_contacts_open_and_slip_where_forces_jump(seed: int) -> None:
    verdict = judged(seed, pushed).verdict
    assert verdict in (("right",) if seed < 4 else ("right", "refused", "not judged"))


@pytest.mark.slow  # half a minute
def test_most_machines_are_judged_and_right() -> None:
    verdicts = [judged(seed).verdict for seed in range(40, 52)]
    assert verdicts.count("right") >= 8
