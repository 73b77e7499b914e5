"""Stated error of a prediction (noise, covariance, systematic residual), checked by parts of the fit left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import LEVEL
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.measurement import HeldOut
from shoal.identification.uncertainty.chances import chi_square_above
from shoal.identification.uncertainty.covariance import Block
from shoal.identification.uncertainty.linearisation import ABSORBED, Linearisation, linearise, quantile
from shoal.identification.uncertainty.sensitivity import Sensitivity
from shoal.identification.uncertainty.uncertain_inputs import Given
from shoal.trajectory import Array

_FEWEST_PARTS = 4
"""Of a fit, at least, in which the size of its residual is compared."""


@dataclass(frozen=True)
class Fit:
    """A fit: its weighted rows with their blocks, and what follows from them; fields: those that are uncertain."""

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
    """Error band of one channel: expected RMS, limit of the RMS, and the half width of the band, (samples,)."""

    expected: float
    limit: float
    half: Array


def unevenness(residual: Array, count: int) -> float:
    """Variance of the mean square of `count` neighbouring residuals, relative to its square, as parts of the fit show.

    Noise that is larger at times, or has outliers, makes it larger than its memory does.
    """
    length = min(count, len(residual) // _FEWEST_PARTS)
    power = float(np.mean(residual**2)) if len(residual) else 0.0
    if length < 1 or power <= 0.0:
        return 0.0
    parts = [np.mean(residual[k : k + length] ** 2) for k in range(0, len(residual) - length + 1, max(1, length // 2))]
    return float(np.var(parts, ddof=1)) / power**2


def stated(slopes: Array, at: Linearisation, block: int, weight: float, level: float, uneven: float = 0.0) -> ErrorBand:
    """Stated error of an RMS over samples with derivatives (samples, parameters), all in SI units.

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


Mask = npt.NDArray[np.bool_]

_PARTS = np.array([1.0, 1.25, 1.5, 1.75, 2.0])
"""Lengths of a window from the end of the fit to where parts are left out that try the stated error."""
_MOST = 0.5
"""Of a fit: no longer part is left out."""


def allowance(model: ForwardModel, name: str, held: HeldOut, fit: Fit) -> float:
    """By what the stated error has to be made larger so that it holds for parts of the fit that are left out of it."""
    number = list(model.measurement.recordings).index(name)
    found = 1.0
    for left_out, kept in _parts(model, number, held, len(fit.seen.residual)):
        found = max(found, _too_small(model, number, left_out, kept, fit))
    return found


def _parts(model: ForwardModel, number: int, held: HeldOut, count: int) -> Iterator[tuple[Mask, Mask]]:
    """Rows that are left out, and rows that are fitted instead, (rows,) each, as far from each other as the window is.

    Beyond the end (or before the beginning) of what was fitted nothing behind a part is fitted either.
    """
    rows = model.rows
    times = rows.time[rows.recording == number]
    first, last = float(times.min()), float(times.max())
    begin, end = float(held.times[0]), float(held.times[-1])
    length = min(max(end - begin, 0.0), _MOST * (last - first))
    if length <= 0.0:
        return
    priors = np.zeros(count - len(rows.time), dtype=bool)
    for part in _PARTS:
        if begin >= last:
            low = last - part * length
            if low < first + _MOST * _MOST * (last - first):
                return
            ahead = rows.time > low
        elif end <= first:
            low = first + (part - 1.0) * length
            ahead = rows.time < low + length
        else:
            low = first + (part - 1.0) * (last - first - length)
            ahead = (rows.time > low) & (rows.time < low + length)
        mine = rows.recording == number
        out = mine & (rows.time > low) & (rows.time <= low + length + 1e-12)
        if np.any(out):
            yield np.append(out, priors), np.append(~(mine & (ahead | out)), ~priors)


def _too_small(model: ForwardModel, number: int, out: Mask, kept: Mask, fit: Fit) -> float:
    """Ratio of the error of a part that was left out to the stated one, to first order; 1 where it is unknown.

    A fit of the rest moves from the answer by a Gauss-Newton step.
    """
    place = np.cumsum(kept) - 1
    blocks = []
    for block in fit.blocks:
        rows = block.rows[kept[block.rows]]
        if not len(rows):
            return 1.0
        if block.known:
            blocks.append(replace(block, rows=place[rows]))
            continue
        gaps = np.diff(model.rows.time[rows])
        gaps = gaps / np.median(gaps) if len(gaps) else gaps
        blocks.append(replace(block, rows=place[rows], gaps=gaps))
    jacobian, residual, error = fit.seen.jacobian[kept], fit.seen.residual[kept], fit.seen.error[kept]
    if not np.all(np.isfinite(jacobian)) or np.count_nonzero(kept) <= 2 * len(fit.sizes):
        return 1.0
    first = linearise(jacobian, residual, fit.sizes, blocks, error)
    if first.unknown.size > fit.at.unknown.size:
        return 1.0
    step = first.pseudo_inverse @ residual
    left = residual - jacobian @ step
    at = linearise(jacobian, left, fit.sizes, blocks, error)
    share = float(np.linalg.norm(left) / max(float(np.linalg.norm(fit.seen.residual)), 1e-300))
    at = replace(at, systematic=fit.at.systematic * share)
    worst = 1.0
    for channel in range(len(list(model.measurement.recordings.values())[number].channels)):
        rows = np.flatnonzero(out[: len(model.rows.time)] & (model.rows.channel == channel))
        mine = block_of(model, number, channel, fit)
        if not len(rows) or mine is None:
            continue
        weight = float(model.rows.weight[rows[0]])
        slopes = fit.seen.jacobian[rows] / weight
        off = (fit.seen.residual[rows] - fit.seen.jacobian[rows] @ step) / weight
        band = stated(slopes, at, mine, weight, LEVEL, unevenness(left[blocks[mine].rows], len(rows)))
        worst = max(worst, float(np.sqrt(np.mean(off**2))) / max(band.limit, 1e-300))
    return worst
