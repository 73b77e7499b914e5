"""Sampling of a density: independent draws from a Student distribution, differences of walkers (emcee), convergence."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.errors import InputError
from shoal.trajectory import Array

if TYPE_CHECKING:
    from emcee import EnsembleSampler

LogDensity = Callable[[Array], Array]
"""The logarithm of a density at points (count, parameters), (count,); -inf where it has none."""

ENSEMBLES = 4
"""Independent ensembles, whose walkers look at each other only."""
_FREEDOM = 5.0
"""Of the Student distribution of independent draws, whose tails should be heavier than those of the posterior."""
_MOVES = {True: (0.75, 0.2, 0.05), False: (0.3, 0.6, 0.1)}
"""Shares of independent draws, of differences of walkers, and of stretches, where the posterior is like what is drawn
from about the answer, and elsewhere: more of the first mix faster there, but leave the tails of bent ones without their
due."""


class Independent:
    """Student's t about a centre, draws of which know nothing of where a walker is."""

    def __init__(self, centre: Array, root: Array) -> None:
        self.centre, self.root, self.inverse = centre, root, np.linalg.inv(root)

    @classmethod
    def of(cls, draws: Array, before: Independent, weights: Array | None = None) -> Independent:
        """Return that of the mean and covariance of draws (draws, parameters); the one before where they have none."""
        covariance = np.atleast_2d(np.cov(draws.T, aweights=weights))
        try:
            return cls(np.average(draws, axis=0, weights=weights), np.asarray(np.linalg.cholesky(covariance)))
        except np.linalg.LinAlgError:
            return before

    def draw(self, count: int, rng: np.random.RandomState) -> Array:
        """Points, (count, parameters)."""
        normal = rng.standard_normal((count, len(self.centre)))
        wide = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, (count, 1)))
        return np.asarray(self.centre + (normal * wide) @ self.root.T)

    def log_density(self, points: Array) -> Array:
        """Logarithm of the density at points (count, parameters), but for a constant."""
        away = np.sum(((points - self.centre) @ self.inverse.T) ** 2, axis=1)
        return np.asarray(-(_FREEDOM + len(self.centre)) / 2 * np.log1p(away / _FREEDOM))

    def propose(self, points: Array, rng: np.random.RandomState) -> tuple[Array, Array]:
        """New points and the logarithm of the ratio of densities, as emcee wants it."""
        fresh = self.draw(len(points), rng)
        return fresh, self.log_density(points) - self.log_density(fresh)


def weights(logarithms: Array) -> Array:
    """Weights of draws, which add up to 1, from their logarithms; the first has all where none can be simulated."""
    most = float(np.max(logarithms))
    if not np.isfinite(most):
        return np.asarray(np.eye(len(logarithms))[0])
    shares = np.exp(logarithms - most)
    return np.asarray(shares / np.sum(shares))


def possible(density: LogDensity, near: Independent, count: int, rng: np.random.RandomState) -> Array:
    """Points with a density, (count, parameters), from a distribution that narrows until it has some."""
    points = np.empty((0, len(near.centre)))
    for attempt in range(30):
        tried = near.centre + (near.draw(count, rng) - near.centre) * 0.8**attempt
        points = np.concatenate([points, tried[np.isfinite(density(tried))]])
        if len(points) >= count:
            return points[:count]
    raise InputError("sample: no parameters beside the answer can be simulated; nothing can be drawn")


def sampler(density: LogDensity, near: Independent, walkers: int, alike: bool) -> EnsembleSampler:
    """Return a sampler of walkers; near: distribution of independent draws; alike: whether the density is like that."""
    from emcee import EnsembleSampler
    from emcee.moves import DEMove, MHMove, StretchMove

    # Halves are every other walker, so that each has its part of every ensemble, in order.
    among = [_apart(move(randomize_split=False)) for move in (DEMove, StretchMove)]
    moves = list(zip((MHMove(near.propose), *among), _MOVES[alike], strict=True))
    found = EnsembleSampler(walkers, len(near.centre), density, moves=moves, vectorize=True)
    # The wrapper around it prints every exception with all points to stdout, also the expected one of a deadline.
    found.log_prob_fn = density
    return found


