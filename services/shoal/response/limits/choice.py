"""The probability that a limit is passed: by which way, and why by that one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shoal.errors import InputError
from shoal.response.kept import TimeIsUpError
from shoal.response.limits.counted import contradiction
from shoal.response.limits.estimate import Estimate, weighted
from shoal.response.limits.form import SHARES, DesignPoint, design_points, distinct
from shoal.response.limits.importance import Sample, adapted, sample
from shoal.response.limits.margins import Margins, least
from shoal.response.limits.subset import Levels, subset
from shoal.response.runs import TooManyRunsError
from shoal.trajectory import Array

OFTEN = 0.1
"""Probability from which plain sampling tells it as well."""
PILOT = 200
"""Runs of each level that look for the places where the limit is passed."""
STARTS = 6
"""Searches for design points."""
DIFFERENT = 0.8
"""Cosine below which two runs beyond a limit lie in different directions."""
ROUNDS = 10
"""Of looking for further design points, and how many directions are looked in."""
ASIDE = 128
REACH = 2.0
"""Beyond the nearest one, in these directions."""
MOST_POINTS = 30
"""Design points that are looked for."""
SEVERAL = 3
"""Design points from which on a search that has not ended may have missed some."""
SEEN = 25
"""Runs beyond the limit, of those drawn all around, that tell the probability whether or not points were missed."""
FIRST = 0.3
"""Share of the runs of importance sampling that its proposals are fitted to."""
LEAST = 0.3
"""Coefficient of variation that subset simulation has at least."""
FOR_POINTS = 0.2
"""Share of the runs that design points may take."""
COARSE = 0.15
"""Coefficient of variation above which the estimate is told to be coarse."""
PLAIN = 0.1
"""Share of the runs that are drawn from the distributions: design points are where a search looks, these are not."""
DISAGREE = 4.0
"""Standard deviations by which it may say more than importance sampling and it still be chance."""


@dataclass(frozen=True)
class Passing:
    """The answer of a method. doubt: why it should not be believed, empty if it may be; plain: runs that were drawn
    from the distributions to see whether they contradict it
    """

    estimate: Estimate
    points: list[DesignPoint]
    why: str
    doubt: str = ""
    plain: int = 0


def form(margins: Margins, seed: int) -> Passing:
    """The half space beyond the tangent at the nearest design point, without an interval: its error is not known."""
    parameters = len(margins.inputs)
    directions = np.random.default_rng(seed).standard_normal((STARTS, parameters))
    directions *= 3 / np.linalg.norm(directions, axis=1)[:, None]
    points = design_points(margins, np.vstack([np.zeros((1, parameters)), directions]))
    if not points:
        return Passing(_nothing("no design point"), [], "FORM", "FORM found no place where the limit is passed")
    instants = margins(np.zeros((1, parameters))).shape[1]
    passed = np.where(np.arange(instants) >= points[0].instant, points[0].probability, 0.0)
    doubt = "" if points[0].converged else "FORM did not converge"
    if not doubt and len(points) > 1:
        doubt = f"{len(points)} design points were found and FORM takes the nearest only"
    return Passing(Estimate(passed, np.full(instants, np.nan), "FORM"), points, "FORM: first-order estimate", doubt)


def by_importance(margins: Margins, seed: int) -> Passing:
    """Runs around the design points that FORM finds."""
    points = form(margins, seed).points
    if not points:
        return Passing(_nothing("no design point"), [], "importance sampling", "no design point was found to sample at")
    found = sample(margins, adapted(points, None), margins.left, seed + 1)
    why = f"{found.estimate.why} around {_told(points)}"
    return Passing(found.estimate, points, why, _weak(found, [], points, ended=True))


def by_subset(margins: Margins, seed: int) -> Passing:
    """All runs in levels."""
    # About one level for every power of ten down to a millionth.
    found = subset(margins, max(margins.left // 7, 20), seed)
    return Passing(found.estimate, _seen(found.places), found.estimate.why, _coarse(found.estimate))


def monte_carlo(margins: Margins, seed: int) -> Passing:
    """All runs drawn from the distributions."""
    count = margins.left
    places = np.random.default_rng(seed).standard_normal((count, len(margins.inputs)))
    rows = margins(places)
    estimate = weighted(rows, np.ones(count), f"{count} random runs")
    return Passing(estimate, _seen(places[least(rows) < 0]), estimate.why, _coarse(estimate))


def auto(margins: Margins, seed: int) -> Passing:
    """Subset simulation looks for the places, design points are sought there, importance sampling at them tells.

    Where the limit is passed often, plain sampling is as good.
    """
    pilot = subset(margins, min(PILOT, max(margins.left // 16, 20)), seed)
    rough = pilot.estimate
    if rough.probability >= OFTEN:
        found = monte_carlo(margins, seed + 1)
        return Passing(found.estimate, found.points, f"{found.why}, as the limit is passed often", found.doubt)
    points, ended = _sought(margins, pilot, seed + 1)
    if not points:
        return Passing(rough, [], rough.why)
    known = Sample(pilot.places, pilot.margins, np.ones(len(pilot.places))) if len(pilot.places) else None
    plain = np.random.default_rng(seed + 4).standard_normal((int(PLAIN * margins.left), len(margins.inputs)))
    rows = margins(plain)
    first = sample(margins, adapted(points, known), int(FIRST * margins.left), seed + 2)
    last = sample(margins, adapted(points, first), margins.left, seed + 3)
    estimate = last.estimate
    doubt = contradiction(estimate, rows) or _weak(last, [first], points, ended=ended)
    why = f"{estimate.why} around {_told(points)}"
    if doubt or known is None:
        return Passing(estimate, points, why, doubt, len(rows))
    # Subset simulation may lose a place as well, but it finds none that is not there.
    chance = DISAGREE * math.hypot(max(rough.coefficient, LEAST), estimate.coefficient)
    if not estimate.probability or math.log(rough.probability / estimate.probability) > chance:
        doubt = f"importance sampling says {estimate.probability:.1e} and subset simulation {rough.probability:.1e}"
        return Passing(estimate, points, why, doubt, len(rows))
    agrees = f"; {rough.why} says {rough.probability:.1e}"
    return Passing(estimate, points, why + agrees, "", len(rows))


def _sought(margins: Margins, pilot: Levels, seed: int) -> tuple[list[DesignPoint], bool]:
    """Design points below all runs that pass the limit, as far as they are known; those runs where there are none.

    And whether the search has ended of itself: nothing that is known is left to explain, or nothing new was found.
    """
    parameters = len(margins.inputs)
    whole = margins.most
    margins.most = margins.evaluations + int(FOR_POINTS * margins.left)
    first = pilot.first[: len(pilot.first) // 5]
    points = design_points(margins, np.vstack([np.zeros((1, parameters)), _apart(pilot.places), _apart(first)]))
    known = pilot.places
    if margins.left > ASIDE:
        radius = REACH + min((abs(point.beta) for point in points), default=3.0)
        ways = np.random.default_rng(seed).standard_normal((ASIDE, parameters))
        ways *= radius / np.linalg.norm(ways, axis=1)[:, None]
        known = np.concatenate([known, ways[least(margins(ways)) < 0]])
    ended, step = False, 2 * parameters + len(SHARES)
    for _ in range(ROUNDS):
        hidden = known
        for point in points:
            hidden = hidden[hidden @ point.normal < point.beta]
        starts = _apart(hidden)
        if not len(starts) or margins.left < step * len(starts) or len(points) >= MOST_POINTS:
            ended = not len(starts)
            break
        more = distinct([*points, *design_points(margins, starts)])
        if len(more) == len(points):
            ended = margins.left >= step * len(starts)
            break
        points = more[:MOST_POINTS]
    margins.most = whole
    return points or [_where(place) for place in _apart(pilot.places)], ended


WAYS: dict[str, Callable[[Margins, int], Passing]] = {
    "auto": auto,
    "form": form,
    "importance": by_importance,
    "subset": by_subset,
    "monte-carlo": monte_carlo,
}
"""The list."""


def get_way(name: str) -> Callable[[Margins, int], Passing]:
    """The way of that name. Raises InputError."""
    if name not in WAYS:
        raise InputError(f"limit-method: no way {name!r}; there are {', '.join(WAYS)}")
    return WAYS[name]


def probability(margins: Margins, way: str, seed: int) -> Passing:
    """Raises InputError, also where there are too few runs."""
    try:
        return get_way(way)(margins, seed)
    except TimeIsUpError:
        raise
    except TooManyRunsError:
        raise InputError(f"limit-runs: {way} needs more than the {margins.most} runs that it may make") from None


def _apart(places: Array) -> Array:
    """The places nearest to the origin that lie in different directions, (starts, parameters)."""
    chosen: list[Array] = []
    for place in places[np.argsort(np.linalg.norm(places, axis=1))]:
        unit = place / np.linalg.norm(place)
        if all(unit @ other / np.linalg.norm(other) < DIFFERENT for other in chosen):
            chosen.append(place)
        if len(chosen) == STARTS - 1:
            break
    return np.array(chosen).reshape(-1, places.shape[1])


def _seen(places: Array) -> list[DesignPoint]:
    """The run beyond the limit that is nearest to the origin, if there is one."""
    return [_where(place) for place in _apart(places)[:1]]


def _where(place: Array) -> DesignPoint:
    """A run beyond the limit that stands for a design point that was not sought or not found."""
    beta = float(np.linalg.norm(place))
    return DesignPoint(place, place / beta, math.nan, beta, -1, False)


def _nothing(why: str) -> Estimate:
    return Estimate(np.array([np.nan]), np.array([np.nan]), why, unseen=1.0)


def _told(points: list[DesignPoint]) -> str:
    betas = ", ".join(f"{point.beta:.2f}" for point in points[:3]) + (", ..." if len(points) > 3 else "")
    what = "a design point" if len(points) == 1 else f"{len(points)} design points"
    return f"{what} (beta {betas})"


def _weak(last: Sample, before: list[Sample], points: list[DesignPoint], *, ended: bool) -> str:
    """Empty, or why runs around design points do not tell the probability. ended: whether the search for these did."""
    estimate, sure = last.estimate, [point for point in points if point.converged]
    if not estimate.probability and sure:
        return f"there is {_told(sure)}, but none of {len(last.rows)} runs around it passes the limit"
    seen = 0
    for rows, probability in itertools.chain.from_iterable(one.outside for one in (last, *before)):
        if doubt := contradiction(estimate, rows, outside=probability):
            return doubt
        seen += int((rows < 0).any(axis=1).sum())
    if not ended and len(points) >= SEVERAL and seen < SEEN:
        return f"there may be more design points than the {len(points)} that were found"
    return _coarse(estimate)


def _coarse(estimate: Estimate) -> str:
    """Empty, or how coarse the estimate is."""
    if not estimate.probability:
        return ""
    if estimate.coefficient <= COARSE:
        return ""
    return f"the coefficient of variation of the probability is {estimate.coefficient:.2f}"
