"""Residual tests: size against the noise (chi-square), whiteness (Ljung and Box), outliers."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import DOUBT, GROSS, HARDLY, MAD, MOSTLY, OUTLIER, PRECISION, ROUND_OFF, SEVERAL
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import of_channels
from shoal.identification.uncertainty.chances import above_chi_square
from shoal.identification.uncertainty.covariance import Block, Noise
from shoal.json_values import plain
from shoal.trajectory import Array

_LOUD = 1.5
"""Times the stated noise: a white residual up to here is a noise that was stated too small, a larger one is not."""
_SURE = 1e-6
"""Chance below which an estimated noise counts as exceeded; models are looked at for many reasons, so it is small."""
_LAGS = 16
"""Order of the linear prediction, at most a fifth of the samples: two coefficients for each of eight spectral lines."""
_FIRST = 10
"""Lags of the test of Ljung and Box, at most a fifth of the samples."""
_FAR = 3
"""Samples later they do: noise is alike so far apart by no differences, such as those that make a rate of angles."""
_FEW = 0.1
"""Of the samples: so many outliers a robust loss may set aside."""


@dataclass(frozen=True)
class ResidualTests:
    """Sizes are RMS over (weighted) rows, in SI units; priors do not count.

    noise: the stated one, else what the data show without any model; signal: spread of the data about their means
    unresolved: that the noise is not stated and the data show none, as they move too far between samples: the residual
    is much smaller, and `noise` is its size
    mesh: the model's own error, 0 if unknown; chance_of_size: that noise of this size and correlation leaves such a
    residual (chi-square); chance_of_white: that white noise is so correlated (Ljung and Box 1978), by the worst channel
    excess: size of what is systematic in it, 0 where the residual is white
    refined: size of the residual that a finer mesh and theory would leave; chance_of_white is of that one, and
    chance_as_it_is of the residual itself
    outliers: beyond five robust standard deviations of their channel; rows: how many there are
    unit: of the sizes; empty where channels of different units are taken together, whose sizes mean something only
    against each other
    """

    size: float
    noise: float
    noise_stated: bool
    signal: float
    mesh: float
    chance_of_size: float
    chance_of_white: float
    outliers: int
    rows: int
    unit: str = ""
    excess: float = 0.0
    refined: float = np.inf
    chance_as_it_is: float = 1.0
    unresolved: bool = False

    @classmethod
    def not_made(cls, model: ForwardModel) -> ResidualTests:
        """Return empty tests, where nothing but the data is known."""
        stated = model.rows.noise
        noise, size = np.nan if stated is None else stated, np.nan
        return cls(size, noise, stated is not None, model.rows.signal, 0.0, np.nan, np.nan, 0, len(model.rows.time))

    @property
    def made(self) -> bool:
        """Return whether there was a residual to test."""
        return bool(np.isfinite(self.size))

    @property
    def explained(self) -> float:
        """Size of a residual that noise and mesh explain."""
        return max(float(np.hypot(self.noise, self.mesh)), 1e-300)

    @property
    def ratio(self) -> float:
        """Size over what noise and mesh explain."""
        return min(self.size, self.refined) / self.explained

    @property
    def white(self) -> bool:
        """Return whether the residuals may be white noise."""
        return self.chance_of_white > DOUBT

    @property
    def too_large(self) -> bool:
        """Return whether the residual is larger than the stated noise, by a chance that leaves little doubt."""
        return self.noise_stated and self.ratio > 1.0 and self.chance_of_size < DOUBT

    @property
    def systematic(self) -> bool:
        """Return whether the residual is more than noise: larger than stated, and not white; or much larger."""
        if self.noise_stated:
            return self.too_large and (not self.white or self.ratio > _LOUD)
        return self.ratio > SEVERAL and self.chance_of_size < _SURE

    @property
    def limited(self) -> bool:
        """Return whether the model, and not the noise, limits the accuracy of the fit."""
        return self.systematic or self.excess > 0.0

    @property
    def explains_nothing(self) -> bool:
        """Return whether a constant would fit as well, or little worse where no such noise is stated."""
        if self.noise_stated:
            return self.too_large and self.size >= self.signal > 0.0
        return self.size >= MOSTLY * self.signal > 0.0

    @property
    def wrong_model(self) -> bool:
        """Return whether the model is refuted: against a stated noise, against a good part of the signal, or a
        constant.
        """
        if self.noise_stated:
            return self.systematic or self.explains_nothing
        hardly = not self.white and (self.ratio > 1.0 or self.unresolved) and self.size > HARDLY * self.signal
        return hardly or self.explains_nothing or (self.systematic and self.size > GROSS * self.signal)

    def sized(self, size: float) -> str:
        """A size with its unit."""
        return f"{size:.2g} {self.unit}".strip()

    def sentences(self) -> list[str]:
        """The tests in words; none where there was nothing to test."""
        if not self.made:
            return []
        kind = "the stated noise" if self.noise_stated else "the noise that the data show without a model"
        size = f"{self.sized(self.size)} (RMS for each channel), " if self.unit else ""
        times = self.size / max(self.noise, 1e-300)
        known = np.isfinite(times) and not self.unresolved
        against = f"{_digits(times, 2)} times {kind}" if known else "against a noise that is not known"
        found = [f"size: {size}{against}"]
        if self.signal > 0:
            found[0] += f", {_digits(100 * self.size / self.signal, 1)} % of the spread of the data"
        found.append(f"correlation: {self.correlation}")
        found.append(f"outliers: {self.outliers} of {self.rows} samples" if self.outliers else "outliers: none")
        return found

    @property
    def correlation(self) -> str:
        """Description of the residuals' correlation."""
        if self.size < ROUND_OFF * self.signal:
            return "that of round-off"
        if not self.white:
            return "not white noise"
        if self.chance_as_it_is > DOUBT:
            return "none, like white noise"
        return "that of the model's own error, without which it is like white noise"

    def to_json(self) -> dict[str, Any]:
        """All fields, and what follows from them; null where there was nothing to test."""
        derived = {"ratio": self.ratio, "systematic": self.systematic, "wrong_model": self.wrong_model}
        found: dict[str, Any] = plain({**asdict(self), **derived})
        return found if self.made else dict.fromkeys(found)


