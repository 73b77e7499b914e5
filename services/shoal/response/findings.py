"""The status of a response, and the kinds of findings that it follows from."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from shoal.findings import Finding, cautions, rejects, worst_implied


class ResponseStatus(StrEnum):
    """Use that can be made of a response, the worst last. Only the first is an answer."""

    OK = "ok"
    ALLOCATION = "allocation-not-met"
    LIMIT = "limit-in-doubt"
    DEVIATION = "deviation-in-doubt"
    GAP = "gap-not-reached"
    HORIZON = "beyond-horizon"
    REJECTED = "model-rejected"
    RUNS = "failed-runs"
    TIME = "time-limit"


def status_of(findings: Iterable[Finding]) -> ResponseStatus:
    """Return the worst status that findings imply; ok where none implies any."""
    return worst_implied(findings, ResponseStatus)


def in_order(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings sorted by the status that they imply, the decisive first."""
    order = list(ResponseStatus)
    return sorted(findings, key=lambda one: -order.index(ResponseStatus(one.kind.implies or ResponseStatus.OK)))


_MORE = "allow more runs (--limit-runs)"
_MODEL = "state a tolerance, so that a better model is chosen (--tolerance)"

# The study itself.
TIME_OVER = rejects(
    "time-over",
    ResponseStatus.TIME,
    "The time limit was reached before the study was complete.",
    "allow more time; with --checkpoint the same study continues where it ended",
)
RUNS_FAILED = rejects(
    "runs-failed",
    ResponseStatus.RUNS,
    "Some runs failed, with smaller steps too, so that statistics and bounds leave them out.",
    "narrow the parameters to values with which the machine can be assembled and moves",
)
MODEL_REJECTED = rejects(
    "model-rejected",
    ResponseStatus.REJECTED,
    "A decisive run was repeated more carefully, and its checks reject the model or its steps.",
    "refine the mesh, shorten the step, or " + _MODEL,
)
BEYOND_HORIZON = rejects(
    "beyond-horizon",
    ResponseStatus.HORIZON,
    "Beyond a horizon small changes of the parameters change the motion so much that no surrogate follows.",
    "end the study at the horizon (--at), or narrow the parameters",
)
GAP_NOT_REACHED = rejects(
    "gap-not-reached",
    ResponseStatus.GAP,
    "Outer and attained bounds are further apart than was asked for.",
    "allow more runs (--runs), or ask for a larger gap",
)
DEVIATION_IN_DOUBT = rejects(
    "deviation-in-doubt",
    ResponseStatus.DEVIATION,
    "Standard deviations over interval values are known roughly only.",
    "allow more runs (--runs), or narrow the intervals",
)
OUTER_UNKNOWN = cautions(
    "outer-bounds-unknown",
    "Bounds are those of runs; the method does not estimate how far beyond them other values lie.",
    "use a method with outer bounds, such as --method auto",
)
RARE_MISSED = cautions(
    "rare-values-missed",
    "The probability of a limit implies a larger standard deviation than the statistics; their errors are enlarged.",
)
DIFFERENT_EVENTS = cautions(
    "different-events",
    "Runs have different sequences of events of contacts, each in a part of the parameters of its own; rarer ones may "
    "be unseen.",
)
STARTS_ELSEWHERE = cautions(
    "starts-elsewhere",
    "Some runs start elsewhere than stated, because their joints could not be closed there.",
    "narrow the parameters, or leave the start of the bodies named to a guess",
)

# Limits: their probability or decision is in doubt.
UNDECIDED = rejects(
    "limit-undecided",
    ResponseStatus.LIMIT,
    "No run exceeds the limit, and the outer bounds do not show that none does.",
    "allow more runs (--runs), or ask for a smaller gap (--gap)",
)
WITHIN_ERROR = rejects(
    "limit-within-error",
    ResponseStatus.LIMIT,
    "The known error of the model is as large as the least margin to the limit.",
    _MODEL,
)
ERROR_UNKNOWN = rejects(
    "limit-error-unknown",
    ResponseStatus.LIMIT,
    "An error of the model was not estimated for the quantity of the limit.",
)
ERROR_DECIDES = rejects(
    "limit-error-decides",
    ResponseStatus.LIMIT,
    "The known error of the model may change the reliability index by more than a quarter.",
    _MODEL,
)
LIMIT_RUNS_FAILED = rejects(
    "limit-runs-failed",
    ResponseStatus.LIMIT,
    "Some runs for the limit failed, with smaller steps too.",
    "narrow the parameters to values with which the machine can be assembled and moves",
)
SHOWN_REJECTED = rejects(
    "limit-run-rejected",
    ResponseStatus.LIMIT,
    "The run at the design point, or with the least margin, was refused or its checks reject it.",
)
INTERVALS_UNDECIDED = rejects(
    "interval-values-undecided",
    ResponseStatus.LIMIT,
    "Interval values that were not examined may change the reliability index by more than a quarter.",
    "narrow the intervals, or " + _MORE,
)
NO_DESIGN_POINT = rejects(
    "no-design-point",
    ResponseStatus.LIMIT,
    "FORM found no design point: no place where the limit is exceeded.",
    "use --limit-method auto or subset",
)
FORM_NOT_CONVERGED = rejects(
    "form-not-converged",
    ResponseStatus.LIMIT,
    "The search of FORM for the design point did not converge.",
    "use --limit-method auto",
)
SEVERAL_DESIGN_POINTS = rejects(
    "several-design-points",
    ResponseStatus.LIMIT,
    "Several design points were found, and FORM takes the nearest only.",
    "use --limit-method auto",
)
DESIGN_POINTS_MISSED = rejects(
    "design-points-missed",
    ResponseStatus.LIMIT,
    "The search for design points had not ended, so that some may be missing.",
    _MORE,
)
NONE_EXCEEDS = rejects(
    "none-exceeds-at-design-point",
    ResponseStatus.LIMIT,
    "No run around a design point exceeds the limit.",
    _MORE,
)
CONTRADICTED = rejects(
    "contradicted-by-runs",
    ResponseStatus.LIMIT,
    "A binomial test of runs drawn from the distributions contradicts the probability.",
    _MORE,
)
ESTIMATES_DIFFER = rejects(
    "estimates-differ",
    ResponseStatus.LIMIT,
    "Two independent estimates of the probability differ by more than chance explains.",
    _MORE,
)
COARSE = rejects(
    "coarse-probability",
    ResponseStatus.LIMIT,
    "The coefficient of variation of the probability is large.",
    _MORE,
)
EXCEEDED_BETWEEN = cautions(
    "exceeded-between-instants",
    "The run with the least margin exceeds the limit between the instants examined.",
    "state more instants (--at)",
)
OPPOSITE = cautions(
    "nearly-always-exceeded",
    "The limit is exceeded nearly always: it may have been stated the other way round.",
    "state what must hold as a requirement (--require), what must not happen as a limit (--limit)",
)

# Allocation of tolerances.
NOT_MET = rejects(
    "allocation-not-met",
    ResponseStatus.ALLOCATION,
    "No tolerances were found with which the limit is kept.",
    "allow a larger probability (--target), or move the limit",
)
TIGHT = rejects(
    "allocation-too-tight",
    ResponseStatus.ALLOCATION,
    "The allocated tolerances keep the limit with a probability far below the target: wider ones may do.",
)
UNCONFIRMED = rejects(
    "allocation-unconfirmed",
    ResponseStatus.ALLOCATION,
    "The probability with the allocated tolerances is in doubt.",
    _MORE,
)
