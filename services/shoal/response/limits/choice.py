"""The probability that a limit is exceeded: by which way, and why by that one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import InputError
from shoal.findings import Finding
from shoal.response import findings as kinds
from shoal.response.limits.estimate import ExceedanceEstimate
from shoal.response.limits.exceedance import Exceedance, coarse, contradictions
from shoal.response.limits.form import APART, SHARES, STARTS, DesignPoint, design_points, distinct
from shoal.response.limits.importance import Sample, adapted, controlled, sample
from shoal.response.limits.margins import Margins, least
from shoal.response.limits.subset import Levels, subset
from shoal.response.limits.surface import Surface, fit_surface
from shoal.response.runs import TimeIsUpError, TooManyRunsError
from shoal.trajectory import Array

OFTEN = 0.1
"""Probability from which plain sampling estimates it as well."""
PILOT = 200
"""Runs of each level that look for the places where the limit is exceeded."""
DIFFERENT = 0.8
"""Cosine below which two runs beyond a limit lie in different directions."""
STARTED = 3.0
"""Distance at which searches on a response surface begin along every axis."""
MANY = 2000
"""Places of each level of subset simulation on a response surface."""
ROUNDS = 10
"""Of looking for further design points with runs."""
FAIR = 0.05
"""Error of a response surface near the limit, as a share of the margins there, up to which its design points are those
of the model: smooth limits stay below 0.02, those with edges or many valleys above 0.07."""
ASIDE = 128
"""Where it is larger: directions in which runs look for further places beyond the limit,"""
REACH = 2.0
"""so far beyond the nearest design point."""
MOST_POINTS = 30
"""Design points that are looked for."""
SEVERAL = 3
"""Design points from which on a search that has not ended may have missed some."""
SEEN = 25
"""Runs beyond the limit, of those drawn all around, that estimate the probability whether or not points were missed."""
FIRST = 0.35
"""Share of the runs of importance sampling that its proposals are fitted to."""
LEAST = 0.3
"""Coefficient of variation that subset simulation has at least."""
FOR_POINTS, MORE_POINTS = 0.1, 0.2
"""Share of the runs that confirm design points, twice; and that look for them where a response surface is no help."""
PLAIN = 0.1
"""Share of the runs that are drawn from the distributions: design points are where a search looks, these are not."""
DISAGREE = 4.0
"""Standard deviations by which two independent estimates may differ and it still be chance."""


def form(margins: Margins, seed: int) -> Exceedance:
    """The half space beyond the tangent at the nearest design point, without an interval: its error is not known."""
    parameters = len(margins.inputs)
    directions = np.random.default_rng(seed).standard_normal((STARTS, parameters))
    directions *= 3 / np.linalg.norm(directions, axis=1)[:, None]
    points = design_points(margins, np.vstack([np.zeros((1, parameters)), directions]))
    if not points:
        none = kinds.NO_DESIGN_POINT.found("FORM found no place where the limit is exceeded")
        return Exceedance(_nothing("no design point"), [], "FORM", [none])
    instants = margins(np.zeros((1, parameters))).shape[1]
    exceeded = np.where(np.arange(instants) >= points[0].instant, points[0].probability, 0.0)
    found = [] if points[0].converged else [kinds.FORM_NOT_CONVERGED.found("FORM did not converge")]
    if len(points) > 1:
        text = f"{len(points)} design points were found and FORM takes the nearest only"
        found.append(kinds.SEVERAL_DESIGN_POINTS.found(text, points=len(points)))
    estimate = ExceedanceEstimate(exceeded, np.full(instants, np.nan), "FORM")
    return Exceedance(estimate, points, "FORM: first-order estimate", found)


def by_importance(margins: Margins, seed: int) -> Exceedance:
    """Runs around the design points that FORM finds."""
    points = form(margins, seed).points
    if not points:
        none = kinds.NO_DESIGN_POINT.found("no design point was found to sample at")
        return Exceedance(_nothing("no design point"), [], "importance sampling", [none])
    found = sample(margins, adapted(points, []), margins.left, seed + 1)
    why = f"{found.estimate.why} around {_describe(points)}"
    return Exceedance(found.estimate, points, why, _weak(found.estimate, [found], points, ended=True), sample=found)


def by_subset(margins: Margins, seed: int) -> Exceedance:
    """Return the probability by subset simulation with all runs."""
    # About one level for every power of ten down to a millionth.
    found = subset(margins, max(margins.left // 7, 20), seed)
    return Exceedance(
        found.estimate, _seen(found.places), found.estimate.why, coarse(found.estimate), sample=found.sample
    )


def monte_carlo(margins: Margins, seed: int) -> Exceedance:
    """Return the probability by plain Monte Carlo with all runs."""
    count = margins.left
    places = np.random.default_rng(seed).standard_normal((count, len(margins.inputs)))
    drawn = Sample(places, margins(places), np.ones(count))
    estimate = replace(drawn.estimate, why=f"{count} random runs")
    return Exceedance(estimate, _seen(drawn.beyond.places), estimate.why, coarse(estimate), sample=drawn)


def auto(margins: Margins, seed: int) -> Exceedance:
    """Importance sampling, whose proposals and control variate are found on a response surface of the runs before.

    Where the limit is exceeded often, plain sampling is as good.
    """
    whole = margins.most
    # Subset simulation far from a limit takes all runs that it is given.
    margins.most -= math.ceil(PLAIN * margins.left)
    pilot = subset(margins, min(PILOT, max(margins.left // 16, 20)), seed)
    margins.most = whole
    rough = pilot.estimate
    if rough.probability >= OFTEN:
        found = monte_carlo(margins, seed + 1)
        return replace(found, why=f"{found.why}, as the limit is exceeded often")
    plain = np.random.default_rng(seed + 4).standard_normal((int(PLAIN * margins.left), len(margins.inputs)))
    rows = margins(plain)
    searched = _search(margins, pilot, [], seed + 10)
    if not searched.points:
        return Exceedance(rough, [], rough.why, contradictions(rough, rows), len(rows), pilot.sample)
    first = sample(margins, adapted(searched.proposed, searched.beyond), int(FIRST * margins.left), seed + 2)
    searched = _search(margins, pilot, searched.points, seed + 20)
    proposal = adapted(searched.proposed, [*searched.beyond, first], first)
    last = sample(margins, proposal, margins.left, seed + 3)
    estimate = last.estimate
    if searched.surface is not None:
        estimate = controlled(last, proposal, searched.surface.chances, seed + 5)
    # Subset simulation may lose a place as well, but it finds none that is not there.
    findings = [
        *contradictions(estimate, rows),
        *_weak(estimate, [last, first], searched.points, ended=searched.ended),
        *_disagree(estimate, "importance sampling", first.estimate, 0.0, "its first runs", both=True),
        *_disagree(estimate, "importance sampling", rough, LEAST, "subset simulation"),
    ]
    why = f"{estimate.why} around {_describe(searched.points)}; {rough.why} says {rough.probability:.1e}"
    return Exceedance(estimate, searched.points, why, findings, len(rows), last)


@dataclass(frozen=True)
class Searched:
    """Failure domain of a limit: its design points and samples of it.

    points: design points by runs; proposed: these and those of the response surface; beyond: samples of the failure
    domain; surface: None where there are too few runs for one; ended: whether nothing that is known is left to explain
    """

    points: list[DesignPoint]
    proposed: list[DesignPoint]
    beyond: list[Sample]
    surface: Surface | None
    ended: bool


def _search(margins: Margins, pilot: Levels, known: list[DesignPoint], seed: int) -> Searched:
    """Look on the response surface of all runs so far, then with a share of the runs at the places found there.

    Runs beyond the limit that no design point explains start further searches. known: points that runs have confirmed
    """
    parameters, whole = len(margins.inputs), margins.most
    samples = [Sample(pilot.places, pilot.margins, np.ones(len(pilot.places)))] if len(pilot.places) else []
    predicted, surface = list[DesignPoint](), fit_surface(margins.inputs, *margins.known)
    fair = surface is not None and surface.error <= FAIR
    if surface is not None:
        free, axes = surface.margins, STARTED * np.eye(parameters)
        many = subset(free, MANY, seed)
        predicted = design_points(free, np.vstack([np.zeros((1, parameters)), axes, -axes, _apart(many.places)]))
        if len(many.places):
            samples.insert(0 if fair else 1, Sample(many.places, many.margins, np.ones(len(many.places))))
    margins.most = margins.evaluations + int((FOR_POINTS if fair else MORE_POINTS) * margins.left)
    points, starts, ended = known, _fresh(predicted[:STARTS], known, parameters), False
    if not fair:
        starts = np.zeros((0, parameters))
        if not known:
            first = pilot.first[: len(pilot.first) // 5]
            starts = np.concatenate([np.zeros((1, parameters)), _apart(pilot.places), _apart(first)])
            points, starts = design_points(margins, starts), starts[:0]
        if not known and margins.left > ASIDE:
            radius = REACH + min((abs(point.beta) for point in points), default=3.0)
            ways = np.random.default_rng(seed + 1).standard_normal((ASIDE, parameters))
            margins(ways * (radius / np.linalg.norm(ways, axis=1)[:, None]))
    for _ in range(ROUNDS):
        places, rows = margins.known
        # What a surface makes of places where no run has been is not known.
        hidden = places[least(rows) < 0] if pilot.places.size else np.zeros((1 - bool(points), parameters))
        for point in (*points, *(predicted if fair else ())):
            hidden = hidden[hidden @ point.normal < point.beta]
        starts = np.concatenate([starts, _apart(hidden)])
        ended = not len(starts)
        if ended or len(points) >= MOST_POINTS or margins.left < (2 * parameters + len(SHARES)) * len(starts):
            break
        more = distinct([*points, *design_points(margins, starts)])[:MOST_POINTS]
        ended = len(more) == len(points) and margins.left > 0
        if len(more) == len(points):
            break
        points, starts = more, starts[:0]
    margins.most = whole
    points = points or [_where(place) for place in _apart(pilot.places)]
    proposed = distinct([*points, *predicted])[: STARTS + 2 * parameters] if fair else points
    return Searched(points, proposed, samples, surface, ended or fair)


def _fresh(points: list[DesignPoint], known: list[DesignPoint], parameters: int) -> Array:
    """Places of points that are apart from those that are known, (places, parameters)."""
    fresh = [
        point.place for point in points if all(np.linalg.norm(point.place - other.place) > APART for other in known)
    ]
    return np.array(fresh).reshape(-1, parameters)


WAYS: dict[str, Callable[[Margins, int], Exceedance]] = {
    "auto": auto,
    "form": form,
    "importance": by_importance,
    "subset": by_subset,
    "monte-carlo": monte_carlo,
}
"""The list."""


def get_way(name: str) -> Callable[[Margins, int], Exceedance]:
    """Return the method of that name. Raises InputError."""
    if name not in WAYS:
        raise InputError(f"limit-method: no way {name!r}; there are {', '.join(WAYS)}")
    return WAYS[name]


def probability(margins: Margins, way: str, seed: int) -> Exceedance:
    """Return the probability by a method of `WAYS`. Raises InputError, also where there are too few runs."""
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
        unit = place / max(np.linalg.norm(place), 1e-300)
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


def _nothing(why: str) -> ExceedanceEstimate:
    return ExceedanceEstimate(np.array([np.nan]), np.array([np.nan]), why, unseen=1.0)


def _describe(points: list[DesignPoint]) -> str:
    betas = ", ".join(f"{point.beta:.2f}" for point in points[:3]) + (", ..." if len(points) > 3 else "")
    what = "a design point" if len(points) == 1 else f"{len(points)} design points"
    return f"{what} (beta {betas})"


def _weak(
    estimate: ExceedanceEstimate, samples: list[Sample], points: list[DesignPoint], *, ended: bool
) -> list[Finding]:
    """Return why runs around design points do not give the probability. ended: whether the search for these did."""
    sure, runs = [point for point in points if point.converged], len(samples[0].rows)
    if not estimate.probability and sure:
        text = f"there is {_describe(sure)}, but none of {runs} runs around it exceeds the limit"
        return [kinds.NONE_EXCEEDS.found(text, runs=runs)]
    found, seen = list[Finding](), 0
    for rows, probability in itertools.chain.from_iterable(one.outside for one in samples):
        found += contradictions(estimate, rows, outside=probability)
        seen += int((rows < 0).any(axis=1).sum())
    if not ended and len(points) >= SEVERAL and seen < SEEN:
        text = f"there may be more design points than the {len(points)} that were found"
        found.append(kinds.DESIGN_POINTS_MISSED.found(text, points=len(points)))
    return [*found, *coarse(estimate)]


def _disagree(
    one: ExceedanceEstimate, name: str, other: ExceedanceEstimate, least: float, source: str, *, both: bool = False
) -> list[Finding]:
    """Return a finding where an independent estimate is larger (or, for `both`, smaller) than chance allows.

    least: coefficient of variation of the other at least; source: what it is
    """
    if not other.probability:
        return []
    chance = DISAGREE * math.hypot(max(other.coefficient, least), one.coefficient) if one.probability else 0.0
    away = math.log(other.probability / one.probability) if one.probability else math.inf
    if away <= chance and not (both and -away > chance):
        return []
    text = f"{name} says {one.probability:.1e} and {source} {other.probability:.1e}"
    return [kinds.ESTIMATES_DIFFER.found(text, probability=one.probability, other=other.probability)]
