"""Parts of a fit that are left out of it, to first order: whether the stated error of a prediction holds for them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from shoal.identification.forward import ForwardModel
from shoal.identification.recording.measurement import HeldOut
from shoal.identification.spread.stated_error import Fit, block_of, stated, unevenness
from shoal.identification.spread.uncertainty import LEVEL, linearise

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
    """How much larger than stated the error of a part is that was left out, to first order; 1 where it cannot be told.

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
        told = stated(slopes, at, mine, weight, LEVEL, unevenness(left[blocks[mine].rows], len(rows)))
        worst = max(worst, float(np.sqrt(np.mean(off**2))) / max(told.limit, 1e-300))
    return worst
