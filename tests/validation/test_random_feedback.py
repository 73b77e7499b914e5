"""Machines under feedback, drawn at random, against Lagrange's equations that share no code with the mechanics."""

from __future__ import annotations

import pytest
from shoal_validation.random_feedback.study import judged

MENDED = 21, 26
"""Of these a ramp of time stayed at its end, and an implicit step that a switch cut to nothing was not finite."""


@pytest.mark.parametrize(
    "seed", [*MENDED, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(40) if seed not in MENDED)]
)
def test_a_machine_drawn_at_random_moves_as_lagrange_says(seed: int) -> None:
    assert judged(seed).verdict in (("right",) if seed in MENDED else ("right", "refused", "not judged"))
