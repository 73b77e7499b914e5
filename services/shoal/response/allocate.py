"""Allocation of tolerances where some parameters, or all, are random.

The largest probability over the intervals is what must stay below the target. In the standard normal space of the
random parameters the margin is least, at the distance of the target's reliability index, at a place that always exists
(`limits.form.nearest`). There a parameter moves the margin by its tolerance times what the place stands for, which to
first order in the place is a share of its own, as of an interval, and one that scatters:

    sum of pull_i s_i + beta |spread s| <= room

with factors s on the tolerances. It is exact where the margin is linear and the parameters are intervals, normal or
correlated normal. It is convex in the factors, as is the cost (Boyd, Kim, Vandenberghe and Hassibi, A tutorial on
geometric programming, Optimization and Engineering 8, 2007, for its form in logarithms), so that the cheapest factors
are known; there the model is asked again. The distance is corrected, either way, by the probability that a study of the
limit gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from shoal.errors import ComputationError
from shoal.findings import Finding, message
from shoal.response import findings as kinds
from shoal.response.allocation import (
    MANY,
    ROUNDS,
    SETTLED,
    STEP,
    TARGET,
    TIGHTEST,
    Allocation,
    Cut,
    LeastMargin,
    accepted,
    cheapest,
    costs_of,
    of_intervals,
    unattainable,
    with_factors,
)
from shoal.response.assess import GAP, MORE, PLACES, between, bound_margins, options
from shoal.response.inputs import Inputs
from shoal.response.limits import MOST, Limit, LimitResult
from shoal.response.limits.choice import probability
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.form import Nearest, design_points, nearest
from shoal.response.limits.judge import watched
from shoal.response.limits.margins import FAR, Margins, least
from shoal.response.limits.result import undecided
from shoal.response.machine import ResponseModel
from shoal.response.problem import UncertainProblem
from shoal.response.respond import respond
from shoal.response.runs import Answers, TimeIsUpError
from shoal.trajectory import Array

MARGIN = 0.01
"""Share of the reliability index that is aimed at in addition where a confirming study misses the target."""
NEAR, OFF = 0.9, 0.5
"""Shares of the target from which a probability attains it, and below which tolerances are reported as too tight."""


@dataclass(frozen=True)
class Deciding:
    """Decisive values of the parameters, and the fall of the margin there as tolerances grow.

    xi: of the intervals; place: of the random parameters; falls: if each tolerance doubles, to first order,
    (parameters,); beyond: by how much the reliability index may be less at other interval values
    """

    xi: Array
    place: Nearest
    falls: Array
    beyond: float

    def cut(self, inputs: Inputs, factors: Array, beta: float) -> Cut:
        """beta: the distance of the place. inputs: with their tolerances multiplied by the factors."""
        root, normal, standard = inputs.root, np.zeros(len(inputs)), np.zeros(len(inputs))
        normal[inputs.random], standard[inputs.random] = self.place.normal, self.place.place
        each = self.place.slope * np.linalg.solve(root.T, normal)
        pull, spread = (self.falls - each * (root @ standard)) / factors, root.T * (each / factors)
        return Cut(pull, spread, self.place.margin + float(pull @ factors) + beta * self.place.slope)

    def effects(self, beta: float) -> Array:
        """Return the share by which the probability falls if a tolerance becomes one per cent smaller, (parameters,).

        beta: the index of that probability. It grows by as many standard deviations as the margin does.
        """
        if not self.place.slope > 0:
            return np.zeros(len(self.falls))
        grown = beta + 0.01 * self.falls / self.place.slope
        return np.asarray(-np.expm1(special.log_ndtr(-grown) - special.log_ndtr(-beta)))


@dataclass(frozen=True)
class Confirmed:
    """Probability with these factors. reasons: for doubt about it."""

    factors: Array
    estimate: ExceedanceEstimate
    reasons: list[Finding]

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the probability."""
        lower, upper = self.estimate.interval
        return float(lower[-1]), float(upper[-1])

    def near(self, target: float) -> bool:
        """Return whether the probability is the target within its interval, and not above."""
        chance = self.estimate.probability
        return 0 < chance <= target <= max(chance / NEAR, float(np.nan_to_num(self.interval[1])))

    def kept(self, target: float) -> bool:
        """Return whether the probability is not above the target."""
        return self.estimate.probability <= target

    def findings(self, target: float, widest: Array) -> list[Finding]:
        """Return reasons against the answer."""
        chance = self.estimate.probability
        text, numbers = f"the probability is {chance:.2e} with the tolerances that were found", {"probability": chance}
        if not self.kept(target):
            return [kinds.NOT_MET.found(text, **numbers)]
        if chance < OFF * target and not self.near(target) and np.any(self.factors < widest):
            return [kinds.TIGHT.found(f"{text}, of {target:g} that are allowed: wider ones may do", **numbers)]
        return [kinds.UNCONFIRMED.found(message(self.reasons), **numbers)] if self.reasons else []


