"""Allocation of tolerances so that a limit is kept, and the one to tighten for most effect.

A tolerance is the half width of an interval, or the standard deviation of a distribution. Costs grow with its
reciprocal (Chase and Greenwood, Design issues in mechanical tolerance analysis, Manufacturing Review 1, 1988). What
keeps the limit is looked up with the model, replaced by its first-order form in the tolerances, for which the cheapest
ones are known, and looked up there again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import optimize

from shoal.errors import ComputationError, InputError
from shoal.findings import Finding, message
from shoal.json_values import plain
from shoal.response import findings as kinds
from shoal.response.inputs import ENDS, Inputs, UncertainParameter
from shoal.response.marginals import scaled
from shoal.response.runs import CachedModel, Model
from shoal.scene import Scene
from shoal.trajectory import Array

WIDEST, TIGHTEST = 3.0, 1e-3
"""Factors on the tolerances that are stated, beyond which none is tried."""
ROUNDS = 15
"""Linearisations, at most."""
SETTLED = 5e-3
"""Relative change of all factors at which the search ends: tolerances are stated to two or three digits."""
MANY = 100_000
"""Runs of a search for the decisive place, at most."""
STEP = 0.02
"""Step of differences, as a share of a stated tolerance."""
TARGET = 1e-3
"""Probability of exceeding a limit, where none is stated."""
Least = Callable[[Inputs], "LeastMargin"]


@dataclass(frozen=True)
class LeastMargin:
    """Least margin over intervals: by outer bounds, and as attained by a run at `xi`."""

    outer: float
    attained: float
    xi: Array
    evaluations: int


@dataclass(frozen=True, eq=False)
class Allocation:
    """The cheapest tolerances that keep a limit.

    factors: on those that are stated, (parameters,); effects: of tightening each by one per cent: by how much the least
    margin grows, or by which share the probability falls, (parameters,); confirmed: the least margin, or the
    probability (the largest over intervals), with the new ones; target: what it had to be; cost: of the new ones over
    that of the stated ones; findings: why it is no answer; interval: 95 % confidence interval of that probability
    """

    required: str
    inputs: Inputs
    factors: Array
    effects: Array
    stated: float
    confirmed: float
    target: float
    cost: float
    evaluations: int
    findings: list[Finding]
    interval: tuple[float, float] | None = None

    @property
    def ok(self) -> bool:
        """Return whether a confirming study keeps the limit."""
        return not self.findings

    @property
    def allocated(self) -> Inputs:
        """The parameters with the new tolerances."""
        return with_factors(self.inputs, self.factors)

    @property
    def what(self) -> str:
        """Name of the quantity that is confirmed."""
        random = self.inputs.random
        return "least margin" if not random.any() else "probability" if random.all() else "largest probability"

    @property
    def confirmed_text(self) -> str:
        """Confirmed quantity in words, with its interval."""
        if self.interval is None or not np.all(np.isfinite(self.interval)):
            return f"{self.confirmed:.3g}"
        low, high = self.interval
        return f"{self.confirmed:.3g} ({low:.3g} to {high:.3g}, of {self.target:g} that are allowed)"

    @property
    def first(self) -> str | None:
        """Name of the parameter whose tolerance to tighten first, None where none has an effect."""
        return None if not np.any(self.effects > 0) else self.inputs.names[int(np.argmax(self.effects))]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        random = bool(self.inputs.random.any())
        quantity = "probability" if random else "margin"
        return dict(
            plain(
                {
                    "require": self.required,
                    "status": "ok" if self.ok else "not-met",
                    "message": message(self.findings),
                    f"{quantity}_stated": self.stated,
                    f"{quantity}_allocated": self.confirmed,
                    f"{quantity}_interval": self.interval,
                    "target": self.target,
                    "cost": self.cost,
                    "evaluations": self.evaluations,
                    "tighten_first": self.first,
                    "parameters": {
                        one.name: {
                            "factor": float(factor),
                            "tolerance_stated": old.marginal.tolerance,
                            "tolerance": one.marginal.tolerance,
                            "effect_of_one_per_cent": float(effect),
                        }
                        for one, old, factor, effect in zip(
                            self.allocated.parameters,
                            self.inputs.parameters,
                            self.factors,
                            self.effects,
                            strict=True,
                        )
                    },
                }
            )
        )


def with_factors(inputs: Inputs, factors: Array) -> Inputs:
    """Parameters with their tolerances multiplied about their middle values."""
    pairs = zip(inputs.parameters, factors, strict=True)
    return replace(inputs, parameters=tuple(replace(one, marginal=scaled(one.marginal, float(f))) for one, f in pairs))


@dataclass(frozen=True)
class Cut:
    """Linear bound on the factors and their scatter, in units of the margin: pull @ s + beta |spread @ s| <= room.

    pull: (parameters,); spread: of the margin by independent standard normal variables, (parameters, parameters)
    """

    pull: Array
    spread: Array
    room: float

    def used(self, factors: Array, beta: float) -> float:
        """The left side."""
        return float(self.pull @ factors + beta * np.linalg.norm(self.spread @ factors))

    def slope(self, factors: Array, beta: float) -> Array:
        """Return the derivative of the left side by each factor, (parameters,)."""
        along = self.spread @ factors
        return np.asarray(self.pull + beta * self.spread.T @ along / max(float(np.linalg.norm(along)), 1e-300))


def cheapest(cuts: list[Cut], costs: Array, beta: float, most: Array) -> Array:
    """The factors, least sum(costs / s), within all cuts and with TIGHTEST <= s <= most."""
    # A cut is homogeneous: the same share of the widest ones is within it.
    share = min(1.0, *(one.room / max(one.used(most, beta), 1e-300) for one in cuts))
    start = np.clip(share * most, TIGHTEST, most)

    def within(one: Cut) -> optimize.NonlinearConstraint:
        """Return the constraint of one cut on the logarithms of the factors."""

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


def of_intervals(text: str, model: Model, inputs: Inputs, least: Least, costs: Array, most: Array) -> Allocation:
    """Allocate tolerances within which no values exceed the limit: the outer bound of the least margin stays at zero.

    model: margins over time. Raises ComputationError if the middle values exceed it.
    """
    factors, evaluations = np.ones(len(inputs)), 0
    stated, effects = math.nan, np.zeros(len(inputs))
    cuts: dict[tuple[float, ...], Cut] = {}
    for round_ in range(ROUNDS):
        here = with_factors(inputs, factors)
        least_margin = least(here)
        pull, runs = _pull(model, here, least_margin.xi, factors)
        evaluations += least_margin.evaluations + runs
        if round_ == 0:
            stated, effects = least_margin.attained, 0.01 * pull
        # A margin is taken for linear in the tolerances; each corner of the box has its own.
        room = least_margin.outer + float(pull @ factors)
        if room <= 0:
            raise unattainable(text)
        cuts[tuple(np.sign(np.round(least_margin.xi, 3)))] = Cut(pull, np.zeros((len(pull), len(pull))), room)
        fresh = cheapest(list(cuts.values()), costs, 0.0, most)
        settled = np.max(np.abs(fresh / factors - 1)) < SETTLED
        factors = fresh
        if settled:
            break
    confirmed, factors, more = _shrunk(factors, lambda s: _outer(least, with_factors(inputs, s)))
    why = "no tolerances were found that keep the limit"
    found = [kinds.NOT_MET.found(why, margin=confirmed)] if confirmed < 0 else []
    cost = float(costs @ (1 / factors) / costs.sum())
    return Allocation(text, inputs, factors, effects, stated, confirmed, 0.0, cost, evaluations + more, found)


def _outer(least: Least, inputs: Inputs) -> tuple[float, int]:
    least_margin = least(inputs)
    return least_margin.outer, least_margin.evaluations


def _shrunk(factors: Array, look: Callable[[Array], tuple[float, int]]) -> tuple[float, Array, int]:
    """Shrink all factors by the same share until `look` confirms them."""
    evaluations = 0
    for share in (1.0, 0.999, 0.99, 0.97, 0.9, 0.75, 0.5):
        found, runs = look(np.maximum(share * factors, TIGHTEST))
        evaluations += runs
        if found >= 0:
            break
    return found, np.maximum(share * factors, TIGHTEST), evaluations


def _pull(model: Model, inputs: Inputs, xi: Array, factors: Array) -> tuple[Array, int]:
    """Return the fall of the margin at the worst place per factor of each tolerance, (parameters,), and the runs made.

    The worst place moves outwards with the tolerance: d margin / d xi * xi /
    factor.
    """
    runs = CachedModel(model, inputs, 2 * len(xi) + 1)
    away = STEP * np.eye(len(xi))
    runs.all(np.concatenate([xi[None], xi + away, xi - away]))
    values = runs.values
    if len(values) < 2 * len(xi) + 1:
        raise ComputationError(f"allocate: runs beside the worst one failed: {runs.why}")
    instant = int(values[0].argmin())
    up, down = values[1 : 1 + len(xi), instant], values[1 + len(xi) :, instant]
    return np.asarray(-(up - down) / (2 * STEP) * xi / factors), len(values)


def unattainable(text: str) -> ComputationError:
    """Return the error of a requirement that no tolerances keep."""
    return ComputationError(f"allocate: {text} does not hold at the middle values, with any tolerances")


def costs_of(texts: Mapping[str, float], inputs: Inputs) -> Array:
    """Return a cost for every parameter, 1 where none is stated, (parameters,). Raises InputError."""
    for name, cost in texts.items():
        if name not in inputs.names:
            raise InputError(f"cost: {name!r} is not varied; there are {', '.join(inputs.names)}")
        if not cost > 0 or not math.isfinite(cost):
            raise InputError(f"cost: {name}={cost:g}: costs are positive")
    return np.array([float(texts.get(name, 1.0)) for name in inputs.names])


def accepted(scene: Scene, inputs: Inputs) -> Array:
    """Return the factors up to which the scene accepts the ends of each tolerance, at most `WIDEST`, (parameters,)."""
    found = []
    for one in inputs.parameters:
        most = WIDEST
        while most > 1 and not _accepts(scene, one, most):
            most = max(1.0, most - 0.25)
        found.append(most)
    return np.array(found)


def _accepts(scene: Scene, one: UncertainParameter, factor: float) -> bool:
    marginal = scaled(one.marginal, factor)
    ends = np.array([-1.0, 1.0]) if not marginal.random else marginal.quantile(np.array(ENDS))
    try:
        for value in marginal.value(ends):
            scene.with_values({path: float(value) * share for path, share in one.factors.items()})
    except InputError:
        return False
    return True
