"""Windows that were not fitted, predicted by the answer: how far off, and how far off the estimate says it may be.

The stated error has three parts: noise as large and as correlated as in the fit, the covariance of the parameters
carried on by the derivatives there, and what a systematic residual lets the parameters be off. Where the residual is
systematic the model itself is wrong by an amount that grows beyond the fit. How fast is tried inside the fit: parts of
the same length are left out, the rest is fitted without them (to first order), and where the stated error of these is
too small, that of the window is made larger in proportion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.conventions import HIDDEN, LEVEL
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.measurement import HeldOut
from shoal.identification.recording.units import of_channel
from shoal.identification.uncertainty.covariance import Block, Noise
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.identification.uncertainty.model_error import ModelError, model_error
from shoal.identification.uncertainty.prediction_error import Fit, allowance, block_of, stated, unevenness
from shoal.identification.uncertainty.sensitivity import AGREED, Sensitivity, sensitivity
from shoal.identification.uncertainty.uncertain_inputs import EXACT, Given, uncertain_fields
from shoal.json_values import plain
from shoal.trajectory import Array

Mask = npt.NDArray[np.bool_]

_REFUTES = 1e-4
"""Chance by Satterthwaite's approximation, whose tail is up to several times too thin: a right model is refuted by its
windows, all of them together, less than once in a thousand times."""


@dataclass(frozen=True)
class ChannelPrediction:
    """One channel over a window, in SI units. name: of it in words.

    rms: of model minus measurement; expected: what noise and the parameters' covariance predict for it; limit: what it
    stays below in 95 % of windows, model error included, nan where that is unknown; inside: whether it does
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
        """Return whether the error is one that the estimate states; None where it states none."""
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
    channels: list[ChannelPrediction]
    times: Array
    measured: Array
    predicted: Array
    half: Array
    allowance: float = 1.0
    why: str = ""

    @property
    def inside(self) -> bool | None:
        """Return whether every channel is; None where the estimate states no error."""
        holds = [channel.inside for channel in self.channels]
        return None if None in holds else all(holds)

    @property
    def refutes(self) -> bool:
        """Return whether a right model would be so far off less than once in a thousand times."""
        return any(channel.rms > channel.most for channel in self.channels)

    @property
    def ratio(self) -> float:
        """Ratio of the error to the stated one: RMS over limit of the worst channel, nan where there is no limit."""
        return max((channel.rms / channel.limit for channel in self.channels), default=float("nan"))

    def finding(self, named: bool) -> Finding:
        """Return how well the window is predicted; named: whether the text names the recording."""
        begin, end = self.window
        known = self.inside is not None
        off = ", ".join(f"{c.name} {c.rms:.2g} {c.unit}" + f", limit {c.limit:.2g}" * known for c in self.channels)
        where = f" of {self.recording}" if named else ""
        held = {True: "as well as the estimate states", False: "worse than the estimate states", None: self.why}
        kind = kinds.MISPREDICTED if self.inside is False else kinds.PREDICTION
        text = f"held out from {begin:g} s to {end:g} s{where}: predicted {held[self.inside]} (RMS: {off})"
        return kind.found(text, begin=begin, end=end, ratio=self.ratio)

    def to_json(self) -> dict[str, Any]:
        """Object that `--json` prints."""
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


def predictions(
    model: ForwardModel,
    point: Array,
    seen: Sensitivity | None,
    at: Linearisation,
    blocks: list[Block],
    error: ModelError,
    fields: Given | None,
) -> list[Prediction]:
    """Every window of every recording at an answer; seen: None where its neighbourhood is not known. Not counted.

    at: without what uncertain fields of the scene add, `fields`, which change a window in more ways than by the answer
    """
    fit = None if seen is None else Fit(seen, blocks, at, model.sizes(point), fields)
    return [
        _predicted(model, point, name, held, fit, error)
        for name, recording in model.measurement.recordings.items()
        for held in recording.held
    ]


