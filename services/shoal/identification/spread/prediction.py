"""Windows that were not fitted, predicted by the answer: how far off, and how far off the estimate says it may be.

The stated error has three parts: noise as large and as correlated as in the fit, the covariance of the parameters
carried on by the derivatives there, and what a systematic residual lets the parameters be off. Where the residual is
systematic the model itself is wrong by an amount that grows beyond the fit. How fast is tried inside the fit: parts of
the same length are left out, the rest is fitted without them (to first order), and where the stated error of these is
too small, that of the window is made larger in proportion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.identification.forward import ForwardModel
from shoal.identification.recording.measurement import Held
from shoal.identification.recording.units import of_channel
from shoal.identification.spread.chances import chi_square_above
from shoal.identification.spread.covariance import Block
from shoal.identification.spread.model_error import ModelError, model_error
from shoal.identification.spread.sensitivity import AGREED, Sensitivity, sensitivity
from shoal.identification.spread.uncertainty import ABSORBED, LEVEL, Linearisation, linearise, quantile
from shoal.trajectory import Array, plain

Mask = npt.NDArray[np.bool_]

_REFUTES = 1e-4
"""Chance by Satterthwaite's approximation, whose tail is up to several times too thin: a right model is refuted by its
windows, all of them together, less than once in a thousand times."""
_HIDDEN = 1e-3
"""Share of a derivative along directions that the data leave open, from which on a prediction is not known."""
_PARTS = np.array([1.0, 1.25, 1.5, 1.75, 2.0])
"""Lengths of a window from the end of the fit to where parts are left out that try the stated error."""
_FEWEST_PARTS = 4
"""Of a fit, at least, in which the size of its residual is compared."""
_MOST = 0.5
"""Of a fit: no longer part is left out."""


@dataclass(frozen=True)
class Foretold:
    """One channel over a window, in SI units. name: of it in words.

    rms: of model minus measurement; expected: what noise and the parameters' covariance predict for it; limit: what it
    stays below in 95 % of windows, model error included, nan where that cannot be told; inside: whether it does
    most: likewise what it stays below but for a chance below 0.001: what is above refutes the model
    """

    name: str
    marker: str
    quantity: str
    unit: str
    rms: float
    expected: float
    limit: float
    most: float

    @property
    def inside(self) -> bool | None:
        """Whether the error is one that the estimate states; None where it states none."""
        return bool(self.rms <= self.limit) if np.isfinite(self.limit) else None

    def to_json(self) -> dict[str, Any]:
        """All fields, and whether it is inside."""
        return plain({**vars(self), "inside": self.inside})  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Prediction:
    """A window [s] by the recording's clock that was not fitted, as `hold_out` states it.

    times [s], (samples,), from the start of the motion; measured, predicted and half (the half width of the band that
    holds 95 % of the samples): (samples, channels)
    allowance: by what the stated error is made larger for a systematic residual; why: why there is none
    """

    recording: str
    window: tuple[float, float]
    channels: list[Foretold]
    times: Array
    measured: Array
    predicted: Array
    half: Array
    allowance: float = 1.0
    why: str = ""

    @property
    def inside(self) -> bool | None:
        """Whether every channel is; None where the estimate states no error."""
        told = [channel.inside for channel in self.channels]
        return None if None in told else all(told)

    @property
    def refutes(self) -> bool:
        """Whether a right model would hardly be so far off."""
        return any(channel.rms > channel.most for channel in self.channels)

    @property
    def ratio(self) -> float:
        """How many times worse than stated it is: RMS over limit of the worst channel, nan where there is no limit."""
        return max((channel.rms / channel.limit for channel in self.channels), default=float("nan"))

    def sentence(self, named: bool) -> str:
        """The outcome in words; named: whether the recording has to be."""
        begin, end = self.window
        known = self.inside is not None
        off = ", ".join(f"{c.name} {c.rms:.2g} {c.unit}" + f", limit {c.limit:.2g}" * known for c in self.channels)
        where = f" of {self.recording}" if named else ""
        held = {True: "as well as the estimate states", False: "worse than the estimate states", None: self.why}
        return f"held out from {begin:g} s to {end:g} s{where}: predicted {held[self.inside]} (RMS: {off})"

    def to_json(self) -> dict[str, Any]:
        """What `--json` tells of it."""
        return plain(  # type: ignore[no-any-return]
            {
                "recording": self.recording,
                "window": list(self.window),
                "samples": len(self.times),
                "inside": self.inside,
                "why": self.why,
                "allowance": self.allowance,
                "channels": [channel.to_json() for channel in self.channels],
            }
        )


@dataclass(frozen=True)
class _Fit:
    """What was fitted: rows (weighted) with their blocks, and what follows from them."""

    seen: Sensitivity
    blocks: list[Block]
    at: Linearisation
    sizes: Array


def predictions(
    model: ForwardModel,
    point: Array,
    seen: Sensitivity | None,
    at: Linearisation,
    blocks: list[Block],
    error: ModelError,
) -> list[Prediction]:
    """Every window of every recording at an answer; seen: None where its neighbourhood is not known. Not counted."""
    fit = None if seen is None else _Fit(seen, blocks, at, model.sizes(point))
    return [
        _predicted(model, point, name, held, fit, error)
        for name, recording in model.measurement.recordings.items()
        for held in recording.held
    ]


def _predicted(
    model: ForwardModel, point: Array, name: str, held: Held, fit: _Fit | None, error: ModelError
) -> Prediction:
    channels = model.measurement.recordings[name].channels
    window = _of_window(model, name, held)
    predicted = window.observe(point[None], name)[0]
    off = predicted - held.values
    rms = np.sqrt(
        [np.mean(column[np.isfinite(column)] ** 2) if np.any(np.isfinite(column)) else np.nan for column in off.T]
    )
    half, (expected, limit, most) = np.full_like(off, np.nan), np.full((3, len(channels)), np.nan)
    windows = sum(len(recording.held) for recording in model.measurement.recordings.values())
    allowance, why = 1.0, ""
    there = None if fit is None else sensitivity(window, point)
    if not np.all(np.isfinite(predicted)):
        why = "with no simulation that succeeds"
    elif fit is None or there is None:
        why = "without a stated error, as the neighbourhood of the answer is not known"
    elif not there.doubt <= AGREED:
        why = "without a stated error, as the motion is chaotic"
    else:
        number = list(model.measurement.recordings).index(name)
        mine = window.rows.recording == number
        slopes = (there.jacobian[: len(mine)] / window.rows.weight[:, None])[mine]
        if _hidden(slopes * fit.sizes, fit.at):
            why = "without a stated error, as it depends on what the fit leaves open"
        else:
            bias = _bias(window, point, predicted, there, fit, error)[mine]
            allowance = _allowance(model, name, held, fit) if fit.at.systematic > 0.0 else 1.0
            for k in range(len(channels)):
                rows = window.rows.channel[mine] == k
                if not np.any(rows):
                    continue
                block = _block(model, number, k, fit)
                if block is None:
                    continue
                weight = float(model.rows.weight[fit.blocks[block].rows[0]])
                level = 1.0 - (1.0 - LEVEL) / len(channels)
                uneven = _unevenness(fit.seen.residual[fit.blocks[block].rows], int(np.sum(rows)))
                sure = 1.0 - _REFUTES / len(channels) / windows
                told, surely = (_stated(slopes[rows], fit.at, block, weight, p, uneven) for p in (level, sure))
                extra = float(np.sqrt(np.mean(bias[rows] ** 2)))
                expected[k], limit[k] = told.expected, allowance * told.limit + extra
                most[k] = allowance * surely.limit + extra
                half[np.isfinite(held.values[:, k]), k] = allowance * told.half + np.abs(bias[rows])
    told_of = [
        Foretold(c.name, c.place, c.quantity, of_channel(c), *map(float, numbers))
        for c, *numbers in zip(channels, rms, expected, limit, most, strict=True)
        if np.isfinite(numbers[0])
    ]
    return Prediction(name, held.window, told_of, held.times, held.values, predicted, half, allowance, why)


def _of_window(model: ForwardModel, name: str, held: Held) -> ForwardModel:
    """The model of the samples of a window. Other recordings stay with one sample, as parameters are named by them."""
    recordings = {
        other: replace(one, times=one.times[:1], values=np.zeros((1, len(one.channels))))
        for other, one in model.measurement.recordings.items()
    }
    recordings[name] = replace(model.measurement.recordings[name], times=held.times, values=held.values)
    problem = model.problem.model_copy(update={"loss": "squares"})
    return model.aside(measurement=replace(model.measurement, recordings=recordings), problem=problem)


def _hidden(slopes: Array, at: Linearisation) -> bool:
    """Whether a prediction moves along directions that the data leave open; slopes: of scaled parameters."""
    if not at.unknown.size:
        return False
    return bool(np.linalg.norm(slopes @ at.unknown) > _HIDDEN * max(float(np.linalg.norm(slopes)), 1e-300))


def _block(model: ForwardModel, recording: int, channel: int, fit: _Fit) -> int | None:
    """The number of the block of a channel."""
    rows = model.rows
    for number, block in enumerate(fit.blocks):
        if not block.known and len(block.rows):
            first = block.rows[0]
            if rows.recording[first] == recording and rows.channel[first] == channel:
                return number
    return None


def _bias(
    window: ForwardModel, point: Array, predicted: Array, there: Sensitivity, fit: _Fit, error: ModelError
) -> Array:
    """What a finer mesh and a fuller theory would change of the prediction, by size, (rows,), in SI units."""
    rows = len(window.rows.time)
    if error.mesh is None and error.theory is None:
        return np.zeros(rows)
    seen = {name: window.observe(point[None], name)[0] for name in window.measurement.recordings}
    later, shift = model_error(window, point, seen, there.residual), error.corrections(fit.at.pseudo_inverse)
    found = np.zeros(rows)
    for part, moved in ((later.mesh, shift.mesh), (later.theory, shift.theory)):
        if part is not None and moved is not None:
            found += np.abs(part[:rows] + there.jacobian[:rows] @ moved)
    return found / window.rows.weight


@dataclass(frozen=True)
class _Stated:
    """Of one channel: expected RMS, what it stays below, and the half width of the band, (samples,)."""

    expected: float
    limit: float
    half: Array


def _unevenness(residual: Array, count: int) -> float:
    """Variance of the mean square of so many neighbouring residuals, relative to its square, as parts of the fit show.

    Noise that is larger at times, or has outliers, makes it larger than its memory does.
    """
    length = min(count, len(residual) // _FEWEST_PARTS)
    power = float(np.mean(residual**2)) if len(residual) else 0.0
    if length < 1 or power <= 0.0:
        return 0.0
    parts = [np.mean(residual[k : k + length] ** 2) for k in range(0, len(residual) - length + 1, max(1, length // 2))]
    return float(np.var(parts, ddof=1)) / power**2


def _stated(slopes: Array, at: Linearisation, block: int, weight: float, level: float, uneven: float = 0.0) -> _Stated:
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
    return _Stated(float(np.sqrt(mean)), float(np.hypot(np.sqrt(above), systematic)), half)


def _allowance(model: ForwardModel, name: str, held: Held, fit: _Fit) -> float:
    """By what the stated error has to be made larger so that it holds for parts of the fit that are left out of it."""
    number = list(model.measurement.recordings).index(name)
    found = 1.0
    for left_out, kept in _parts(model, number, held, len(fit.seen.residual)):
        found = max(found, _too_small(model, number, left_out, kept, fit))
    return found


def _parts(model: ForwardModel, number: int, held: Held, count: int) -> Iterator[tuple[Mask, Mask]]:
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


def _too_small(model: ForwardModel, number: int, out: Mask, kept: Mask, fit: _Fit) -> float:
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
        mine = _block(model, number, channel, fit)
        if not len(rows) or mine is None:
            continue
        weight = float(model.rows.weight[rows[0]])
        slopes = fit.seen.jacobian[rows] / weight
        off = (fit.seen.residual[rows] - fit.seen.jacobian[rows] @ step) / weight
        told = _stated(slopes, at, mine, weight, LEVEL, _unevenness(left[blocks[mine].rows], len(rows)))
        worst = max(worst, float(np.sqrt(np.mean(off**2))) / max(told.limit, 1e-300))
    return worst
