"""Probability that a limit is exceeded as a reliability method finds it, with reasons for doubt.

One of them is a binomial test against plain Monte Carlo runs, which are unbiased.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.importance import Sample
from shoal.response.limits.margins import least
from shoal.trajectory import Array

COARSE = 0.15
"""Coefficient of variation above which the estimate is reported as coarse."""


@dataclass(frozen=True)
class Exceedance:
    """Probability that a limit is exceeded, by one method.

    findings: reasons for doubt; plain: runs that were drawn from the distributions to see whether they contradict it;
    sample: runs by which the probability can be counted again if the limit were elsewhere, None where there are none
    """

    estimate: ExceedanceEstimate
    points: list[DesignPoint]
    why: str
    findings: list[Finding] = field(default_factory=list)
    plain: int = 0
    sample: Sample | None = None

    @property
    def shown(self) -> Array | None:
        """Place of the run that shows how the limit is exceeded, or comes nearest to it, (parameters,)."""
        if self.points or self.sample is None:
            return self.points[0].place if self.points else None
        return np.asarray(self.sample.places[least(self.sample.rows).argmin()])


def coarse(estimate: ExceedanceEstimate) -> list[Finding]:
    """Return a finding where the coefficient of variation is large."""
    if not estimate.probability or estimate.coefficient <= COARSE:
        return []
    text = f"the coefficient of variation of the probability is {estimate.coefficient:.2f}"
    return [kinds.COARSE.found(text, coefficient=estimate.coefficient)]


CHANCE = 1e-3
"""Significance level of the binomial tests: three standard deviations, one-sided (convention)."""
ROUGH = 2.0
"""Factor by which a probability without an interval may be off."""


def contradictions(
    estimate: ExceedanceEstimate, margins: Array, share: float = 1.0, outside: float = 1.0
) -> list[Finding]:
    """Return a finding where the number of runs beyond the limit is unlikely (binomial tests of both ends, one-sided).

    margins: of runs drawn from the distributions, (runs, instants); share: of them that counts as independent; outside:
    probability of that part of the distributions which they are drawn from: the failure domain may lie elsewhere, so
    that few say nothing
    """
    lower, upper = ends(estimate)
    exceeding, made = int(np.any(margins < 0, axis=1).sum()), len(margins)
    count = int(share * made)
    few = stats.binom.cdf(math.ceil(share * exceeding), count, lower) if outside == 1 else 1.0
    many = stats.binom.sf(math.floor(share * exceeding) - 1, count, min(upper / outside, 1.0))
    if min(few, many) >= CHANCE:
        return []
    said = f"{estimate.why} says {estimate.probability:.1e}"
    runs = "plain runs" if outside == 1 else f"runs from the outer {outside:.1e} of the distributions"
    counted = outside * exceeding / made
    text = f"{said}, but of {made} {runs} {exceeding} exceed it, which makes {counted:.1e}"
    return [kinds.CONTRADICTED.found(text, probability=estimate.probability, counted=counted, runs=made)]


def ends(estimate: ExceedanceEstimate) -> tuple[float, float]:
    """Return the ends of the interval of 95 % confidence, or of one around a probability that has none."""
    lower, upper = (float(end[-1]) for end in estimate.interval)
    if not math.isnan(lower) and not math.isnan(upper):
        return lower, upper
    if math.isnan(estimate.probability):
        return 0.0, 1.0
    return estimate.probability / ROUGH, min(ROUGH * estimate.probability, 1.0)
