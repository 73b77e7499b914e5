"""A probability over time, with what it is worth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shoal.response.inputs import IntArray
from shoal.response.statistics import CONFIDENCE
from shoal.trajectory import Array

ALIKE = -math.log(0.025) / CONFIDENCE
"""Standard deviations over n where n of n runs agree: with 97.5 % confidence fewer than
-log(0.025) / n = 3.7 / n do not (the rule of three)."""


@dataclass(frozen=True)
class ExceedanceEstimate:
    """The probability that a limit is exceeded at some instant up to each.

    exceeded: (instants,); deviation: of its logarithm, (instants,), infinite where no run exceeds it; unseen: a
    probability that the runs may have missed altogether; failed: probability of the runs that failed; between: share
    of the probability that more instants would add, nan where it is not known; why: in words
    """

    exceeded: Array
    deviation: Array
    why: str
    unseen: float = 0.0
    failed: float = 0.0
    between: float = math.nan

    @property
    def probability(self) -> float:
        """Probability over all instants."""
        return float(self.exceeded[-1])

    @property
    def coefficient(self) -> float:
        """Standard deviation over mean."""
        return float(self.deviation[-1])

    @property
    def described(self) -> str:
        """The probability in words: where no run exceeds the limit, not 0 but an upper bound."""
        if self.probability == 0:
            return f"below {float(self.interval[1][-1]):.2g}"
        return "not known" if math.isnan(self.probability) else f"{self.probability:.3g}"

    @property
    def interval(self) -> tuple[Array, Array]:
        """Bounds that hold with 95 % confidence, (instants,) each: of a lognormal variable."""
        with np.errstate(invalid="ignore", over="ignore"):
            lower = np.where(self.exceeded > 0, self.exceeded * np.exp(-CONFIDENCE * self.deviation), 0.0)
            upper = np.where(self.exceeded > 0, self.exceeded * np.exp(CONFIDENCE * self.deviation), self.unseen)
        return lower, np.minimum(upper + self.failed, 1.0)


def first_passages(margins: Array) -> IntArray:
    """Index of the first instant beyond the limit, the number of instants where there is none, (runs,)."""
    beyond = margins < 0
    return np.asarray(np.where(beyond.any(axis=1), beyond.argmax(axis=1), margins.shape[1]))


def weighted(margins: Array, weights: Array, why: str) -> ExceedanceEstimate:
    """Estimate a probability from independent runs with weights (1 for plain ones)."""
    count, instants = margins.shape
    first = first_passages(margins)
    beyond = first < instants
    exceeded = np.cumsum(np.bincount(first[beyond], weights[beyond], instants)) / count
    squares = np.cumsum(np.bincount(first[beyond], weights[beyond] ** 2, instants)) / count
    variance = np.maximum(squares - exceeded**2, 0.0) / max(count - 1, 1)
    deviation = np.divide(np.sqrt(variance), exceeded, out=np.full(instants, np.inf), where=exceeded > 0)
    # Where all of n runs exceed it, more than 1 - 3.7 / n do with 97.5 % confidence.
    deviation = np.maximum(deviation, ALIKE / count)
    lost = float(weights[np.isnan(margins).any(axis=1)].sum() / count)
    # No event in n runs: less than 3.7 / n with 97.5 % confidence.
    unseen = 1 - 0.025 ** (1 / count)
    return ExceedanceEstimate(exceeded, deviation, why, unseen, lost, _between(margins, weights))


def _between(margins: Array, weights: Array) -> float:
    """Extrapolate from every second instant: the depth that is missed falls with the square of the spacing."""
    sparse = margins[:, ::-2]
    whole = weights[(margins < 0).any(axis=1)].sum()
    if not whole > 0 or margins.shape[1] < 3:
        return math.nan
    return float(1 - weights[(sparse < 0).any(axis=1)].sum() / whole) / 3
