"""Result for a limit: probability or decision, with its known errors, and the verified run that shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from shoal.error_budget import ErrorBudget
from shoal.response.control import unseen
from shoal.response.inputs import Inputs
from shoal.response.limits.choice import Passing
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.limit import Limit
from shoal.response.limits.margin_errors import MarginErrors
from shoal.trajectory import Array, plain

NEARLY_SURE = 0.99
"""A limit that is passed with a higher probability may have been stated the other way round."""
MOST_BEYOND = 0.25
"""Reliability index by which interval values that were not looked at may lie beyond, and no more."""


@dataclass(frozen=True)
class Shown:
    """Verified run at the design point or at the worst interval values of a limit.

    parameters: name -> value; values: path -> value; time [s]: of the least margin; margin: there; status: of the run;
    errors: of its margins, None where they were not estimated; between [s]: when it passes the limit although it does
    not at the instants looked at, None where it does not, or nobody has looked
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
class Between:
    """A probability over all values of intervals.

    lower, upper: judged where it is least and largest; at_lower, at_upper: name -> value of the intervals there;
    beyond: by how much the reliability index may be larger than at the one, and smaller than at the other; places:
    interval values that were looked at
    """

    lower: Judged
    upper: Judged
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
        """From the lower end of the one to the upper end of the other, see `Judged.interval`."""
        return self.lower.interval[0], self.upper.interval[1]

    @property
    def outer(self) -> tuple[float, float]:
        """The same with what other interval values may add."""
        lower, upper = self.interval
        low, high = special.ndtr(special.ndtri(self.interval) + np.array([-self.beyond[0], self.beyond[1]]))
        return min(lower, float(low)), max(upper, float(high))

    @property
    def doubt(self) -> str:
        """Why it should not be believed, empty if it may be."""
        if found := self.lower.reason_to_doubt or self.upper.reason_to_doubt:
            return found
        return undecided(max(self.beyond))

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        sides = {}
        for name, one, at in (("lower", self.lower, self.at_lower), ("upper", self.upper, self.at_upper)):
            told = {
                key: value
                for key, value in one.to_json().items()
                if key not in ("limit", "require", "stated", "unit", "method")
            }
            sides[f"at_{name}"] = {"parameters": at, **told}
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


def undecided(beyond: float) -> str:
    """Return whether so much of a reliability index is too much for interval values that were not looked at, in
    words.
    """
    if beyond <= MOST_BEYOND:
        return ""
    return f"the interval values that decide are not known: others may change beta by {beyond:.2g}"


