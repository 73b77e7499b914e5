"""A study does not contradict itself: probabilities, counts of runs, deviations, limits and errors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from shoal.notebook import uncertain
from shoal.response.assess import shifts
from shoal.response.limits import limit
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.exceedance import contradictions
from shoal.scene import Scene
from sliding import puck

BALL = {"name": "ball", "bodies": {"b": {"kind": "point-mass", "mass": 1.0}}, "markers": {"b": {"body": "b"}},
        "gravity": [0, 0], "initial": {"b": {"position": [0, 0], "velocity": [1, 0]}}}  # fmt: skip
"""x = v t."""


def test_a_refused_study_keeps_no_limit() -> None:
    """Where the machine goes is not known; so that a limit of its angle is kept is not told either."""
    found = uncertain(puck(0.4, 0.12, 2000.0), ["initial.P.position.1=-1:1"], [2.0], limit=["P.angle < 1"])
    assert not found.ok
    assert found.limits[0].kept is not True


def estimate(probability: float, deviation: float) -> ExceedanceEstimate:
    return ExceedanceEstimate(np.array([probability]), np.array([deviation]), "importance sampling")


@pytest.mark.parametrize(
    ("probability", "deviation", "passed", "count", "doubted"),
    [
        (2.8e-7, 0.015, 10, 6144, True),
        (1e-3, 0.05, 5, 5000, False),
        (1e-3, 0.05, 16, 5000, True),
        (1e-2, 0.05, 0, 5000, True),
        (1e-2, 0.05, 50, 5000, False),
        (1e-4, 0.05, 0, 5000, False),
        (1e-3, math.nan, 10, 5000, False),
        (1e-3, math.nan, 40, 5000, True),
    ],
)
def test_a_count_contradicts_a_probability(
    probability: float, deviation: float, passed: int, count: int, doubted: bool
) -> None:
    """By the binomial distribution of scipy."""
    margins = np.where(np.arange(count) < passed, -1.0, 1.0)[:, None]
    found = contradictions(estimate(probability, deviation), margins)
    assert [one.code for one in found] == ["contradicted-by-runs"] * doubted
    assert all(one.numbers["counted"] == passed / count for one in found)
    if doubted and not math.isnan(deviation):
        ends = probability * np.exp(1.96 * deviation * np.array([-1.0, 1.0]))
        assert min(stats.binom.cdf(passed, count, ends[0]), stats.binom.sf(passed - 1, count, ends[1])) < 1e-3


def test_a_deviation_cannot_be_smaller_than_what_lies_beyond_a_limit() -> None:
    """Cantelli's inequality holds with equality for two values, 0 and d with probability p."""
    p, d = 2e-3, 0.7
    wanted = limit(f"b.x > {d}", Scene.parse(BALL))
    mean = np.array([p * d])
    moved, least = shifts(wanted, mean, np.zeros(1), estimate(p, 1e-12))
    assert least[0] == pytest.approx(d * math.sqrt(p * (1 - p)), rel=1e-9)
    assert moved[0] == pytest.approx(p * d * (1 - p), rel=1e-9)
    both = limit(f"abs(b.x) > {d}", Scene.parse(BALL))
    assert shifts(both, np.zeros(1), np.zeros(1), estimate(p, 1e-12))[1][0] == pytest.approx(d * math.sqrt(p))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2))])
def test_mean_and_deviation_allow_for_the_probability_beside_them(seed: int) -> None:
    """2e-3 of all pucks hit a pin of 4 mm and turn round; of 128 runs none does, and all say x = 1 m."""
    found = uncertain(
        *(puck(0.3, 0.004, 2e6), ["initial.P.position.1~normal(0,0.15)"], [2.0]),
        **{"limit": ["P.x < 0.5"], "seed": seed, "verify": False},
    )
    assert found.statistics is not None
    told = found.statistics
    mean, std, error = (found.column("P", "x", of)[0] for of in (told.mean, told.std, told.std_error))
    lower = float(found.limits[0].estimates[0].interval[0][-1])
    assert 1e-4 < lower < 1e-2
    if found.ok:
        assert std + error >= (mean - 0.5) * math.sqrt(lower / (1 - lower)) * (1 - 1e-9)
        assert "rare-values-missed" in found.codes


def test_a_limit_that_is_stated_the_other_way_round_is_noted() -> None:
    noted, plain = (
        uncertain(Scene.parse(BALL), ["initial.b.velocity.0~normal(1,0.01)"], [1.0], limit=[text], verify=False)
        for text in ("b.x > 0.5", "b.x > 1.01")
    )
    assert noted.ok
    assert noted.codes == ["nearly-always-exceeded"]
    assert plain.codes == []
