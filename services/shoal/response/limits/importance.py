"""Importance sampling of the failure domain by mixtures of normal distributions, with a control variate.

Proposals are mixtures of normal distributions: one around every design point (Melchers, Importance sampling in
structural systems, Structural Safety 6, 1989), and some for the runs beyond the limit that belong to it, with their
means and covariances (Ang, Ang and Tang, Optimal importance-sampling density estimator, 1992, in the form of cross
entropy). Between them weights could be as large as they like, and too rare to be met: where a limit surrounds the
origin, that is most of the probability. A part of every proposal therefore is the distribution itself beyond the
distance of the nearest design point (Harbitz, An efficient sampling method for probability of failure calculation,
Structural Safety 3, 1986), which bounds the weights there (Hesterberg, Weighted average importance sampling and
defensive mixture distributions, Technometrics 37, 1995).

A response surface separates most runs beyond the limit from the others. Its own probability is known from many places
that take no runs, so that the runs need to estimate the difference only: a control variate, which leaves the estimate
unbiased however wrong the surface is (Peherstorfer, Cui, Marzouk and Willcox, Multifidelity importance sampling,
Computer Methods in Applied Mechanics and Engineering 300, 2016).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special
from scipy.cluster import vq

from shoal.response.inputs import BoolArray, IntArray
from shoal.response.limits.estimate import ALIKE, ExceedanceEstimate, first_passages, weighted
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.margins import Margins, least
from shoal.trajectory import Array

WIDER = 1.3
"""A fitted distribution is made wider by this, as tails are longer than those of a normal one."""
FAR_OUT, TAIL = 0.2, 1.5
"""Share of the runs of a fitted distribution that are drawn this much wider still, for tails that are curved."""
ENOUGH = 4
"""Runs to which a distribution is fitted, at least."""
PLAIN = 0.2
"""Share of the runs around design points where there are fitted distributions as well."""
PARTS, MOST_PARTS = (1, 2, 4), 40
"""Fitted distributions for each design point; runs decide which number serves best; and how many there are at most
together if there are several for each."""
OTHERS = 0.3
"""Share of the mixtures fitted to other samples than the best: a response surface, or few runs, may have missed a
place."""
INSIDE = 0.98
"""Share of the distance of the nearest place known beyond the limit, from which on runs are drawn all around."""
FLAT = 0.05
"""Of the largest singular value of the normals at design points: below, a limit does not depend on a direction."""
FREE = 20
"""Places at which a response surface is evaluated, for each run."""
OUTSIDE: dict[int, list[tuple[float, ...]]] = {1: [(0.1,), (0.9,)], 2: [(0.05, 0.05), (0.1, 0.8), (0.8, 0.1)]}
"""Shares of the runs that are drawn all around, by the number of ways to do it; runs decide which serve best."""


@dataclass(frozen=True)
class Outside:
    """The standard normal distribution beyond a distance from the origin in some directions: in each of them alike.

    axes: orthonormal, of these directions, (directions, parameters)
    """

    axes: Array
    radius: float

    @property
    def probability(self) -> float:
        """Probability of the region."""
        return float(special.gammaincc(len(self.axes) / 2, self.radius**2 / 2))

    def draw(self, count: int, random: np.random.Generator) -> Array:
        """Draw places of the region, (count, parameters)."""
        places = random.standard_normal((count, self.axes.shape[1]))
        along = places @ self.axes.T
        squares = 2 * special.gammainccinv(len(self.axes) / 2, random.random(count) * self.probability)
        longer = np.sqrt(squares) / np.linalg.norm(along, axis=1) - 1
        return np.asarray(places + (longer[:, None] * along) @ self.axes)

    def reaches(self, places: Array) -> BoolArray:
        """Return whether places lie in the region, (places,)."""
        return np.asarray(np.linalg.norm(places @ self.axes.T, axis=1) >= self.radius)


def outsides(points: list[DesignPoint], beyond: Array) -> list[Outside]:
    """Return regions outside a radius in all directions and, if these are fewer, in those on which the limit depends.

    Just within the design points and the runs beyond the limit, (runs, parameters).
    """
    places = np.concatenate([[point.place for point in points], beyond])
    parameters = places.shape[1]
    _, sizes, axes = np.linalg.svd([point.normal for point in points])
    rank = int(np.sum(sizes > FLAT * sizes[0]))
    ways = [np.eye(parameters), axes[:rank]] if rank < parameters else [np.eye(parameters)]
    return [Outside(way, INSIDE * float(np.linalg.norm(places @ way.T, axis=1).min())) for way in ways]


@dataclass(frozen=True)
class Mixture:
    """Mixture of normal distributions and of the standard normal one outside a radius.

    shares: (parts,), of those that are normal; means: (parts, parameters); factors: Cholesky's, of covariances;
    outside, wide: what lies there, each with its share of all runs
    """

    shares: Array
    means: Array
    factors: Array
    outside: list[Outside]
    wide: tuple[float, ...]

    def mixed_with(self, other: Mixture, share: float) -> Mixture:
        """The normal distributions of both, of which those of the other have this share."""
        return replace(
            self,
            shares=np.concatenate([(1 - share) * self.shares, share * other.shares]),
            means=np.concatenate([self.means, other.means]),
            factors=np.concatenate([self.factors, other.factors]),
        )

    def draw(self, count: int, random: np.random.Generator) -> tuple[Array, IntArray]:
        """Draw stratified places of each component, (count, parameters).

        And which part each is of: below 0 those outside, as `outside` is indexed from its end.
        """
        edges = (random.random() + np.arange(count)) / count
        shares = np.concatenate([self.wide, (1 - sum(self.wide)) * self.shares])
        part = np.searchsorted(np.cumsum(shares)[:-1], edges) - len(self.outside)
        places = random.standard_normal((count, self.means.shape[1]))
        for k, (mean, factor) in enumerate(zip(self.means, self.factors, strict=True)):
            # Parts are drawn in order.
            here = slice(*np.searchsorted(part, (k, k + 1)))
            places[here] = mean + places[here] @ factor.T
        for k, one in enumerate(self.outside):
            here = part == k - len(self.outside)
            places[here] = one.draw(int(here.sum()), random)
        return places, part

    def weights(self, places: Array) -> Array:
        """Standard normal density over that of the mixture, (places,)."""
        square = 0.5 * np.sum(places**2, axis=1)
        logarithms = [
            np.where(one.reaches(places), np.log(share / one.probability), -np.inf)
            for share, one in zip(self.wide, self.outside, strict=True)
        ]
        inverses = np.linalg.inv(self.factors)
        for share, mean, inverse in zip((1 - sum(self.wide)) * self.shares, self.means, inverses, strict=True):
            standard = (places - mean) @ inverse.T
            size = np.log(share) + np.log(np.abs(np.diag(inverse))).sum()
            logarithms.append(size - 0.5 * np.sum(standard**2, axis=1) + square)
        return np.asarray(np.exp(-special.logsumexp(logarithms, axis=0)))


def around(points: list[DesignPoint], outside: list[Outside]) -> Mixture:
    """Return a mixture of unit normal distributions around the design points, by their first-order probabilities."""
    means = np.array([point.place for point in points])
    shares = np.array([max(point.probability, 1e-300) for point in points])
    # None is left out: a first-order probability may be off by far.
    shares = shares / shares.sum() + 0.2 / len(points)
    parameters = means.shape[1]
    unit = np.broadcast_to(np.eye(parameters), (len(points), parameters, parameters))
    return Mixture(shares / shares.sum(), means, unit, outside, OUTSIDE[len(outside)][0])


@dataclass(frozen=True)
class Sample:
    """Runs of a proposal: places, (runs, parameters), margins over time, (runs, instants), weights, (runs,).

    outside: margins of those that were drawn there, each with the probability of all that lies there
    """

    places: Array
    rows: Array
    weights: Array
    outside: tuple[tuple[Array, float], ...] = ()

    @property
    def estimate(self) -> ExceedanceEstimate:
        """Weighted estimate of the probability."""
        return weighted(self.rows, self.weights, f"importance sampling with {len(self.places)} runs")

    @property
    def beyond(self) -> Sample:
        """The runs in the failure domain."""
        return self._some(np.asarray((self.rows < 0).any(axis=1)))

    def shifted(self, off: Array) -> tuple[float, float, float]:
        """Return the probability if all margins were larger by `off`, (instants,), as they are, and if smaller."""
        chances_of = (
            float(self.weights[least(self.rows + by) < 0].sum() / len(self.weights)) for by in (off, 0 * off, -off)
        )
        fewer, same, more = (min(one, 1.0) for one in chances_of)
        return fewer, same, more

    @property
    def halves(self) -> tuple[Sample, Sample]:
        """Every second run, and the others."""
        odd = np.arange(len(self.places)) % 2 == 1
        return self._some(~odd), self._some(odd)

    def _some(self, which: BoolArray) -> Sample:
        return Sample(self.places[which], self.rows[which], self.weights[which])


def sample(margins: Margins, proposal: Mixture, count: int, seed: int) -> Sample:
    """Return `count` weighted runs drawn from a proposal. Raises InputError, TooManyRunsError."""
    places, part = proposal.draw(count, np.random.default_rng(seed))
    rows, ways = margins(places), proposal.outside
    outside = tuple((rows[part == k - len(ways)], way.probability) for k, way in enumerate(ways))
    return Sample(places, rows, proposal.weights(places), outside)


def controlled(found: Sample, proposal: Mixture, chances: Callable[[Array], Array], seed: int) -> ExceedanceEstimate:
    """The estimate of these runs with a control variate.

    proposal: that they are drawn from; chances: of a place to lie beyond the limit, by a response surface, (places,)
    """
    estimate, count = found.estimate, len(found.weights)
    beyond = found.weights * (found.rows < 0).any(axis=1)
    predicted = found.weights * chances(found.places)
    if not beyond.any() or not predicted.any():
        return estimate
    places, _ = proposal.draw(FREE * count, np.random.default_rng(seed))
    many = chances(places)
    some = many > 0
    many[some] *= proposal.weights(places[some])
    known = many.var() / len(many)
    covariance = np.cov(beyond, predicted) / count
    share = covariance[0, 1] / (covariance[1, 1] + known)
    probability = float(beyond.mean() - share * (predicted.mean() - many.mean()))
    variance = float((beyond - share * predicted).var(ddof=1)) / count + share**2 * known
    if probability <= 0 or variance >= float(covariance[0, 0]):
        return estimate
    deviation = max(math.sqrt(variance) / probability, ALIKE / np.count_nonzero(beyond))
    # Which part of it is exceeded up to an instant, the runs alone show: the variance of a ratio.
    instants, part = found.rows.shape[1], estimate.exceeded / estimate.probability
    first = first_passages(found.rows)
    inside = first < instants
    squares = np.cumsum(np.bincount(first[inside], found.weights[inside] ** 2, instants))
    scatter = (1 - part) ** 2 * squares + part**2 * (squares[-1] - squares)
    size = (count * estimate.exceeded) ** 2
    among = np.divide(scatter, size, out=np.full(instants, np.inf), where=size > 0)
    exceeded = np.minimum(estimate.exceeded * (probability / estimate.probability), 1.0)
    why = f"{estimate.why}, with a response surface as control variate,"
    return replace(estimate, exceeded=exceeded, deviation=np.sqrt(among + deviation**2), why=why)


def adapted(points: list[DesignPoint], found: Sequence[Sample], judge: Sample | None = None) -> Mixture:
    """A mixture with a part for the places beyond the limit that are nearest to each design point.

    Of several, the one that scatters least over places that it was not fitted to. found: samples, to each of which one
    is fitted; none before there are any; judge: runs that decide which has most weight, else it is the first
    """
    fitted = [_adapted(points, one.beyond) for one in found if len(one.beyond.places) >= ENOUGH]
    if not fitted:
        return around(points, outsides(points, np.zeros((0, len(points[0].place)))))
    if judge is not None and len(judge.beyond.places):
        fitted.sort(key=lambda one: _scatter(one, judge.beyond))
    best = fitted[0]
    for one in fitted[1:]:
        best = best.mixed_with(one, OTHERS / (len(fitted) - 1))
    return best


def _adapted(points: list[DesignPoint], beyond: Sample) -> Mixture:
    parameters = len(points[0].place)
    fitted, unseen = beyond.halves
    plain = around(points, outsides(points, beyond.places))
    parts = [count for count in PARTS if count == 1 or count * len(points) <= MOST_PARTS]
    shapes = [(0, 0.0), *itertools.product(parts, (parameters + 1.0, 0.5 * parameters**2))]
    tried = [(shape, _fitted(plain, fitted, *shape)) for shape in shapes]
    shape, proposal = min(
        ((shape, replace(one, wide=wide)) for shape, one in tried for wide in OUTSIDE[len(plain.outside)]),
        key=lambda each: _scatter(each[1], unseen),
    )
    return replace(_fitted(plain, beyond, *shape), wide=proposal.wide)


def _scatter(proposal: Mixture, of: Sample) -> float:
    """The second moment of the weights that a proposal would give, but for a factor."""
    return float(of.weights @ proposal.weights(of.places))


def _centres(beyond: Sample, parts: int) -> Array:
    """Return the centres of at most `parts` clusters of equal weight, by k-means, (centres, parameters)."""
    ends = np.cumsum(beyond.weights) / beyond.weights.sum()
    alike = beyond.places[np.searchsorted(ends[:-1], (np.arange(len(ends)) + 0.5) / len(ends))]
    guess = np.unique(alike, axis=0)
    guess = guess[:: math.ceil(len(guess) / parts)]
    # A guess of one row is taken for a number.
    return np.asarray(vq.kmeans(alike, guess)[0]) if len(guess) > 1 else guess


def _fitted(plain: Mixture, beyond: Sample, parts: int, prior: float) -> Mixture:
    """Return a mixture with `parts` components for each design point, which together follow a curved limit.

    plain: around the design points, which is what no parts give; prior: for how many observations of a unit covariance
    a part is taken, as few do not determine all directions
    """
    if not parts:
        return plain
    several = parts > 1 and len(beyond.places) >= ENOUGH * parts * len(plain.means)
    centres = _centres(beyond, parts * len(plain.means)) if several else plain.means
    nearest = np.linalg.norm(beyond.places[:, None] - centres, axis=2).argmin(axis=1)
    shares, means, factors = [], [], []
    for k in range(len(centres)):
        places, weights = beyond.places[nearest == k], beyond.weights[nearest == k]
        if len(places) < ENOUGH:
            continue
        mean = weights @ places / weights.sum()
        away = places - mean
        count = weights.sum() ** 2 / np.sum(weights**2)
        covariance = count * (weights * away.T) @ away / weights.sum() + prior * np.eye(len(mean))
        sizes, axes = np.linalg.eigh(covariance / (count + prior))
        sizes = np.maximum(np.minimum(WIDER**2 * sizes, 1.0), sizes)
        factor = np.linalg.cholesky((axes * sizes) @ axes.T)
        for share, size in ((1 - FAR_OUT, 1.0), (FAR_OUT, TAIL)):
            shares.append(share * weights.sum())
            means.append(mean)
            factors.append(size * factor)
    if not means:
        return plain
    fitted = replace(plain, shares=np.array(shares) / sum(shares), means=np.array(means), factors=np.array(factors))
    return plain.mixed_with(fitted, 1 - PLAIN)
