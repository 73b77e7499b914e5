"""The status of joint reactions, and the kinds of findings that it follows from."""

from __future__ import annotations

from enum import StrEnum

from shoal.findings import Kind, Severity


class ReactionsStatus(StrEnum):
    """Status of the reactions at one time, the worst last. Only `ok` is accepted."""

    OK = "ok"
    INACCURATE = "inaccurate"
    UNBALANCED = "unbalanced"
    IMPACT = "impact"


UNBALANCED = Kind(
    "bodies-unbalanced",
    Severity.REJECTION,
    "No forces in the joints balance the bodies.",
    implies=ReactionsStatus.UNBALANCED,
)
IMPACT = Kind(
    "impact-at-this-time",
    Severity.REJECTION,
    "An impact is at this instant: there are impulses, and no forces.",
    "ask for a time before or after it",
    ReactionsStatus.IMPACT,
)
INACCURATE = Kind(
    "forces-inaccurate",
    Severity.REJECTION,
    "The forces depend on the steps: no two runs with other steps agree within a twentieth of the largest force.",
    "use a smaller solver.step, or solver.integrator=dop853 with a smaller solver.relative_tolerance, or earlier times "
    "if the motion is chaotic",
    ReactionsStatus.INACCURATE,
)
NOT_ESTIMATED = Kind(
    "force-error-not-estimated",
    Severity.REJECTION,
    "No other run could be made that shows the errors of the forces.",
    implies=ReactionsStatus.INACCURATE,
)
OTHER_RUN = Kind(
    "forces-of-careful-run",
    Severity.CAUTION,
    "The run as stated is too far off; the forces are those of more careful runs, which agree.",
)
