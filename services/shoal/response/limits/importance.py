"""Importance sampling: runs around the places where a limit is passed, weighted by how much rarer they really are.

Proposals are mixtures of normal distributions: one around every design point (Melchers, Importance sampling in
structural systems, Structural Safety 6, 1989), and some for the runs beyond the limit that belong to it, with their
means and covariances (Ang, Ang and Tang, Optimal importance-sampling density estimator, 1992, in the form of cross
entropy).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy import special
from scipy.cluster import vq

from shoal.response.inputs import BoolArray
from shoal.response.limits.estimate import Estimate, weighted
from shoal.response.limits.form import DesignPoint
from shoal.response.limits.margins import Margins
from shoal.trajectory import Array

WIDER = 1.3
"""A fitted distribution is made wider by this, as tails are longer than those of a normal one."""
FAR_OUT, TAIL = 0.2, 1.5
"""Share of the runs of a fitted distribution that are drawn this much wider still, for tails that are curved."""
ENOUGH = 4
"""Runs that tell of a distribution."""
PLAIN = 0.2
"""Share of the runs around design points where there are fitted distributions as well."""
PARTS = (1, 2, 4, 6)
"""Fitted distributions for each design point; which number serves best, runs tell."""


@dataclass(frozen=True)
class Mixture:
    """Of normal distributions. shares: (parts,); means: (parts, parameters); factors: Cholesky's, of covariances."""

    shares: Array
    means: Array
    factors: Array

    def beside(self, other: Mixture, share: float) -> Mixture:
        """Both, of which the other has this share."""
        return Mixture(
            np.concatenate([(1 - share) * self.shares, share * other.shares]),
            np.concatenate([self.means, other.means]),
            np.concatenate([self.factors, other.factors]),
        )

    def draw(self, count: int, random: np.random.Generator) -> Array:
        """As many of each part as its share says, but for rounding, which chance decides, (count, parameters)."""
        edges = (random.random() + np.arange(count)) / count
        part = np.searchsorted(np.cumsum(self.shares)[:-1], edges)
        normal = random.standard_normal((count, self.means.shape[1]))
        return np.asarray(self.means[part] + np.einsum("nij,nj->ni", self.factors[part], normal))

    def weights(self, places: Array) -> Array:
        """Standard normal density over that of the mixture, (places,)."""
        logarithms = []
        for share, mean, factor in zip(self.shares, self.means, self.factors, strict=True):
            standard = np.linalg.solve(factor, (places - mean).T).T
            logarithms.append(np.log(share) - 0.5 * np.sum(standard**2, axis=1) - np.log(np.abs(np.diag(factor))).sum())
        return np.asarray(np.exp(-0.5 * np.sum(places**2, axis=1) - special.logsumexp(logarithms, axis=0)))


def around(points: list[DesignPoint]) -> Mixture:
    """One unit normal distribution around each design point, by their first-order probabilities."""
    means = np.array([point.place for point in points])
    shares = np.array([max(point.probability, 1e-300) for point in points])
    # None is left out: a first-order probability may be off by far.
    shares = shares / shares.sum() + 0.2 / len(points)
    parameters = means.shape[1]
    return Mixture(shares / shares.sum(), means, np.broadcast_to(np.eye(parameters), (len(points), *[parameters] * 2)))


@dataclass(frozen=True)
class Sample:
    """Runs of a proposal: places, (runs, parameters), margins over time, (runs, instants), weights, (runs,)."""

    places: Array
    rows: Array
    weights: Array

    @property
    def estimate(self) -> Estimate:
        """What they tell."""
        return weighted(self.rows, self.weights, f"importance sampling with {len(self.places)} runs")

    @property
    def beyond(self) -> Sample:
        """Of the runs that pass the limit."""
        return self._some(np.asarray((self.rows < 0).any(axis=1)))

    @property
    def halves(self) -> tuple[Sample, Sample]:
        """Every second run, and the others."""
        odd = np.arange(len(self.places)) % 2 == 1
        return self._some(~odd), self._some(odd)

    def _some(self, which: BoolArray) -> Sample:
        return Sample(self.places[which], self.rows[which], self.weights[which])


def sample(margins: Margins, proposal: Mixture, count: int, seed: int) -> Sample:
    """So many runs. Raises InputError, TooManyRunsError."""
    places = proposal.draw(count, np.random.default_rng(seed))
    return Sample(places, margins(places), proposal.weights(places))


def adapted(points: list[DesignPoint], found: Sample) -> Mixture:
    """A mixture with a part for the runs beyond the limit that are nearest to each design point.

    Of several, the one that scatters least over runs that it was not fitted to.
    """
    parameters, beyond = len(points[0].place), found.beyond
    fitted, unseen = beyond.halves
    best, least = around(points), _scatter(around(points), unseen)
    for parts, prior in itertools.product(PARTS, (parameters + 1.0, 0.5 * parameters**2)):
        scatter = _scatter(_fitted(points, fitted, parts, prior), unseen)
        if scatter < least:
            best, least = _fitted(points, beyond, parts, prior), scatter
    return best


def _scatter(proposal: Mixture, of: Sample) -> float:
    """The second moment of the weights that a proposal would give, but for a factor."""
    return float(of.weights @ proposal.weights(of.places))


def _centres(beyond: Sample, parts: int) -> Array:
    """Of so many groups of alike weight, by k-means, (at most so many, parameters)."""
    ends = np.cumsum(beyond.weights) / beyond.weights.sum()
    alike = beyond.places[np.searchsorted(ends[:-1], (np.arange(len(ends)) + 0.5) / len(ends))]
    guess = np.unique(alike, axis=0)
    guess = guess[:: math.ceil(len(guess) / parts)]
    # A guess of one row is taken for a number.
    return np.asarray(vq.kmeans(alike, guess)[0]) if len(guess) > 1 else guess


def _fitted(points: list[DesignPoint], beyond: Sample, parts: int, prior: float) -> Mixture:
    """parts: for each design point, as no single normal distribution follows a limit that bends.

    prior: for how many observations of a unit covariance a part is taken, as few tell little of all directions
    """
    plain = around(points)
    several = parts > 1 and len(beyond.places) >= ENOUGH * parts * len(points)
    centres = _centres(beyond, parts * len(points)) if several else plain.means
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
    return plain.beside(Mixture(np.array(shares) / sum(shares), np.array(means), np.array(factors)), 1 - PLAIN)
