"""The status of joint reactions, and the kinds of findings that it follows from."""

from __future__ import annotations

from enum import StrEnum

from shoal.findings import cautions, rejects


class ReactionsStatus(StrEnum):
    """Status of the reactions at one time, the worst last. Only `ok` is accepted."""

    OK = "ok"
    INACCURATE = "inaccurate"
    UNBALANCED = "unbalanced"
    IMPACT = "impact"


UNBALANCED = rejects(
    "bodies-unbalanced",
    ReactionsStatus.UNBALANCED,
    "No forces in the joints balance the bodies.",
)
IMPACT = rejects(
    "impact-at-this-time",
    ReactionsStatus.IMPACT,
    "An impact is at this instant: there are impulses, and no forces.",
    "ask for a time before or after it",
)
INACCURATE = rejects(
    "forces-inaccurate",
    ReactionsStatus.INACCURATE,
    "The forces depend on the steps: no two runs with other steps agree within a twentieth of the largest force.",
    "use a smaller solver.step, or solver.integrator=dop853 with a smaller solver.relative_tolerance, or earlier times "
    "if the motion is chaotic",
)
NOT_ESTIMATED = rejects(
    "force-error-not-estimated",
    ReactionsStatus.INACCURATE,
    "No other run could be made that shows the errors of the forces.",
)
OTHER_RUN = cautions(
    "forces-of-careful-run",
    "The run as stated is too far off; the forces are those of more careful runs, which agree.",
)
