"""How wide tolerances may be where some parameters are intervals and others random.

The largest probability over the intervals is what must stay below the target. To first order, about the design point at
the interval values where the reliability index is least, an interval moves the margin by its whole tolerance and a
random parameter adds the square of its share to the variance of the margin:

    sum of pull_i s_i + beta sqrt(sum of (spread_j s_j)^2) <= room

with factors s on the tolerances. That and the cost are convex in the logarithms of the factors (Boyd, Kim, Vandenberghe
and Hassibi, A tutorial on geometric programming, Optimization and Engineering 8, 2007), so that the cheapest factors
are known; there the model is asked again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize, special

from shoal.errors import ComputationError
from shoal.response.allocation import MANY, ROUNDS, SETTLED, STEP, TIGHTEST, Allocation, passed, with_factors
from shoal.response.between import between, searched
from shoal.response.inputs import Inputs
from shoal.response.limits import Limit
from shoal.response.limits.form import DesignPoint, design_points
from shoal.response.limits.judge import watched
from shoal.response.limits.judged import Between
from shoal.response.limits.margins import Margins, least
from shoal.response.machine import Machine
from shoal.trajectory import Array

MARGIN = 0.01
"""Of the reliability index, by which more is aimed at where a confirming study finds too little."""


@dataclass(frozen=True)
class Cut:
    """What bounds the factors, in standard deviations of the margin: pull @ s + beta |spread * s| <= room.

    pull: of intervals, spread: of random parameters, 0 for the others, (parameters,)
    """

    pull: Array
    spread: Array
    room: float

    def used(self, factors: Array, beta: float) -> float:
        """The left side."""
        return float(self.pull @ factors + beta * np.linalg.norm(self.spread * factors))

    def slope(self, factors: Array, beta: float) -> Array:
        """Of that by each factor, (parameters,)."""
        size = max(float(np.linalg.norm(self.spread * factors)), 1e-300)
        return np.asarray(self.pull + beta * self.spread**2 * factors / size)


def cheapest(cuts: list[Cut], costs: Array, beta: float, most: Array) -> Array:
    """The factors, least sum(costs / s), within all cuts and with TIGHTEST <= s <= most."""
    # A cut is homogeneous: the same share of the widest ones is within it.
    share = min(1.0, *(one.room / max(one.used(most, beta), 1e-300) for one in cuts))
    start = np.clip(share * most, TIGHTEST, most)

    def within(one: Cut) -> optimize.NonlinearConstraint:
        """Of the room that logarithms of factors take up."""

        def used(x: Array) -> Array:
            return np.array([one.used(np.exp(x), beta) / one.room])

        def slope(x: Array) -> Array:
            return np.asarray(one.slope(np.exp(x), beta) * np.exp(x) / one.room)[None]

        return optimize.NonlinearConstraint(used, -np.inf, 1.0, jac=slope)

    found: Any = optimize.minimize(  # type: ignore[call-overload]
        lambda x: float(costs @ np.exp(-x)) / costs.sum(),
        np.log(start),
        jac=lambda x: -costs * np.exp(-x) / costs.sum(),
        method="SLSQP",
        bounds=[(math.log(TIGHTEST), math.log(top)) for top in most],
        constraints=[within(one) for one in cuts],
        options={"maxiter": 500, "ftol": 1e-10},
    )
    return np.asarray(np.exp(found.x) if found.success else start)


def of_both(
    limit: Limit,
    machine: Machine,
    inputs: Inputs,
    stated: Between,
    target: float,
    costs: Array,
    widest: Array,
    **how: Any,
) -> Allocation:
    """So that the limit is passed with a probability of at most `target`, whatever the values of the intervals.

    stated: what is known of the limit with the stated tolerances; widest: factors; how: of `between`. Raises
    InputError, ComputationError.
    """
    factors, spent, effects = np.ones(len(inputs)), 0, np.zeros(len(inputs))
    wanted = -float(special.ndtri(target))
    aim = wanted
    cuts: dict[tuple[float, ...], Cut] = {}
    given, random = inputs.some(~inputs.random), inputs.some(inputs.random)
    if least(_margins(limit, machine, given, random, np.zeros(len(given)))(np.zeros((1, len(random)))))[0] <= 0:
        raise passed(limit.text)
    chance, doubt, confirmed = math.nan, "", np.zeros(0)
    for round_ in range(ROUNDS):
        here = with_factors(inputs, factors)
        germ, point, pull, runs = _decided(limit, machine, here, **how)
        spent += runs
        if point is None:
            # So far off that it is not found: the widest tolerances come nearest to it.
            fresh = widest.copy()
        else:
            pull /= factors
            spread = np.zeros(len(inputs))
            spread[inputs.random] = np.abs(point.normal)
            spread /= factors
            room = point.beta + float(pull @ factors)
            if room <= 0:
                raise passed(limit.text)
            if round_ == 0:
                effects = _effects(point.beta, pull, spread)
            # The margin at each corner of the intervals falls by slopes of its own.
            cuts[tuple(np.sign(np.round(germ, 3)))] = Cut(pull, spread, room)
            fresh = cheapest(list(cuts.values()), costs, aim, widest)
        settled = np.max(np.abs(fresh / factors - 1)) < SETTLED
        factors = fresh
        if not settled:
            continue
        chance, doubt, runs = _chance(limit, machine, with_factors(inputs, factors), **how)
        spent, confirmed = spent + runs, factors
        if chance <= target or point is None:
            break
        aim += wanted + float(special.ndtri(chance)) + MARGIN
    if not np.array_equal(confirmed, factors):
        chance, doubt, runs = _chance(limit, machine, with_factors(inputs, factors), **how)
        spent += runs
    message = doubt if chance <= target else f"the probability is {chance:.2e} with the tolerances that were found"
    cost = float(costs @ (1 / factors) / costs.sum())
    return Allocation(
        *(limit.text, inputs, factors, effects, stated.estimates[1], chance, target, cost, spent, message)
    )


def _effects(beta: float, pull: Array, spread: Array) -> Array:
    """By which share the probability falls if a tolerance becomes one per cent smaller, (parameters,).

    The index grows by what an interval pulls, and by beta times the share of a random parameter in the variance.
    """
    hazard = math.exp(-0.5 * beta**2) / (math.sqrt(2 * math.pi) * special.ndtr(-beta))
    return np.asarray(0.01 * hazard * (pull + beta * spread**2))


def _decided(
    limit: Limit, machine: Machine, inputs: Inputs, *, seed: int, **_how: Any
) -> tuple[Array, DesignPoint | None, Array, int]:
    """Where the index is least: the germs of the intervals, the design point there, and by how much the margin falls
    there if each tolerance doubles [its standard deviations], (parameters,), 0 of random ones; runs.
    """
    given, random = inputs.some(~inputs.random), inputs.some(inputs.random)
    pull = np.zeros(len(inputs))
    try:
        answer, spent, _failed = searched(limit, machine, inputs, way="form", few=MANY, seed=seed)
    except ComputationError:
        return np.zeros(len(given)), None, pull, 0
    germ = answer.runs.germs[int(answer.runs.values[:, 0].argmin())]
    there = _margins(limit, machine, given, random, germ)
    points = design_points(there, np.zeros((1, len(random))))
    spent += there.evaluations
    if not points or not points[0].converged:
        return germ, None, pull, spent
    point, moved = points[0], np.zeros(len(given))
    for k, away in enumerate(STEP * np.eye(len(given))):
        up, down = (
            _margins(limit, machine, given, random, germ + side * away)(point.place[None])[0, point.instant]
            for side in (1.0, -1.0)
        )
        moved[k] = -(up - down) / (2 * STEP) * germ[k] / point.slope
    # An end of a wider interval lies farther out; what does not lower the margin there limits nothing.
    pull[~inputs.random] = np.maximum(moved, 0.0)
    return germ, point, pull, spent + 2 * len(given)


def _margins(limit: Limit, machine: Machine, given: Inputs, random: Inputs, germ: Array) -> Margins:
    """At germs of the intervals, (intervals,)."""
    values = {path: float(at[0]) for path, at in given.values(germ[None]).items()}
    return Margins(watched(machine.at(values), limit), random, MANY)


def _chance(limit: Limit, machine: Machine, inputs: Inputs, **how: Any) -> tuple[float, str, int]:
    """The largest probability over the intervals, why it should not be believed, and runs."""
    found = between(limit, machine, inputs, **{**how, "verify": False, "progress": None})
    assert found.between is not None
    return found.between.estimates[1], found.reason_to_doubt, found.evaluations
