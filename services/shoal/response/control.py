"""Runs all over the box that a surrogate has not seen: does it foretell them, and how much of the box is unseen?

Few runs are fitted by a polynomial of low degree whatever lies between them, and extremal points of that polynomial are
where it looks. Runs that do not depend on it look elsewhere.
"""

from __future__ import annotations

import numpy as np

from shoal.response.extremes import Surrogate
from shoal.response.inputs import BoolArray
from shoal.response.study import FINE_GAP, SAFETY, Enclosure, Looked, Study
from shoal.trajectory import Array

COUNT = 64
"""Runs, a power of two: along each axis one lies in every 64th, so that none misses a band of 3 % across the box."""
DOUBT = 0.05
"""One less the confidence with which a larger part of the box than `unseen` would have been seen."""


def unseen(count: int) -> float:
    """The share of the box that so many runs all over it miss with a probability of 5 %: about 3 / count.

    With independent runs (1 - share)^count = 0.05; evenly spread ones see a part that hangs together sooner.
    """
    return float(1 - DOUBT ** (1 / count)) if count else 1.0


def missed(study: Study, surrogate: Surrogate) -> Array:
    """Make the runs, as many as may be made, and tell by how much a surrogate misses them at most, (columns,).

    Raises TooManyRunsError, InputError.
    """
    runs, made = study.runs, len(study.runs.germs)
    count = min(COUNT, runs.left)
    if count:
        runs.controls += runs.all(study.inputs.sobol(count, study.seed + 5, runs.controls))
    return np.asarray(np.abs(surrogate(runs.germs[made:]) - runs.values[made:]).max(axis=0, initial=0.0))


def contradict(study: Study, missed: Array, error: Array) -> BoolArray:
    """Return whether runs are missed by more than the error that was told, and by what matters, (columns,)."""
    return np.asarray(missed > SAFETY * error + FINE_GAP * study.widths(study.runs.values))


def entered(study: Study, looked: Looked | None) -> Looked | None:
    """Bounds with runs that they foretold."""
    if looked is None:
        return None
    values, told = study.runs.values, looked.told
    lower, upper = values.min(axis=0), values.max(axis=0)
    low, high = np.minimum(told.lower_outer, lower), np.maximum(told.upper_outer, upper)
    width, beyond = study.widths(values), np.maximum(lower - low, high - upper)
    gap = np.divide(beyond, width, out=np.zeros_like(beyond), where=width > 0)
    return Looked(study.runs.evaluations, Enclosure(lower, upper, low, high, gap))
