"""How much draws of Markov chains are worth: R-hat and effective sizes of Vehtari et al. (Bayesian Analysis 16, 2021).

The walkers of an ensemble may follow one another, so the chains here are the means over an ensemble's walkers. With one
walker each, all figures are those of that paper.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.special import ndtri
from scipy.stats import rankdata

from shoal.trajectory import Array

TAILS = (0.05, 0.95)
"""Quantiles whose effective size is that of the tails."""


def r_hat(draws: Array) -> float:
    """Of draws (ensembles, steps, walkers): spread of all over that within half an ensemble's run, at least about 1.

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
    """So many independent draws would tell the mean as well as draws (ensembles, steps, walkers) do.

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
    ranks = rankdata(draws, axis=None).reshape(draws.shape)
    return np.asarray(ndtri((ranks - 0.375) / (draws.size + 0.25)))


def _autocovariance(chains: Array) -> Array:
    """Of every row, (rows, steps), over the number of steps."""
    steps = chains.shape[1]
    room = next_fast_len(2 * steps)
    found = rfft(chains - chains.mean(axis=1, keepdims=True), room, axis=1)
    return np.asarray(irfft(np.abs(found) ** 2, room, axis=1)[:, :steps] / steps)
