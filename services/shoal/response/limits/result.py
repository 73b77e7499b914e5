"""Result for a limit: probability or decision, with its known errors, and the verified run that shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from shoal.error_budget import ErrorBudget
from shoal.findings import Finding, message
from shoal.json_values import plain
from shoal.response import findings as kinds
from shoal.response.enclosure import unseen
from shoal.response.inputs import Inputs
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.exceedance import Exceedance
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.limit import Limit, MarginErrors
from shoal.trajectory import Array

NEARLY_SURE = 0.99
"""A limit that is exceeded with a higher probability may have been stated the other way round."""
MOST_BEYOND = 0.25
"""Reliability index by which interval values that were not examined may lie beyond, at most."""


@dataclass(frozen=True)
class VerifiedRun:
    """Verified run at the design point or at the worst interval values of a limit.

    parameters: name -> value; values: path -> value; time [s]: of the least margin; margin: there; status: of the run;
    errors: of its margins, None where they were not estimated; between [s]: when it exceeds the limit although it does
    not at the instants looked at, None where it does not, or was not examined
    """

    parameters: dict[str, float]
    values: dict[str, float]
    time: float
    margin: float
    status: str
    message: str
    errors: MarginErrors | None = None
    between: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        errors = None if self.errors is None else self.errors.budget.to_json()
        return dict(plain({**vars(self), "errors": errors}))


@dataclass(frozen=True)
class ProbabilityBounds:
    """A probability over all values of intervals.

    lower, upper: judged where it is least and largest; at_lower, at_upper: name -> value of the intervals there;
    beyond: by how much the reliability index may be larger than at the one, and smaller than at the other; places:
    interval values that were examined
    """

    lower: LimitResult
    upper: LimitResult
    at_lower: dict[str, float]
    at_upper: dict[str, float]
    beyond: tuple[float, float]
    places: int

    @property
    def estimates(self) -> tuple[float, float]:
        """The least and the largest probability."""
        return self.lower.estimates[0].probability, self.upper.estimates[0].probability

    @property
    def interval(self) -> tuple[float, float]:
        """Interval from the lower end of the one to the upper end of the other, see `LimitResult.interval`."""
        return self.lower.interval[0], self.upper.interval[1]

    @property
    def outer(self) -> tuple[float, float]:
        """The same with what other interval values may add."""
        lower, upper = self.interval
        low, high = special.ndtr(special.ndtri(self.interval) + np.array([-self.beyond[0], self.beyond[1]]))
        return min(lower, float(low)), max(upper, float(high))

    @property
    def findings(self) -> list[Finding]:
        """Reasons for doubt: those of both ends, each once, and interval values that were not examined."""
        both = {one.text: one for one in (*self.lower.reasons, *self.upper.reasons)}
        return [*both.values(), *undecided(max(self.beyond))]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        sides = {}
        for name, one, at in (("lower", self.lower, self.at_lower), ("upper", self.upper, self.at_upper)):
            data = {
                key: value
                for key, value in one.to_json().items()
                if key not in ("limit", "require", "stated", "unit", "method")
            }
            sides[f"at_{name}"] = {"parameters": at, **data}
        (least, largest), (lower, upper), (lower_outer, upper_outer) = self.estimates, self.interval, self.outer
        return {
            "probability_lower": least,
            "probability_upper": largest,
            "lower": lower,
            "upper": upper,
            "lower_outer": lower_outer,
            "upper_outer": upper_outer,
            "confidence": 0.95,
            "interval_values": self.places,
            **sides,
        }


def undecided(beyond: float) -> list[Finding]:
    """Return a finding where interval values that were not examined may change the reliability index too much."""
    if beyond <= MOST_BEYOND:
        return []
    text = f"the interval values that decide are not known: others may change beta by {beyond:.2g}"
    return [kinds.INTERVALS_UNDECIDED.found(text, beta=beyond)]


@dataclass(frozen=True, eq=False)
class LimitResult:
    """Result for one limit.

    way: that was asked for; times [s]; passing: of random parameters, else None; kept: of intervals, whether no values
    exceed it, None where that is not decided; margin, outer: the least that a run attains, and that any may have with
    the known error of the model, nan where not known; shown: the most probable way to exceed it, or the run with the
    least margin; evaluations, failed: runs made for it alone; reason: why the first of these failed; between: of random
    parameters beside intervals; hidden: whether runs would decide it, were the known error of their model not as large
    as the margin; shifted: probability counted in runs if the known error of the model made all margins larger, as they
    are, and if it made them smaller, None where it was not counted
    """

    limit: Limit
    way: str
    inputs: Inputs
    times: Array
    exceedance: Exceedance | None
    kept: bool | None
    margin: float
    outer: float
    shown: VerifiedRun | None
    evaluations: int
    failed: int
    reason: str
    between: ProbabilityBounds | None = None
    hidden: bool = False
    shifted: tuple[float, float, float] | None = None

    @property
    def errors(self) -> ErrorBudget:
        """Known errors of the quantity at the run that is shown; empty where they were not estimated."""
        none = ErrorBudget({}, self.limit.unit)
        return none if self.shown is None or self.shown.errors is None else self.shown.errors.budget

    @property
    def estimates(self) -> list[ExceedanceEstimate]:
        """Probabilities over time: one, or the least and the largest over intervals, none where all are intervals."""
        every = [self] if self.between is None else [self.between.lower, self.between.upper]
        return [one.exceedance.estimate for one in every if one.exceedance is not None]

    @property
    def findings(self) -> list[Finding]:
        """Findings about the result, reasons for doubt first."""
        return [*self.reasons, *self._remarks]

    @property
    def titled(self) -> list[Finding]:
        """Findings that name the limit."""
        return [replace(one, text=f"{self.limit.title}: {one.text}") for one in self.findings]

    @property
    def doubted(self) -> bool:
        """Return whether the result is in doubt."""
        return bool(self.reasons)

    @property
    def reasons(self) -> list[Finding]:
        """Reasons for doubt."""
        if self.between is not None:
            return self.between.findings
        return [*(self._undecided if self.exceedance is None else self._doubtful(self.exceedance)), *self._runs]

    @property
    def _undecided(self) -> list[Finding]:
        """Reasons why intervals do not decide the limit."""
        if self.kept is not None:
            return []
        if not self.hidden:
            return [kinds.UNDECIDED.found("no run exceeds it, and the outer bounds do not show that none does")]
        least = f"the least margin of the runs is {self.margin:.3g} {self.limit.unit}"
        numbers = {"margin": self.margin, "error": self.errors.total or 0.0}
        return [kinds.WITHIN_ERROR.found(f"{least}, and their known error {self.errors}", **numbers)]

    def _doubtful(self, exceedance: Exceedance) -> list[Finding]:
        """Reasons to doubt a probability: of its method, and the error of the model."""
        found, moved = list(exceedance.findings), self.moved
        if self.errors.unknown:
            text = f"the error of the model is not known ({', '.join(self.errors.unknown)})"
            found.append(kinds.ERROR_UNKNOWN.found(text))
        if moved > MOST_BEYOND:
            by = f"may change beta by {moved:.2g}" if math.isfinite(moved) else "decides whether any run exceeds it"
            found.append(kinds.ERROR_DECIDES.found(f"the known error of the model, {self.errors}, {by}", beta=moved))
        return found

    @property
    def _runs(self) -> list[Finding]:
        """Runs for the limit that failed or were refused."""
        found = []
        if self.failed:
            text = f"{self.failed} of {self.evaluations} runs failed even with smaller steps: {self.reason}"
            found.append(kinds.LIMIT_RUNS_FAILED.found(text, failed=self.failed, runs=self.evaluations))
        if self.shown is not None and self.shown.status != "ok":
            text = f"the checks of the run that shows it reject it: {self.shown.message}"
            found.append(kinds.SHOWN_REJECTED.found(text, time=self.shown.time))
        return found

    @property
    def _remarks(self) -> list[Finding]:
        """Findings that leave the result as it is."""
        found = []
        if self.shown is not None and self.shown.between is not None:
            text = f"the run shown exceeds it between the instants looked at, at {self.shown.between:.4g} s"
            found.append(kinds.EXCEEDED_BETWEEN.found(text, time=self.shown.between))
        if self.estimates and (least := min(one.probability for one in self.estimates)) > NEARLY_SURE:
            text = f"{self.limit.text} states what must not happen, and nearly always does"
            if self.limit.is_required:
                text = f"{self.limit.text} is required, and hardly ever holds"
            found.append(kinds.OPPOSITE.found(text, probability=least))
        return found

    def to_json(self) -> dict[str, Any]:
        """An entry of `limits` in what `shoal uncertain --json` prints."""
        found: dict[str, Any] = {
            "limit": self.limit.excluded,
            "require": self.limit.required,
            "stated": self.limit.stated,
            "unit": self.limit.unit,
            "method": self.way,
        }
        if self.between is not None:
            found |= self.between.to_json()
        elif self.exceedance is not None:
            found |= self._probability(self.exceedance)
        else:
            found |= {"kept": self.kept, "margin": self.margin, "margin_outer": self.outer}
        found |= {"evaluations": self.evaluations, "failed": self.failed, "doubt": message(self.reasons)}
        found |= {"findings": [one.to_json() for one in self.findings]}
        return dict(plain({**found, "shown_by": None if self.shown is None else self.shown.to_json()}))

    def _probability(self, exceedance: Exceedance) -> dict[str, Any]:
        estimate = exceedance.estimate
        lower, upper = estimate.interval
        points = [
            {
                "parameters": self._named(point.place),
                "beta": point.beta,
                "probability": point.probability,
                "t": self.times[point.instant] if point.instant >= 0 else None,
                "sensitivity": dict(zip(self.inputs.names, (point.normal**2).tolist(), strict=True)),
                "converged": point.converged,
            }
            for point in exceedance.points
        ]
        return {
            "probability": estimate.probability,
            "lower": self.interval[0],
            "upper": self.interval[1],
            "confidence": 0.95,
            "coefficient_of_variation": estimate.coefficient,
            "unseen": unseen(exceedance.plain) if exceedance.plain else None,
            "between_instants": estimate.between,
            "beta": float(-special.ndtri(estimate.probability)),
            "why": exceedance.why,
            "design_points": points,
            "first_passage": {"t": self.times, "probability": estimate.exceeded, "lower": lower, "upper": upper},
            "probability_with_errors": None if not self.moved else list(self._with_errors(estimate.probability)),
        }

    def _named(self, place: Array) -> dict[str, float]:
        found = self.inputs.named(self.inputs.standard(place[None]))[0]
        return dict(zip(self.inputs.names, found.tolist(), strict=True))

    @property
    def moved(self) -> float:
        """Change of the reliability index that the known error of the model may cause; 0 where none is known.

        To first order at a design point; where there is none, counted in runs.
        """
        if self.exceedance is None or self.shown is None or self.shown.errors is None:
            return 0.0
        if self._point is not None:
            return float(self.shown.errors.over_time[self._point.instant] / self._point.slope)
        if self.shifted is None:
            return 0.0
        fewer, same, more = self.shifted
        return max(
            (abs(float(special.ndtri(one) - special.ndtri(same))) for one in (fewer, more) if one != same), default=0.0
        )

    @property
    def _point(self) -> DesignPoint | None:
        """The design point, None where none was found."""
        points = [] if self.exceedance is None else self.exceedance.points
        return points[0] if points and points[0].converged else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the probability, widened by the known error of the model."""
        (estimate,) = self.estimates
        lower, upper = (float(end[-1]) for end in estimate.interval)
        return self._with_errors(lower)[0], self._with_errors(upper)[1]

    def _with_errors(self, chance: float) -> tuple[float, float]:
        """A probability with the least and the largest reliability index that the error of the model allows."""
        if not self.moved:
            return chance, chance
        fewer, same, more = self.shifted or (0.0, 0.0, 0.0)
        if self._point is None and not 0.0 < same < 1.0:  # all runs or none exceed it: nothing to compare with
            return chance * fewer if same else chance, min(chance + more - same, 1.0)
        if not 0.0 < chance < 1.0:
            return chance, chance
        by = [-self.moved, self.moved] if self._point else special.ndtri([fewer, more]) - special.ndtri(same)
        low, high = special.ndtr(special.ndtri(chance) + np.array(by))
        return float(low), float(high)
