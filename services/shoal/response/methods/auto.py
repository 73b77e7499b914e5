"""The choice of a method: bounds by a polynomial whose extremal points are run, statistics by polynomial chaos."""

from __future__ import annotations

from shoal.response.expansion import Expansion
from shoal.response.methods import chaos, sampling
from shoal.response.methods.bounds import bounds
from shoal.response.study import Found, Study

TOO_COARSE = 0.05
"""An expansion that is off by more than this share of the standard deviation gives way to sampling."""
SAMPLED = 8192


def auto(study: Study) -> Found:
    """Intervals: `bounds`. Distributions: chaos or, where that does not converge, quasi-random runs."""
    if not study.inputs.random.any():
        return bounds(study)
    study.random_only("auto")
    found = chaos.grown(study, study.count or chaos.RUNS)
    assert isinstance(found.surrogate, Expansion)
    off = chaos.shares(study, found.surrogate)
    coarse = off > TOO_COARSE
    if not coarse.any():
        return found
    sampled = sampling.of_distributions(study, SAMPLED)
    why = f"{found.why} is off by up to {off.max():.1g} of the standard deviation; where it is, {sampled.why} tell"
    return Found(why, found.surrogate, found.error, sampled.indices, coarse)
