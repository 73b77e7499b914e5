"""The noise of the residuals by channel and recording: its size, and how long it remembers (AR(1)).

Residuals are smaller and less correlated than the noise, because the fit follows it. With the projector P = I - Q Q'
onto what no parameter can follow, the expected moments of residuals are traces of A P R P. Size and correlation are
such that these are the moments found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import DOUBT
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.chances import above_chi_square
from shoal.trajectory import Array

_ROUNDS = 60
"""Iterations of the moment equations, at most."""
_SETTLED = 1e-5
"""Change of a correlation that ends them."""
_LONGEST = 1.0 / 3.0
"""Correlation that outlasts this part of a recording cannot be distinguished from a change of the parameters."""


@dataclass(frozen=True)
class Block:
    """The rows of one channel in one recording, in the order of time.

    rows: their numbers, (n,); gaps: between neighbours, in units of the median one, (n - 1,)
    stated: standard deviation of a (weighted) row, 0 if none is stated; known: whether it is exact, as a prior's is
    """

    rows: npt.NDArray[np.intp]
    gaps: Array
    stated: float = 0.0
    known: bool = False


@dataclass(frozen=True)
class Noise:
    """Variance, correlation of neighbours, and degrees of freedom with which a variance of an estimate is known."""

    variance: float
    rho: float
    freedom: float

    def independent(self, count: int) -> float:
        """Effective number of independent samples among `count`."""
        return count * (1.0 - self.rho) / (1.0 + self.rho)


def blocks_of(model: ForwardModel, count: int) -> list[Block]:
    """The blocks of a model's residuals (count,); priors, at the end, are blocks of known noise."""
    rows, blocks = model.rows, []
    for recording, channel in sorted(set(zip(rows.recording.tolist(), rows.channel.tolist(), strict=True))):
        mine = np.flatnonzero((rows.recording == recording) & (rows.channel == channel))
        gaps = np.diff(rows.time[mine])
        gaps = gaps / np.median(gaps) if len(gaps) else gaps
        blocks.append(Block(mine, gaps, model.rows.noise or 0.0))
    priors = [
        Block(np.array([row]), np.zeros(0), model.rows.noise or 1.0, True) for row in range(len(rows.time), count)
    ]
    return blocks + priors


def correlate(block: Block, rho: float, columns: Array) -> Array:
    """R X with R = rho^|gap|, for columns X (n, k), in one pass forwards and one backwards."""
    decay = rho**block.gaps
    if not np.any(decay):
        return columns
    ahead, behind = np.zeros_like(columns), np.zeros_like(columns)
    for i, a in enumerate(decay):
        ahead[i + 1] = a * (ahead[i] + columns[i])
    for i in range(len(decay) - 1, -1, -1):
        behind[i] = decay[i] * (behind[i + 1] + columns[i + 1])
    return np.asarray(columns + ahead + behind)


def estimate_noise(residual: Array, basis: Array, blocks: list[Block]) -> list[Noise]:
    """The noise of each block.

    residual: (rows,); basis: orthonormal columns Q that span what the parameters can change, (rows, k)
    A stated noise is the least that is believed. Correlation is not negative: that would narrow intervals.
    """
    parts = [basis[block.rows] for block in blocks]
    moments = [_moments(block, residual[block.rows][:, None]) for block in blocks]
    variance = np.array([b.stated**2 if b.known else m[0] / len(b.rows) for b, m in zip(blocks, moments, strict=True)])
    rho, most = np.zeros(len(blocks)), np.array([np.exp(-1.0 / (_LONGEST * max(len(b.rows), 2))) for b in blocks])
    free = [k for k, block in enumerate(blocks) if not block.known and len(block.rows) > 2 and moments[k][0] > 0]
    for _ in range(_ROUNDS if free else 0):
        spread = [correlate(b, r, q) for b, r, q in zip(blocks, rho, parts, strict=True)]
        followed = sum(v * q.T @ s for v, q, s in zip(variance, parts, spread, strict=True))
        before = rho.copy()
        for k in free:
            size, neighbours = _expected(blocks[k], variance[k], rho[k], parts[k], spread[k], np.asarray(followed))
            if size <= 0.0:
                rho[k] = most[k]
                continue
            found = moments[k][1] / moments[k][0]
            variance[k] *= np.clip(moments[k][0] / size, 0.2, 5.0)
            rho[k] = np.clip(rho[k] + found - neighbours / size, 0.0, most[k])
        if np.max(np.abs(rho - before)) < _SETTLED:
            break
    return [_noise(b, v, r, q) for b, v, r, q in zip(blocks, variance, rho, parts, strict=True)]


def _moments(block: Block, columns: Array) -> tuple[float, float]:
    """Sums over samples and over neighbours, the traces of X'X and X'AX for columns X (n, k)."""
    near = block.gaps < 1.5
    return float(np.sum(columns**2)), float(np.sum((columns[1:] * columns[:-1])[near]))


def _expected(
    block: Block, variance: float, rho: float, part: Array, spread: Array, followed: Array
) -> tuple[float, float]:
    """Moments that residuals of noise R have, tr(A R) - 2 tr(Q'R A Q) + tr(Q'R Q Q'A Q), for A = I and neighbours."""
    near = (block.gaps < 1.5)[:, None]
    beside = np.zeros_like(part)
    beside[:-1] += 0.5 * near * part[1:]
    beside[1:] += 0.5 * near * part[:-1]
    size = variance * (len(block.rows) - 2 * np.sum(spread * part)) + np.sum(followed * (part.T @ part))
    chain = float(np.sum((rho**block.gaps)[block.gaps < 1.5]))
    neighbours = variance * (chain - 2 * np.sum(spread * beside)) + np.sum(followed * (part.T @ beside))
    return float(size), float(neighbours)


def _noise(block: Block, variance: float, rho: float, part: Array) -> Noise:
    """The noise with degrees of freedom by Satterthwaite (1946).

    A stated noise is believed, unless a test at the level DOUBT contradicts it. Its correlation is not stated: the
    estimate is drawn towards none by its own variance of 1/n (James and Stein 1961), and its freedom is what remains of
    the formula below.

    The logarithm of the variance of a mean is ln s^2 - 2 ln(1 - rho), where ln s^2 and rho of an AR(1) process have
    variances of 2/n and (1 - rho^2)/n (Priestley, Spectral Analysis and Time Series, 1981, 5.4).
    """
    if block.known:
        return Noise(variance, 0.0, np.inf)
    count = max(1.0, len(block.rows) - float(np.sum(part**2)))
    independent = max(1.0, count * (1.0 - rho**2) / (1.0 + rho**2))
    if block.stated > 0.0 and above_chi_square(independent, independent * variance / block.stated**2) > DOUBT:
        rho *= max(0.0, 1.0 - 1.0 / (count * max(rho, 1e-9) ** 2))
        freedom = count * (1.0 - rho) / (2.0 * (1.0 + rho)) if rho > 0.0 else np.inf
        return Noise(block.stated**2, float(rho), max(1.0, freedom))
    freedom = count / (1.0 + 2.0 * (1.0 + rho) / (1.0 - rho))
    return Noise(max(float(variance), block.stated**2), float(rho), max(1.0, freedom))