def of_random(
    limit: Limit,
    machine: ResponseModel,
    inputs: Inputs,
    stated: LimitResult,
    target: float,
    costs: Array,
    widest: Array,
    **how: Any,
) -> Allocation:
    """Allocate tolerances so that the limit is exceeded with a probability of at most `target` at all interval values.

    stated: what is known of the limit with the stated tolerances; widest: factors; how: of `between`. Raises
    InputError, ComputationError.
    """
    model, seed = watched(machine, limit), how["seed"]
    middle = model(inputs.values(_xi(inputs, np.zeros(int((~inputs.random).sum())), None)))
    if least(middle.values)[0] <= 0:
        raise unattainable(limit.required)
    chance = stated.estimates[-1].probability
    factors, spent, effects = np.ones(len(inputs)), 1, np.zeros(len(inputs))
    if chance > 0:
        index = float(np.clip(-special.ndtri(chance), -FAR, FAR))
        found, spent = _deciding(limit, machine, inputs, index, seed, on=True)
        effects = found.effects(index)
    wanted = -float(special.ndtri(target))
    aim = wanted
    cuts: dict[tuple[float, ...], Cut] = {}
    confirmations = list[Confirmed]()
    for _ in range(ROUNDS):
        here = with_factors(inputs, factors)
        found, runs = _deciding(limit, machine, here, aim, seed)
        spent += runs
        cut = found.cut(here, factors, aim)
        if cut.room <= 0:
            # Too bent for a first-order form; nearer to the middle values, which keep the limit, it is less so.
            factors = np.maximum(0.5 * factors, TIGHTEST)
            continue
        # The margin at each corner of the intervals falls by slopes of its own.
        cuts[tuple(np.sign(np.round(found.xi, 3)))] = cut
        fresh = cheapest(list(cuts.values()), costs, aim, widest)
        settled = np.max(np.abs(fresh / factors - 1)) < SETTLED
        factors = fresh
        if not settled:
            continue
        confirmed, runs = _confirmed(limit, machine, inputs, factors, found.beyond, **how)
        spent += runs
        confirmations.append(confirmed)
        if confirmed.near(target) or (confirmed.kept(target) and np.all(factors >= widest)):
            break
        off = float(np.nan_to_num(-special.ndtri(confirmed.estimate.probability), posinf=FAR)) - wanted
        aim = max(aim - min(max(off - MARGIN, -1.0), 1.0), 0.1 * wanted)
    if not confirmations:
        confirmed, runs = _confirmed(limit, machine, inputs, factors, found.beyond, **how)
        spent += runs
        confirmations.append(confirmed)
    best = min(confirmations, key=lambda one: (not one.kept(target), float(costs @ (1 / one.factors))))
    return Allocation(
        required=limit.required,
        inputs=inputs,
        factors=best.factors,
        effects=effects,
        stated=chance,
        confirmed=best.estimate.probability,
        target=target,
        cost=float(costs @ (1 / best.factors) / costs.sum()),
        evaluations=spent,
        findings=best.findings(target, widest),
        interval=best.interval,
    )


def _xi(inputs: Inputs, xi: Array, place: Array | None) -> Array:
    """Return xi of all parameters, (1, parameters): of the intervals, and of a place of the random ones or their
    middle.
    """
    found = np.zeros((1, len(inputs)))
    found[0, ~inputs.random] = xi
    if inputs.random.any():
        random = inputs.some(inputs.random)
        found[:, inputs.random] = random.standard(np.zeros((1, len(random))) if place is None else place[None])
    return found


