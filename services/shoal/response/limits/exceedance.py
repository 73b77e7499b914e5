"""The probability that a limit is exceeded as a reliability method finds it, with reasons for doubt."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.importance import Sample
from shoal.response.limits.margins import least
from shoal.trajectory import Array

COARSE = 0.15
"""Coefficient of variation above which the estimate is told to be coarse."""


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
