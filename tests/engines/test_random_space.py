"""Machines in space drawn at random: what is called right is, by the judgement of another engine."""

from __future__ import annotations

import pytest
from shoal_validation.random_space.study import judged

pytest.importorskip("exudyn")
FEW, MANY = 8, 200
FINE = ("right", "refused", "not judged")


@pytest.mark.parametrize("seed", range(4, FEW))
def test_the_verdict_on_a_few_machines_is_right(seed: int) -> None:
    found = judged(seed)
    assert found.verdict == "right", found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(4), *range(FEW, MANY)])
def test_no_answer_is_wrong_and_called_right(seed: int) -> None:
    found = judged(seed)
    assert found.verdict in FINE, found