def _deciding(
    limit: Limit, machine: ResponseModel, inputs: Inputs, beta: float, seed: int, *, on: bool = False
) -> tuple[Deciding, int]:
    """Find the least margin over the intervals and at that distance of the random parameters; also return the runs
    made.

    on: at the place on the limit beside it, which lies at another distance where the limit bends
    """
    random, made = inputs.some(inputs.random), 0

    def near(values: Mapping[str, Array], k: int = 0, on: bool = False) -> Nearest:
        nonlocal made
        here = machine.at({path: float(at[k]) for path, at in values.items()})
        margins = Margins(watched(here, limit), random, MANY)
        found = nearest(margins, beta, seed)
        points = design_points(margins, found.place[None]) if on else []
        if points and points[0].converged:
            found = Nearest(points[0].place, points[0].normal, points[0].slope, 0.0, points[0].instant)
        made += margins.evaluations
        return found

    def margin(values: Mapping[str, Array]) -> Answers:
        found = np.array([[near(values, k).margin] for k in range(len(next(iter(values.values()))))])
        return Answers(found, np.isfinite(found[:, 0]))

    xi, beyond = np.zeros(0), 0.0
    if inputs.mixed:
        given = inputs.some(~inputs.random)
        answer = respond(margin, given, 1, gap=GAP, seed=seed, most=PLACES + MORE * len(given))
        xi = answer.runs.xi[int(answer.runs.values[:, 0].argmin())]
        place = near(given.values(xi[None]), on=on)
        assert answer.bounds is not None
        beyond = float(answer.bounds.lower[0] - answer.bounds.lower_outer[0]) / max(place.slope, 1e-300)
    else:
        place = near({}, on=on)
    falls = _falls(watched(machine, limit), inputs, _xi(inputs, xi, place.place), place.instant)
    return Deciding(xi, place, falls, beyond), made + 2 * len(inputs) + 1


def _falls(model: ResponseModel, inputs: Inputs, xi: Array, instant: int) -> Array:
    """Return by how much the margin falls at xi, (1, parameters), if each tolerance doubles, to first order,
    (parameters,).

    From narrower ones, as wider ones may reach where the machine has no sense.
    """
    tried = [np.ones(len(inputs)), *(1 - share * row for share in (STEP, 2 * STEP) for row in np.eye(len(inputs)))]
    runs = [with_factors(inputs, factors).values(xi) for factors in tried]
    answers = model({path: np.concatenate([one[path] for one in runs]) for path in runs[0]})
    if not answers.good.all():
        raise ComputationError(f"allocate: runs beside the worst one failed: {answers.why}")
    middle, (once, twice) = answers.values[0, instant], answers.values[1:, instant].reshape(2, -1)
    return np.asarray((4 * once - twice - 3 * middle) / (2 * STEP))


def _confirmed(
    limit: Limit, machine: ResponseModel, inputs: Inputs, factors: Array, beyond: float, **how: Any
) -> tuple[Confirmed, int]:
    """Confirm factors by the largest probability over the intervals; also return the runs. beyond: of `Deciding`."""
    here = with_factors(inputs, factors)
    if not inputs.mixed:
        margins = Margins(watched(machine, limit), here, MOST)
        exceedance = probability(margins, "auto", how["seed"])
        return Confirmed(factors, exceedance.estimate, exceedance.findings), margins.evaluations
    found = between(limit, machine, here, **{**how, "verify": False, "progress": None})
    assert found.between is not None
    largest = found.between.upper
    # The index has no bound where a limit cannot be exceeded, and no polynomial follows it there; the margin has.
    reasons = [*largest.reasons, *undecided(min(found.between.beyond[1], beyond))]
    return Confirmed(factors, largest.estimates[0], reasons), found.evaluations


def allocate(problem: UncertainProblem, results: Sequence[LimitResult]) -> Allocation | None:
    """Return the cheapest tolerances that keep the limit, where they are asked for and there is time.

    Raises InputError, ComputationError.
    """
    if problem.asked.allocate and results:
        with suppress(TimeIsUpError):
            return _allocated(problem, results[0])
    return None


def _allocated(problem: UncertainProblem, stated: LimitResult) -> Allocation:
    """Stated: the result with the stated tolerances."""
    limit, model, inputs, asked = stated.limit, problem.model, problem.inputs, problem.asked
    prices, widest = costs_of(asked.cost or {}, inputs), accepted(model.scene, inputs)
    if inputs.random.any():
        target = TARGET if asked.target is None else asked.target
        return of_random(limit, model, inputs, stated, target, prices, widest, **options(problem))
    # Tolerances that keep the limit keep it by the known error of the model.
    margins = watched(model, limit.tightened(stated.errors.total or 0.0))

    def least(here: Inputs) -> LeastMargin:
        lower, outer, xi, evaluations, _ = bound_margins(problem, here, None)(margins, abs(limit.bound))
        worst = int(lower.argmin())
        return LeastMargin(float(outer.min()), float(lower[worst]), xi[worst], evaluations)

    return of_intervals(limit.required, margins, inputs, least, prices, widest)
