"""What an estimate says of the error of a prediction: noise, the parameters' covariance, and what is systematic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.spread.chances import chi_square_above
from shoal.identification.spread.covariance import Block
from shoal.identification.spread.given import Given
from shoal.identification.spread.sensitivity import Sensitivity
from shoal.identification.spread.uncertainty import ABSORBED, Linearisation, quantile
from shoal.trajectory import Array

_FEWEST_PARTS = 4
"""Of a fit, at least, in which the size of its residual is compared."""


@dataclass(frozen=True)
class Fit:
    """What was fitted: rows (weighted) with their blocks, and what follows from them; fields: that are uncertain."""

    seen: Sensitivity
    blocks: list[Block]
    at: Linearisation
    sizes: Array
    fields: Given | None


def block_of(model: ForwardModel, recording: int, channel: int, fit: Fit) -> int | None:
    """The number of the block of a channel."""
    rows = model.rows
    for number, block in enumerate(fit.blocks):
        if not block.known and len(block.rows):
            first = block.rows[0]
            if rows.recording[first] == recording and rows.channel[first] == channel:
                return number
    return None


@dataclass(frozen=True)
class ErrorBand:
    """Of one channel: expected RMS, what it stays below, and the half width of the band, (samples,)."""

    expected: float
    limit: float
    half: Array


def unevenness(residual: Array, count: int) -> float:
    """Variance of the mean square of so many neighbouring residuals, relative to its square, as parts of the fit show.

    Noise that is larger at times, or has outliers, makes it larger than its memory does.
    """
    length = min(count, len(residual) // _FEWEST_PARTS)
    power = float(np.mean(residual**2)) if len(residual) else 0.0
    if length < 1 or power <= 0.0:
        return 0.0
    parts = [np.mean(residual[k : k + length] ** 2) for k in range(0, len(residual) - length + 1, max(1, length // 2))]
    return float(np.var(parts, ddof=1)) / power**2


def stated(slopes: Array, at: Linearisation, block: int, weight: float, level: float, uneven: float = 0.0) -> ErrorBand:
    """What an estimate says of an RMS over samples with derivatives (samples, parameters), all in SI units.

    The mean square of the error is a sum of squares of normal numbers with different variances: by its mean and its
    variance it is taken for a multiple of chi-square (Satterthwaite 1946). What is systematic adds to it.
    uneven: relative variance of the mean square that the fit shows, where it is more than that of such noise
    """
    noise, count = at.noise[block], len(slopes)
    variance = noise.variance / weight**2
    root = np.linalg.cholesky(at.covariance + 1e-14 * np.diag(np.maximum(np.diag(at.covariance), 1e-300)))
    power = np.linalg.svd(slopes @ root, compute_uv=False) ** 2 / count
    independent = max(1.0, count * (1.0 - noise.rho**2) / (1.0 + noise.rho**2))
    mean = variance + float(np.sum(power))
    spread = variance**2 * max(1.0 / independent, 0.5 * uneven) + float(np.sum(power**2))
    freedom = mean**2 / spread
    shares = np.maximum(np.einsum("ni,bij,nj->b", slopes, at.parts, slopes) / count, 0.0)
    shares[block] += variance
    normal = np.sqrt(chi_square_above(1.0, 1.0 - level))
    doubt = quantile(shares, at.noise, level) / normal
    lever = slopes @ at.pseudo_inverse
    follows = ABSORBED * at.systematic
    systematic = follows * float(np.linalg.svd(lever, compute_uv=False)[0]) / np.sqrt(count)
    above = chi_square_above(freedom, 1.0 - level) / freedom * mean * doubt**2
    each = variance + np.einsum("ni,ij,nj->n", slopes, at.covariance, slopes)
    half = np.hypot(quantile(shares, at.noise) * np.sqrt(each), follows * np.linalg.norm(lever, axis=1))
    return ErrorBand(float(np.sqrt(mean)), float(np.hypot(np.sqrt(above), systematic)), half)