def _predicted(
    model: ForwardModel, point: Array, name: str, held: HeldOut, fit: Fit | None, error: ModelError
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
    larger, why = 1.0, ""
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
            seen = {
                other: predicted if other == name else window.observe(point[None], other)[0]
                for other in window.measurement.recordings
            }
            bias = _bias(window, point, seen, there, fit, error)[mine]
            larger = allowance(model, name, held, fit) if fit.at.systematic > 0.0 else 1.0
            slopes, spread = _with_fields(window, point, seen, slopes, there, fit, mine)
            for k in range(len(channels)):
                rows = window.rows.channel[mine] == k
                if not np.any(rows):
                    continue
                block = block_of(model, number, k, fit)
                if block is None:
                    continue
                weight = float(model.rows.weight[fit.blocks[block].rows[0]])
                level = 1.0 - (1.0 - LEVEL) / len(channels)
                uneven = unevenness(fit.seen.residual[fit.blocks[block].rows], int(np.sum(rows)))
                sure = 1.0 - _REFUTES / len(channels) / windows
                usual, surely = (stated(slopes[rows], spread, block, weight, p, uneven) for p in (level, sure))
                extra = float(np.sqrt(np.mean(bias[rows] ** 2)))
                expected[k], limit[k] = usual.expected, larger * usual.limit + extra
                most[k] = larger * surely.limit + extra
                half[np.isfinite(held.values[:, k]), k] = larger * usual.half + np.abs(bias[rows])
    by_channel = [
        ChannelPrediction(c.name, c.place, c.quantity, of_channel(c), *map(float, numbers))
        for c, *numbers in zip(channels, rms, expected, limit, most, strict=True)
        if np.isfinite(numbers[0])
    ]
    return Prediction(name, held.window, by_channel, held.times, held.values, predicted, half, larger, why)


def _of_window(model: ForwardModel, name: str, held: HeldOut) -> ForwardModel:
    """The model of the samples of a window. Other recordings stay with one sample, as parameters are named by them."""
    recordings = {
        other: replace(one, times=one.times[:1], values=np.zeros((1, len(one.channels))))
        for other, one in model.measurement.recordings.items()
    }
    recordings[name] = replace(model.measurement.recordings[name], times=held.times, values=held.values)
    problem = model.problem.model_copy(update={"loss": "squares"})
    return model.aside(measurement=replace(model.measurement, recordings=recordings), problem=problem)


def _hidden(slopes: Array, at: Linearisation) -> bool:
    """Return whether a prediction moves along directions that the data leave open; slopes: of scaled parameters."""
    if not at.unknown.size:
        return False
    return bool(np.linalg.norm(slopes @ at.unknown) > HIDDEN * max(float(np.linalg.norm(slopes)), 1e-300))


def _bias(
    window: ForwardModel, point: Array, seen: dict[str, Array], there: Sensitivity, fit: Fit, error: ModelError
) -> Array:
    """Change of the prediction by a finer mesh and a fuller theory, by size, (rows,), in SI units.

    seen: channels there by recording, (samples, channels)
    """
    rows = len(window.rows.time)
    if error.mesh is None and error.theory is None:
        return np.zeros(rows)
    later, shift = model_error(window, point, seen, there.residual), error.corrections(fit.at.pseudo_inverse)
    found = np.zeros(rows)
    for part, moved in ((later.mesh, shift.mesh), (later.theory, shift.theory)):
        if part is not None and moved is not None:
            found += np.abs(part[:rows] + there.jacobian[:rows] @ moved)
    return found / window.rows.weight


def _with_fields(
    window: ForwardModel,
    point: Array,
    seen: dict[str, Array],
    slopes: Array,
    there: Sensitivity,
    fit: Fit,
    mine: Mask,
) -> tuple[Array, Linearisation]:
    """Derivatives in the window (samples, parameters) and their spread, with uncertain fields beside the parameters.

    Each direction of these is one more parameter, of variance one, that changes what it changes of the window less what
    the answer follows of it.
    """
    later = uncertain_fields(window, point, seen) if fit.fields is not None else None
    if fit.fields is None or later is None:
        return slopes, fit.at
    rows, at, count = len(window.rows.time), fit.at, len(later.moved)
    followed = (fit.fields.moved @ at.pseudo_inverse.T) @ there.jacobian[:rows].T
    direct = ((later.moved[:, :rows] - followed) / window.rows.weight)[:, mine]
    parts = np.pad(at.parts, [(0, 1), (0, count), (0, count)])
    parts[-1, -count:, -count:] = np.eye(count)
    pseudo_inverse = np.pad(at.pseudo_inverse, [(0, count), (0, 0)])
    noise = (*at.noise, Noise(0.0, 0.0, EXACT))
    return np.hstack([slopes, direct.T]), replace(
        at, parts=parts, pseudo_inverse=pseudo_inverse, noise=noise, given=at.given + 1
    )