def _apart(move: Any) -> Any:
    """A move of emcee that looks at walkers of the same ensemble only."""
    propose = move.get_proposal

    def proposal(half: Array, others: list[Array], rng: np.random.RandomState) -> tuple[Array, Array]:
        pairs = zip(np.split(half, ENSEMBLES), np.split(others[0], ENSEMBLES), strict=True)
        found = [propose(mine, [theirs], rng) for mine, theirs in pairs]
        return np.concatenate([fresh for fresh, _ in found]), np.concatenate([factor for _, factor in found])

    move.get_proposal = proposal
    return move


TAILS = (0.05, 0.95)
"""Quantiles whose effective size is that of the tails."""


def r_hat(draws: Array) -> float:
    """R-hat of draws (ensembles, steps, walkers): spread of all over that within half a run, at least about 1.

    The larger one of places and of widths, by ranks.
    """
    folded = np.abs(draws - np.median(draws))
    return max(_reduction(_halves(_scores(part))) for part in (draws, folded))


def bulk_size(draws: Array) -> float:
    """Effective size of draws (ensembles, steps, walkers) for where the middle lies, by ranks."""
    return effective_size(_scores(draws))


def tail_size(draws: Array) -> float:
    """Effective size of draws (ensembles, steps, walkers) for the quantiles of TAILS, the smaller one."""
    return min(effective_size(np.asarray(draws <= np.quantile(draws, tail), dtype=float)) for tail in TAILS)


def effective_size(draws: Array) -> float:
    """Effective sample size for the mean of draws (ensembles, steps, walkers).

    The autocorrelation is summed to where pairs of neighbours turn negative, and never rises (Geyer 1992).
    """
    parts = _halves(draws)
    count, steps = parts.shape[:2]
    if np.ptp(draws) == 0.0:
        return float(draws.size)
    means = parts.mean(axis=2)
    covariance = _autocovariance(means).mean(axis=0)
    within = covariance[0] * steps / (steps - 1)
    total = covariance[0] + (np.var(means.mean(axis=1), ddof=1) if count > 1 else 0.0)
    if total == 0.0:
        return float(draws.size)
    rho = 1.0 - (within - covariance) / total
    rho[0] = 1.0
    last = 2 * ((steps - 3 + 1) // 2)
    pairs = rho[0:last:2] + rho[1 : last + 1 : 2]
    kept = int(np.argmax(pairs < 0.0)) if np.any(pairs < 0.0) else len(pairs) - 1
    left = max(float(rho[2 * kept]), 0.0)
    tau = -1.0 + 2.0 * float(np.sum(np.minimum.accumulate(pairs[:kept]))) + left
    independent = count * steps / max(tau, 1.0 / np.log10(count * steps))
    return float(independent * _spread(parts) / total)


def _reduction(parts: Array) -> float:
    width = float(np.mean(np.var(parts, axis=(1, 2), ddof=1)))
    return float(np.sqrt(_spread(parts) / width)) if width > 0.0 else np.inf


def _spread(parts: Array) -> float:
    """Variance of one draw, from that within the parts (parts, steps, walkers) and that of their means."""
    size = parts.shape[1] * parts.shape[2]
    within = float(np.mean(np.var(parts, axis=(1, 2))))
    return within + (float(np.var(parts.mean(axis=(1, 2)), ddof=1)) if len(parts) > 1 and size > 1 else 0.0)


def _halves(draws: Array) -> Array:
    """Both halves of every ensemble's run as parts of their own."""
    half = draws.shape[1] // 2
    return np.concatenate([draws[:, :half], draws[:, -half:]])


def _scores(draws: Array) -> Array:
    """Normal scores of the ranks (Blom 1958)."""
    from scipy.special import ndtri
    from scipy.stats import rankdata  # a second to import

    ranks = rankdata(draws, axis=None).reshape(draws.shape)
    return np.asarray(ndtri((ranks - 0.375) / (draws.size + 0.25)))


def _autocovariance(chains: Array) -> Array:
    """Autocovariance of every row, (rows, steps), over the number of steps."""
    from scipy.fft import irfft, next_fast_len, rfft

    steps = chains.shape[1]
    room = next_fast_len(2 * steps)
    found = rfft(chains - chains.mean(axis=1, keepdims=True), room, axis=1)
    return np.asarray(irfft(np.abs(found) ** 2, room, axis=1)[:, :steps] / steps)
