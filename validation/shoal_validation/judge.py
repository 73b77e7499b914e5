"""Classes of runs by their true error, of the stability maps and of the nightly report."""

from __future__ import annotations

from enum import StrEnum

from shoal.trajectory import Status

WRONG = 0.1
"""An error above this fraction of the machine's size is qualitatively wrong, not inaccurate."""


class Outcome(StrEnum):
    """From best to worst."""

    HOLDS = "holds"
    INACCURATE = "inaccurate"
    REFUSED = "refused"
    FAILED = "failed"
    DIVERGED = "diverged"
    DRIFTED = "drifted"
    ENERGY = "energy check failed"
    OUT_OF_REACH = "out of reach"
    SILENT = "silently wrong"


_BY_STATUS = {
    Status.REFUSED: Outcome.REFUSED,
    Status.FAILED: Outcome.FAILED,
    Status.DIVERGED: Outcome.DIVERGED,
    Status.DRIFTED: Outcome.DRIFTED,
    Status.ENERGY: Outcome.ENERGY,
    Status.OUT_OF_REACH: Outcome.OUT_OF_REACH,
}


def judge(status: Status, error: float, size: float, accuracy: float = 1e-3) -> Outcome:
    """The class of a run that ended with a status and whose largest error [m] is known.

    size: the machine's reach [m]; accuracy: relative error up to which a run holds. A run that says `ok` and is off by
    more than a tenth of the size is silently wrong, whatever made it so (a wrong branch included).
    """
    if status is not Status.OK:
        return _BY_STATUS[status]
    if error <= accuracy * size:
        return Outcome.HOLDS
    return Outcome.INACCURATE if error <= WRONG * size else Outcome.SILENT