def residual_tests(
    model: ForwardModel,
    residual: Array,
    blocks: list[Block],
    noise: tuple[Noise, ...],
    mesh: float = 0.0,
    refined: Array | None = None,
    chosen: float = 0.0,
) -> ResidualTests:
    """Test the residuals (rows,) of an answer; blocks, noise: as estimated with it.

    mesh: size of the model's own error; chosen: the part of it that is of one choice among many: it explains the size
    of a residual, yet what is systematic in that may be of another choice
    refined: residuals (rows,) that the answer of a better mesh and theory would leave, whose whiteness is then what
    counts. With a loss that lets outliers weigh less, they count as zero here.
    """
    measured = [(b, n) for b, n in zip(blocks, noise, strict=True) if not b.known]
    rows = np.concatenate([block.rows for block, _ in measured])
    outlying = [_outlying(residual[block.rows]) for block, _ in measured]
    counted = np.ones(len(residual))
    if model.problem.loss != "squares" and np.mean(np.concatenate(outlying)) <= _FEW:
        counted[rows[np.concatenate(outlying)]] = 0.0
    left = counted * (residual if refined is None else refined)
    size, smaller = (float(np.sqrt(np.sum(r[rows] ** 2) / np.sum(counted[rows]))) for r in (counted * residual, left))
    seen = model.rows.noise if model.rows.noise is not None else _without_model(model)
    known = float(np.sqrt(max(0.0, mesh**2 - chosen**2)))
    motion = model.rows.noise is None and seen > SEVERAL * size
    unresolved = motion and seen > GROSS * model.rows.signal
    seen = size if unresolved else seen
    # Chi-square with as many samples as the residual's memory leaves independent for its variance (Bartlett 1935),
    # less the parameters.
    independent = sum(len(b.rows) * (1.0 - n.rho**2) / (1.0 + n.rho**2) for b, n in measured) - len(model.names)
    freedom = max(1.0, independent)
    beyond = min(size, smaller) / max(float(np.hypot(seen, mesh)), 1e-300)
    white, as_it_is = (_chance_of_white(rows_, [b for b, _ in measured]) for rows_ in (left, counted * residual))
    return ResidualTests(
        size=size,
        noise=seen,
        noise_stated=model.rows.noise is not None,
        signal=model.rows.signal,
        mesh=mesh,
        # A product overflows to infinity, which has chance zero; a power would raise OverflowError.
        chance_of_size=above_chi_square(freedom, freedom * beyond * beyond),
        chance_of_white=white,
        outliers=int(sum(np.sum(part) for part in outlying)),
        rows=len(rows),
        unit=of_channels(model.measurement),
        excess=0.0 if white > DOUBT else _excess([left[block.rows] for block, _ in measured], seen, known, motion),
        refined=smaller,
        chance_as_it_is=as_it_is,
        unresolved=unresolved,
    )


