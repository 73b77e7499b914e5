"""Machines in space drawn at random: what is called right is, by the judgement of another program."""

from __future__ import annotations

import pytest
from shoal_validation.random_space.study import Judged, drawn, judged, met

MANY, LINKAGES = 200, 110
FINE = ("right", "refused", "not judged")
BENDING = [seed for seed in range(30) if drawn(seed, "chains")[1].flexible_rods]
"""Machines with flexible rods."""


def of_chains(seed: int) -> Judged:
    pytest.importorskip("exudyn")
    return judged(seed)


@pytest.mark.parametrize("seed", range(4, 8))
def test_the_verdict_on_a_few_machines_is_right(seed: int) -> None:
    found = of_chains(seed)
    assert found.verdict == "right", found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(4), *range(8, MANY)])
def test_no_answer_is_wrong_and_called_right(seed: int) -> None:
    found = of_chains(seed)
    assert found.verdict in FINE, found


@pytest.mark.parametrize("seed", [6, *(pytest.param(one, marks=pytest.mark.slow) for one in (7, 8, 10))])
def test_the_verdict_on_a_few_linkages_is_right(seed: int) -> None:
    found = judged(seed, "linkages")
    assert found.verdict == "right", found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(6), 9, *range(11, LINKAGES)])
def test_every_linkage_moves_as_newton_and_euler_say(seed: int) -> None:
    found = judged(seed, "linkages")
    assert found.verdict in ("right", "not judged"), found


@pytest.mark.slow
@pytest.mark.parametrize("seed", BENDING)
def test_director_rods_move_as_exudyns_finer_cables(seed: int) -> None:
    pytest.importorskip("exudyn")
    found = judged(seed, "directors")
    assert found.verdict in FINE, found


@pytest.mark.slow
@pytest.mark.parametrize("seed", BENDING)
def test_a_tolerance_that_is_called_met_is(seed: int) -> None:
    pytest.importorskip("exudyn")
    found = met(seed, 1e-3)
    assert found.verdict != "wrong and called right", found
