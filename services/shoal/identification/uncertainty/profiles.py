"""Profile likelihood: how much worse the fit gets when one parameter is held elsewhere and the others follow.

Unlike a standard deviation it sees that a parameter is bounded on one side only, or not at all (Raue et al.,
Bioinformatics 25, 2009).
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import Search
from shoal.identification.methods.least_squares import differentiate
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.linearisation import Linearisation, quantile, spread
from shoal.identification.uncertainty.sensitivity import Sensitivity
from shoal.json_values import plain
from shoal.trajectory import Array

_POINTS = 14
"""On each side, at most."""
_FIRST = 0.5
"""First step outward, in standard deviations; the next ones are longer by _GROWTH."""
_GROWTH = 1.4
"""Ratio of a step outward to the one before: about three steps to the end of an interval."""
_SHORTER, _SHORTEST = 4.0, 1024.0
"""A step that leads too far is divided by the first, down to the first step over the second."""
_FAR = 4.0
"""Rise from which on the place where it is one is looked for again with a shorter step."""
_ITERATIONS, _CALLS = 50, 250
"""Calls of the model for each fit of the others, and for a side, at most."""
_SETTLED, _NEARLY = 1e-3, 0.05
"""Of the threshold: a fit that promises to get better by less has settled; at its end the second will do."""
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
        """Return whether the data leave a side open, up to the bound."""
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
    answer = Search(model, point, *differentiate(model, point), fixed=k)
    lower, upper = (_side(answer, k, direction * step, threshold) for direction in (-1.0, 1.0))
    sought = np.array([lower.end, *lower.values[::-1], point[k], *upper.values, upper.end])
    low, *values, high = np.exp(sought) if model.parameters.logarithmic[k] else sought
    rise = np.array([*lower.rises[::-1], 0.0, *upper.rises])
    best = min((lower, upper), key=lambda side: side.lowest)
    ends = float(low), float(high), lower.open, upper.open
    return Profile(np.array(values), rise, *ends, best.lowest < -_BELOW, best.place)


@dataclass(frozen=True)
class _Side:
    """Values of a parameter outward, rises there, and where its interval ends, in the scale in which it is sought.

    open: whether no rise beyond one was found; place, lowest: where the misfit is lowest, and the rise there
    """

    values: list[float]
    rises: list[float]
    end: float
    open: bool
    place: Array
    lowest: float


def _side(answer: Search, k: int, step: float, threshold: float) -> _Side:
    """Outward from the answer until the rise passes one or the bound is reached.

    A fit of the others that does not settle says nothing, and one whose rise is far beyond one says little of where it
    is one: nearer values are tried. Where the fits settle nowhere, the side is open: a misfit that was not minimised
    bounds nothing.
    """
    model, last, calls = answer.model, answer, 0
    bound, shortest = float((model.lower if step < 0 else model.upper)[k]), abs(step) / _SHORTEST
    inside, outside = [(float(answer.point[k]), 0.0)], list[tuple[float, float]]()
    place, lowest = answer.point, 0.0
    while len(inside) <= _POINTS and calls < _CALLS and last.point[k] != bound:
        found, settled = _settled(last, k, step, threshold)
        calls += len(found.rows)
        seen = float(found.point[k]), min((found.cost - answer.cost) / threshold, 1e6)
        if settled and seen[1] > 1.0:
            outside.append(seen)
        if settled and seen[1] <= 1.0:
            inside.append(seen)
            last, step = found, step * (1.0 if outside else _GROWTH)
            if seen[1] < lowest:
                place, lowest = found.point, seen[1]
        elif (settled and seen[1] <= _FAR) or abs(step) <= shortest:
            break
        else:
            step /= _SHORTER
    tried = [*inside[1:], *outside[-1:]]
    values, rises = [value for value, _ in tried], [rise for _, rise in tried]
    if not outside:
        return _Side(values, rises, bound, True, place, lowest)
    (near, low), (far, high) = inside[-1], outside[-1]
    share = (1.0 - np.sqrt(max(low, 0.0))) / (np.sqrt(high) - np.sqrt(max(low, 0.0)))
    return _Side(values, rises, float(near + share * (far - near)), False, place, lowest)


def _settled(last: Search, k: int, step: float, threshold: float) -> tuple[Search, bool]:
    """The others fitted with parameter k moved from a fit of them, and whether that is as good as it gets.

    They start from where its derivatives lead them, so that they follow a valley. A motion that fails is no better
    anywhere near.
    """
    model, moved = last.model, last.point.copy()
    moved[k] = np.clip(moved[k] + step, model.lower[k], model.upper[k])
    linear = last.residual + last.jacobian[:, k] * (moved[k] - last.point[k])
    followed = Search(model, moved, linear, last.jacobian, fixed=k).ask()
    start = moved if followed is None else followed
    search = Search(model, start, *differentiate(model, start), fixed=k)
    while np.isfinite(search.cost) and len(search.rows) < _ITERATIONS and search.possible > _SETTLED * threshold:
        if (trial := search.ask()) is None:
            break
        search.tell(trial, *differentiate(model, trial))
    return search, not np.isfinite(search.cost) or search.possible < _NEARLY * threshold


_LEAST, _MOST = 0.7, 1.4
"""Of the promised rise at the end of an interval; in between the end is right within a fifth."""


def bent(model: ForwardModel, point: Array, at: Linearisation, seen: Sensitivity) -> list[int]:
    """Parameters with an interval at whose ends the misfit is not the predicted one. Not counted. Raises TimeIsUp.

    The others follow by linear theory; one call for all ends. What another drive or another known field would make of
    the answer is no move along this misfit: the intervals are those of the residuals alone.
    """
    at = at.alone
    share = at.pseudo_inverse @ at.pseudo_inverse.T
    moves = []
    for k in range(len(point)):
        half = spread(lambda p, k=k: float(p[k]), point, at).half  # type: ignore[misc]
        along = share[:, k] / share[k, k] * half if share[k, k] > 0.0 and np.isfinite(half) else np.zeros(len(point))
        moves += [-along, along]
    ends = np.clip(point + np.array(moves), *model.box_at(point))
    rows = model.uncounted(np.concatenate([point[None], ends]))
    base = float(rows[0] @ rows[0])
    promised = np.sum((seen.residual + (ends - point) @ seen.jacobian.T) ** 2, axis=1) - base
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = (np.sum(rows[1:] ** 2, axis=1) - base) / promised
    wrong = (promised > 0.0) & ~((ratio > _LEAST) & (ratio < _MOST))
    return sorted({int(k) // 2 for k in np.flatnonzero(wrong)})


def by_profile(
    model: ForwardModel, ends: list[Array], at: Linearisation, parameters: Mapping[str, Value], which: list[int]
) -> tuple[dict[str, Value], dict[str, Profile]]:
    """The parameters with intervals by their profiles, where these were wanted, and the profiles.

    ends: the answer, and other minima in its valley, which the intervals hold too, (parameters,) each; they also hold
    what linear theory says where it is not the residuals alone that count.
    What a better mesh and theory would change is in the interval as before. A side that the data leave open is not
    known, and neither is a parameter for whose profile no time is left.
    """
    found, profiled = dict(parameters), dict[str, Profile]()
    for k in which:
        name = model.names[k]
        known = found[name]
        try:
            seen = profile(model, ends[0], at, k)
        except TimeIsUp:
            found[name] = replace(known, identifiable=False)
            continue
        more = abs(known.correction or 0.0) + abs(known.theory or 0.0)
        determined = known.identifiable and not seen.open
        lower, upper = (known.lower, known.upper) if len(ends) > 1 or at.given else (seen.lower, seen.upper)
        lower, upper = min(lower, seen.lower - more), max(upper, seen.upper + more)
        found[name] = replace(known, lower=lower, upper=upper, identifiable=determined)
        profiled[name] = seen
    return found, profiled
