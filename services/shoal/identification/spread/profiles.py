"""Profile likelihood: how much worse the fit gets when one parameter is held elsewhere and the others follow.

Unlike a standard deviation it sees that a parameter is bounded on one side only, or not at all (Raue et al.,
Bioinformatics 25, 2009).
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import damped_step, squares
from shoal.identification.methods.least_squares import differentiate
from shoal.identification.spread.uncertainty import Linearisation, quantile
from shoal.trajectory import Array, plain

_POINTS = 14
"""On each side, at most."""
_FIRST = 0.5
"""First step outward, in standard deviations; the next ones are longer by _GROWTH."""
_GROWTH = 1.4
_ITERATIONS = 8
_BELOW = 1e-3
"""Of the threshold: a fit that is better by more is another minimum."""


@dataclass(frozen=True)
class Profile:
    """Values of a parameter, (n,) increasing, and the rise of the misfit over that of the 95 % threshold, (n,).

    lower, upper: where the rise crosses one; at a side that is open the bound, which the data do not exclude
    better: whether a better fit than the answer was found on the way; place: where, (parameters,) as sought
    """

    values: Array
    rise: Array
    lower: float
    upper: float
    lower_open: bool
    upper_open: bool
    better: bool
    place: Array

    @property
    def open(self) -> bool:
        """Whether the data leave a side open, up to the bound."""
        return self.lower_open or self.upper_open

    def to_json(self) -> dict[str, Any]:
        """All fields but the place."""
        return plain({name: value for name, value in vars(self).items() if name != "place"})  # type: ignore[no-any-return]


def profiles(model: ForwardModel, point: Array, at: Linearisation, known: Mapping[str, Profile]) -> dict[str, Profile]:
    """The profile of every parameter about an answer, as far as time allows; known: those made before."""
    found: dict[str, Profile] = {}
    with suppress(TimeIsUp):
        for k, name in enumerate(model.names):
            found[name] = known[name] if name in known else profile(model, point, at, k)
    return {**known, **found}


def profile(model: ForwardModel, point: Array, at: Linearisation, k: int) -> Profile:
    """Outward from the answer on both sides, each fit of the others starting from the last one.

    The threshold is the rise of a quadratic misfit at the end of the parameter's interval, so that correlated noise
    widens both in the same way.
    """
    # Where the others follow, a quadratic misfit rises by (deviation)^2 / (J'J)^-1_kk.
    shares = np.maximum(at.parts[:, k, k], 0.0)
    std, half = float(np.sqrt(shares.sum())), quantile(shares, at.noise) * float(np.sqrt(shares.sum()))
    plain_variance = float(np.sum(at.pseudo_inverse[k] ** 2))
    span = float(model.upper[k] - model.lower[k])
    threshold = half**2 / plain_variance if plain_variance > 0 else 0.0
    hidden = at.unknown.size > 0 and float(np.linalg.norm(at.unknown[k])) > 1e-3
    if hidden or threshold == 0.0:
        residual = model.uncounted(point[None])[0]
        threshold = threshold or 4.0 * float(residual @ residual) / len(residual)
        std = max(std, span / 20)
    step = _FIRST * min(max(std, 1e-9 * span), span / 10)
    sides = [_side(model, point, k, direction * step, threshold) for direction in (-1.0, 1.0)]
    values = np.concatenate([sides[0][0][::-1], [point[k]], sides[1][0]])
    rise = np.concatenate([sides[0][1][::-1], [0.0], sides[1][1]])
    ends = [_crossing(point[k], *side[:2]) for side in sides]
    own = np.exp(values) if model.parameters.logarithmic[k] else values
    low, high = (float(np.exp(end)) if model.parameters.logarithmic[k] else end for end, _ in ends)
    place = min(sides, key=lambda side: side[3])[2]
    return Profile(own, rise, low, high, ends[0][1], ends[1][1], bool(np.min(rise) < -_BELOW), place)


def _side(
    model: ForwardModel, point: Array, k: int, step: float, threshold: float
) -> tuple[Array, Array, Array, float]:
    """Values of parameter k outward and the rises there, until the rise passes one or the bound is reached.

    The last two are where the misfit is lowest, and the rise there.
    """
    base = squares(model.uncounted(point[None])[0])
    values, rises, last = list[float](), list[float](), point.copy()
    lowest, place = 0.0, point
    for _ in range(_POINTS):
        moved = last.copy()
        moved[k] = np.clip(last[k] + step, model.lower[k], model.upper[k])
        if moved[k] == last[k]:
            break
        last, cost = _settle(model, moved, k)
        values.append(float(last[k]))
        rises.append(min((cost - base) / threshold, 1e6))
        if rises[-1] < lowest:
            lowest, place = rises[-1], last
        if rises[-1] > 1.0:
            break
        step *= _GROWTH
    return np.array(values), np.array(rises), place, lowest


def _settle(model: ForwardModel, point: Array, k: int) -> tuple[Array, float]:
    """The others fitted with parameter k held: Levenberg-Marquardt from nearby."""
    residual, jacobian = differentiate(model, point)
    cost, damping = squares(residual), 1e-6
    for _ in range(_ITERATIONS):
        free = np.delete(np.arange(len(point)), k)
        if not len(free) or not np.isfinite(cost):
            break
        size = np.maximum(np.linalg.norm(jacobian[:, free], axis=0), 1e-300)
        step = damped_step(residual, jacobian[:, free], size, damping)
        trial = point.copy()
        trial[free] = np.clip(point[free] + step, model.lower[free], model.upper[free])
        trial_residual, trial_jacobian = differentiate(model, trial)
        gain = cost - squares(trial_residual)
        if gain > 0:
            point, residual, jacobian, cost = trial, trial_residual, trial_jacobian, cost - gain
            damping /= 10
            if gain < 1e-4 * cost:
                break
        else:
            damping = max(damping, 1e-6) * 100
    return point, cost


def _crossing(middle: float, values: Array, rises: Array) -> tuple[float, bool]:
    """Where the rise is one, by its square root between the last two points; and whether it never is."""
    if not len(values) or rises[-1] <= 1.0:
        return (float(values[-1]) if len(values) else float(middle)), True
    roots = np.sqrt(np.maximum(np.concatenate([[0.0], rises]), 0.0))
    places = np.concatenate([[middle], values])
    share = (1.0 - roots[-2]) / (roots[-1] - roots[-2])
    return float(places[-2] + share * (places[-1] - places[-2])), False