def _chance_of_white(residual: Array, blocks: list[Block]) -> float:
    """By the worst channel of a residual (rows,), corrected for their number (Bonferroni)."""
    chances = [ljung_box(residual[block.rows]) for block in blocks]
    return min(1.0, min(chances) * len(chances))


def _excess(residuals: list[Array], noise: float, mesh: float, fast: bool) -> float:
    """Size of what is systematic in residuals (samples,) of the channels: beyond the noise, or alike between samples.

    fast: whether nothing fast in them is known to be noise
    """
    count = sum(len(part) for part in residuals)
    power = sum(float(part @ part) for part in residuals) / count
    alike = sum(_alike(part, fast) for part in residuals) / count
    return float(np.sqrt(max(0.0, power - noise**2 - mesh**2, alike - mesh**2)))


def _alike(signal: Array, fast: bool) -> float:
    """The part of the sum of squares of a signal (samples,) that is no white noise.

    By neighbours for a slow signal; for one that swings fast, by the part that linear prediction explains.
    """
    neighbours, lags = float(signal[1:] @ signal[:-1]), min(_LAGS, len(signal) // 5)
    if not fast or lags < 1:
        return neighbours
    earlier = np.lib.stride_tricks.sliding_window_view(signal[:-_FAR], lags)
    later = signal[-len(earlier) :]
    rest = later - earlier @ np.linalg.lstsq(earlier, later)[0]
    unforeseen = float(rest @ rest) / (len(later) - lags) / max(float(later @ later) / len(later), 1e-300)
    return max(neighbours, (1.0 - unforeseen) * float(signal @ signal))


def ljung_box(signal: Array) -> float:
    """Chance that white noise is as correlated as a signal (samples,) over its first lags."""
    count, power = len(signal), float(signal @ signal)
    lags = min(_FIRST, count // 5)
    if lags < 1 or power == 0.0:
        return 1.0
    rho = np.array([signal[lag:] @ signal[:-lag] for lag in range(1, lags + 1)]) / power
    size = count * (count + 2) * np.sum(rho**2 / (count - np.arange(1, lags + 1)))
    return above_chi_square(lags, float(size))


def _without_model(model: ForwardModel) -> float:
    """The noise that the data show, and at least what is beyond the digits of the solver."""
    rows = model.rows
    largest = [np.max(np.abs(np.nan_to_num(r.values)), axis=0) for r in model.measurement.recordings.values()]
    digits = np.array([PRECISION * largest[r][c] for r, c in zip(rows.recording, rows.channel, strict=True)])
    return float(np.sqrt(np.mean((np.maximum(rows.estimated, digits) * rows.weight) ** 2)))


def _digits(number: float, digits: int) -> str:
    """A number to a few digits, without a power of ten where it can be read without."""
    return f"{float(f'{number:.{digits}g}'):g}"


def _outlying(residual: Array) -> npt.NDArray[np.bool_]:
    deviation = np.abs(residual - np.median(residual))
    return np.asarray(deviation > OUTLIER * MAD * max(float(np.median(deviation)), 1e-300))