@dataclass(frozen=True, eq=False)
class Judged:
    """Result for one limit.

    way: that was asked for; times [s]; passing: of random parameters, else None; kept: of intervals, whether no values
    pass it, None where that is not decided; margin, outer: the least that a run attains, and that any may have with the
    known error of the model, nan where not known; shown: the most probable way to pass it, or the run with the least
    margin; evaluations, failed: runs made for it alone; reason: why the first of these failed; between: of random
    parameters beside intervals; hidden: whether runs would decide it, were the known error of their model not as large
    as the margin; shifted: probability counted in runs if the known error of the model made all margins larger, as they
    are, and if it made them smaller, None where it was not counted
    """

    limit: Limit
    way: str
    inputs: Inputs
    times: Array
    passing: Passing | None
    kept: bool | None
    margin: float
    outer: float
    shown: Shown | None
    evaluations: int
    failed: int
    reason: str
    between: Between | None = None
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
        return [one.passing.estimate for one in every if one.passing is not None]

    @property
    def note(self) -> str:
        """Remark for the user, empty if there is none."""
        if self.shown is not None and self.shown.between is not None:
            return f"the run shown passes it between the instants looked at, at {self.shown.between:.4g} s: state more"
        if not self.estimates or not min(one.probability for one in self.estimates) > NEARLY_SURE:
            return ""
        if self.limit.is_required:
            return f"{self.limit.text} is required, and hardly ever holds: is it what must not happen (--limit)?"
        return f"{self.limit.text} states what must not happen, and nearly always does: is it required (--require)?"

    @property
    def doubt(self) -> str:
        """Why it should not be believed, empty if it may be."""
        found = self.reason_to_doubt
        return f"{self.limit.title}: {found}" if found else ""

    @property
    def reason_to_doubt(self) -> str:
        """The same without the limit's name."""
        if self.between is not None:
            return self.between.doubt
        found = self.passing.doubt if self.passing is not None else ""
        if self.passing is None and self.kept is None:
            found = "no run passes it, and the outer bounds do not show that none does"
            if self.hidden:
                least = f"the least margin of the runs is {self.margin:.3g} {self.limit.unit}"
                found = f"{least}, and their known error {self.errors}; --tolerance finds a better model"
        if not found and self.errors.unknown and self.passing is not None:
            found = f"the error of the model is not known ({', '.join(self.errors.unknown)})"
        if not found and (moved := self.moved) > MOST_BEYOND:
            found = f"the known error of the model, {self.errors}, " + (
                f"may change beta by {moved:.2g}" if math.isfinite(moved) else "decides whether any run passes it"
            )
        if not found and self.failed:
            found = f"{self.failed} of {self.evaluations} runs failed even with smaller steps: {self.reason}"
        if not found and self.shown is not None and self.shown.status != "ok":
            found = f"the run that shows it is not borne out: {self.shown.message}"
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
        elif self.passing is not None:
            found |= self._probability(self.passing)
        else:
            found |= {"kept": self.kept, "margin": self.margin, "margin_outer": self.outer}
        found |= {"evaluations": self.evaluations, "failed": self.failed, "doubt": self.doubt, "note": self.note}
        return dict(plain({**found, "shown_by": None if self.shown is None else self.shown.to_json()}))

    def _probability(self, passing: Passing) -> dict[str, Any]:
        estimate = passing.estimate
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
            for point in passing.points
        ]
        return {
            "probability": estimate.probability,
            "lower": self.interval[0],
            "upper": self.interval[1],
            "confidence": 0.95,
            "coefficient_of_variation": estimate.coefficient,
            "unseen": unseen(passing.plain) if passing.plain else None,
            "between_instants": estimate.between,
            "beta": float(-special.ndtri(estimate.probability)),
            "why": passing.why,
            "design_points": points,
            "first_passage": {"t": self.times, "probability": estimate.passed, "lower": lower, "upper": upper},
            "probability_with_errors": None if not self.moved else list(self._with_errors(estimate.probability)),
        }

    def _named(self, place: Array) -> dict[str, float]:
        found = self.inputs.named(self.inputs.standard(place[None]))[0]
        return dict(zip(self.inputs.names, found.tolist(), strict=True))

    @property
    def moved(self) -> float:
        """By how much the known error of the model may change the reliability index; 0 where none is known.

        To first order at a design point; where there is none, counted in runs.
        """
        if self.passing is None or self.shown is None or self.shown.errors is None:
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
        points = [] if self.passing is None else self.passing.points
        return points[0] if points and points[0].converged else None

    @property
    def interval(self) -> tuple[float, float]:
        """Between which two the probability lies, with 95 % confidence and the known error of the model."""
        (estimate,) = self.estimates
        lower, upper = (float(end[-1]) for end in estimate.interval)
        return self._with_errors(lower)[0], self._with_errors(upper)[1]

    def _with_errors(self, chance: float) -> tuple[float, float]:
        """A probability with the least and the largest reliability index that the error of the model allows."""
        if not self.moved:
            return chance, chance
        fewer, same, more = self.shifted or (0.0, 0.0, 0.0)
        if self._point is None and not 0.0 < same < 1.0:  # all runs or none pass: nothing to compare with
            return chance * fewer if same else chance, min(chance + more - same, 1.0)
        if not 0.0 < chance < 1.0:
            return chance, chance
        by = [-self.moved, self.moved] if self._point else special.ndtri([fewer, more]) - special.ndtri(same)
        low, high = special.ndtr(special.ndtri(chance) + np.array(by))
        return float(low), float(high)
