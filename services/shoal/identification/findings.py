"""The verdict of an identification, and the kinds of findings that it follows from."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from shoal.findings import Finding, cautions, limits, notes, rejects, worst_implied

_ALLOW = "allow more time"
_ANOTHER = "look for another minimum (--method multi-start)"


class Verdict(StrEnum):
    """Verdict on an estimate, the worst last. Only the first three are answers."""

    IDENTIFIED = "identified"
    PARTLY = "partly identified"
    COMBINATION = "identified up to a combination"
    AMBIGUOUS = "ambiguous"
    REJECTED = "model rejected"
    UNFINISHED = "not at a minimum"
    FAILED = "failed"

    @property
    def trusted(self) -> bool:
        """Return whether the answer can be used."""
        return self in (Verdict.IDENTIFIED, Verdict.PARTLY, Verdict.COMBINATION)


def verdict_of(findings: Iterable[Finding]) -> Verdict:
    """Return the worst verdict that findings imply; identified where none implies any."""
    return worst_implied(findings, Verdict)


# No answer: the search failed or did not end.
STOPPED = rejects(
    "search-stopped",
    Verdict.FAILED,
    "The search was stopped before its end.",
    "allow more time, or start from a better place",
)
NOT_SIMULATED = rejects("not-simulated", Verdict.FAILED, "No parameter set could be simulated.")
TOO_FEW = rejects(
    "too-few-samples",
    Verdict.FAILED,
    "There are too few measured numbers for the parameters to estimate an uncertainty.",
    "measure more, or state the noise of the channels",
)
BETTER_MINIMUM = rejects("better-minimum", Verdict.FAILED, "A refit met a better minimum than the answer.", _ANOTHER)
NO_TIME = rejects(
    "no-time-to-judge", Verdict.FAILED, "The time limit was reached before the answer was judged.", _ALLOW
)
NO_CONVERGENCE = rejects(
    "no-convergence",
    Verdict.FAILED,
    "The search ended where it had not converged.",
    "start from a better place, or look for another minimum (--method multi-start)",
)
BETTER_FOLLOWED = notes(
    "better-minimum-followed", "A diagnostic met a better minimum, from which the search went on to this answer."
)
SEARCH_ENDED = notes("search-ended", "How the search ended, where there is something to say about it.")
OUT_OF_BOUNDS = rejects(
    "out-of-bounds",
    Verdict.UNFINISHED,
    "The search ended outside the bounds of a parameter.",
    "end the search by least squares, as --method hybrid, auto and least-squares do",
)
NOT_STATIONARY = rejects(
    "not-stationary",
    Verdict.UNFINISHED,
    "A Gauss-Newton step from the answer lowers the fitness by more than noise explains.",
    "end the search by least squares, as --method hybrid, auto and least-squares do",
)
BEGINNING_ONLY = rejects(
    "fits-the-beginning-only",
    Verdict.UNFINISHED,
    "The model fits as far as its derivatives are reliable, and misfits beyond.",
)

# No answer: the model is refuted, or another answer fits as well.
MISFIT = rejects(
    "misfit",
    Verdict.REJECTED,
    "The best fit leaves a residual that noise and the error of the mesh do not explain.",
    _ANOTHER,
)
CONTRADICTED = rejects(
    "stated-value-contradicted",
    Verdict.REJECTED,
    "A score test contradicts a value that the scene or the problem states, and the answer depends on it.",
)
HELD_OUT_REFUTES = rejects(
    "held-out-data-refute",
    Verdict.REJECTED,
    "A window of the data that was held out is predicted so badly that the model is refuted.",
)
SEVERAL_MINIMA = rejects("several-minima", Verdict.AMBIGUOUS, "Several parameter sets fit equally well.")

# An answer for a part of the parameters.
AT_BOUND = limits(
    "at-bound",
    Verdict.PARTLY,
    "A parameter ended at one of its bounds.",
    "widen the bound, or give the parameter its value there",
)
CONFOUNDED = limits(
    "confounded",
    Verdict.COMBINATION,
    "Some changes of the parameters leave the motion unchanged: only combinations are identifiable.",
    "fix one parameter of each combination, or rely on the quantities that are identifiable",
)
VAGUE = limits(
    "not-identifiable",
    Verdict.PARTLY,
    "The data narrow a parameter no further than its bounds do.",
    "measure longer or with less noise, or add what is known as a prior",
)

# Causes of a misfit.
CAUSE = cautions("likely-cause", "A stated value that would lower the misfit if it were another.")
PRIOR = cautions("prior-contradicted", "The data contradict the prior of a parameter.")
ODD_RECORDING = cautions("odd-recording", "One of several recordings contradicts the others.")
ODD_STRETCH = cautions("odd-stretch", "A stretch of the samples of one marker or sensor contradicts the rest.")

# Limits of an answer.
ROUGH = cautions("unreliable-derivatives", "Derivatives by two step sizes differ, so that intervals are in doubt.")
SYSTEMATIC = cautions(
    "systematic-residual", "The residual holds more than noise; the intervals are widened by what is systematic in it."
)
NOISE_UNDERSTATED = notes(
    "noise-understated", "The residual is white noise, but larger than stated; intervals use the residual."
)
UNRESOLVED = cautions("motion-not-resolved", "The samples do not resolve the motion, so that no noise can be seen.")
OPEN_PROFILE = cautions("better-on-profile", "A profile likelihood passed through a better fit than the answer.")
CURVED = notes("curved-misfit", "The misfit is no parabola within an interval, which follows the profile instead.")
MESH_ERROR = cautions("mesh-error", "The error of the mesh is as large as the noise or the residual.")
TIME_ERROR = cautions("time-error", "The error of the time steps limits the fit or widens an interval.")
THEORY_ERROR = cautions("theory-error", "Neglected shear and rotary inertia widen an interval.")
WIDER_THAN_NOISE = notes("wider-than-noise", "Intervals hold more than noise, standard deviations noise alone.")
OTHER_LAW = cautions("other-friction-law", "Another friction law would move a parameter beyond its interval.")
UNCERTAIN_INPUT = cautions(
    "uncertain-input", "The uncertainty of a measured input or a stated value widens an interval."
)

# Posterior and prediction.
NO_POSTERIOR = cautions("no-posterior", "No posterior was drawn.")
NOT_MIXED = cautions("posterior-not-converged", "The Markov chains of the posterior have not converged.")
POSTERIOR_DIFFERS = notes("posterior-differs", "The central 95 % of the posterior are not the interval.")
FIRST_MODE = cautions("posterior-of-first-mode", "The draws are about the first of several minima.")
MISPREDICTED = cautions(
    "mispredicted",
    "A window of the data that was held out is predicted worse than the estimate states.",
    "look for what the model leaves out: a prediction is worse than the estimate states",
)
PREDICTION = notes("prediction", "How well a window of the data that was held out is predicted.")
