"""Identification through impacts: a few seeds of the study, closed-form data, wrong starts; rates, intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom
from shoal_validation.coverage.impacts import CASES, Trial, rate, rows, trial

pytestmark = pytest.mark.compiles("kernels of contacts, and of lanes with them")


@pytest.mark.parametrize(
    ("name", "seed"), [("rod", 0), *(pytest.param(*one, marks=pytest.mark.slow) for one in (("rod", 1), ("disc", 0)))]
)
def test_restitution_friction_and_gap_are_found_from_wrong_starts(name: str, seed: int) -> None:
    found = trial(name, seed)
    assert found.verdict == "identified", found.message
    assert set(found.errors) == set(CASES[name]().truth)
    # Beyond 1.5 half intervals: one parameter in 300.
    assert max(found.errors.values()) < 1.5


@pytest.mark.slow  # identifications
@pytest.mark.parametrize("seed", [7, 8, 76])
def test_friction_that_sticks_at_the_start_is_found_where_the_data_begin_to_depend_on_it(seed: int) -> None:
    """The starts are beyond 0.2, where the disc sticks at once and no derivative leads away."""
    found = trial("disc", seed)
    assert found.verdict == "identified", found.message
    assert found.errors["friction"] < 1.5


@pytest.mark.slow  # an identification
def test_friction_of_a_disc_that_sticks_is_not_called_known() -> None:
    found = trial("sticking", 0)
    assert set(found.errors) == {"restitution", "gap"}


def test_data_are_those_of_the_scene() -> None:
    """Closed forms beside the mechanics: no noise, the true parameters."""
    from shoal.engines import get_engine
    from shoal.scene import Scene

    for make in CASES.values():
        case = make()
        run = get_engine("gauss").simulate(
            Scene.parse({**case.scene, "solver": {"relative_tolerance": 1e-11}}), case.times
        )
        seen = run.angles[:, :, 0] if case.channels[0][1] == "angle" else run.points[:, 0, :, 0]
        np.testing.assert_allclose(seen, case.data(case.times), atol=1e-8)


@pytest.mark.parametrize(("held", "count"), [(0, 10), (95, 100), (100, 100)])
def test_the_interval_of_a_rate_is_where_binomial_tails_are_a_fortieth(held: int, count: int) -> None:
    """Clopper and Pearson: each end has the probability 0.025 of so many or more extreme."""
    low, high = rate(held, count)
    assert low == 0.0 if held == 0 else binom.sf(held - 1, count, low) == pytest.approx(0.025)
    assert high == 1.0 if held == count else binom.cdf(held, count, high) == pytest.approx(0.025)


def test_a_table_counts_what_is_called_right_and_what_is_wrong() -> None:
    trials = {0: Trial("identified", "", {"restitution": 0.5, "gap": 3.0}), 1: Trial("ambiguous", "", {})}
    found = {row[1]: row[2:] for row in rows(CASES["rod"](), trials)}
    assert found["restitution"][:2] == ("1 of 2", "1 of 1")
    assert (found["gap"][1], found["gap"][3]) == ("0 of 1", "1")
