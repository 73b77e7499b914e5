"""A short stretch of one marker or sensor that contradicts the rest, as of a tracker that lost its marker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shoal.findings import Finding
from shoal.identification.findings import ODD_STRETCH
from shoal.identification.forward import ForwardModel
from shoal.identification.judge.suspects.of_data import misfit
from shoal.identification.methods.lanes import descend_many
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.units import of_channels
from shoal.trajectory import Array

_OFF = 5.0
"""Times the usual deviation from a robust fit: what is farther off belongs to a stretch."""
_MAD = 1.4826
_FEWEST, _GAP = 4, 3
"""Samples of a stretch, and from one of them to the next, at most."""
_MOST = 0.5
"""Of the samples of a marker or a sensor: more of them are no stretch."""
_STRETCHES, _STARTS = 2, 3
_PATIENCE = 100.0
_LOUD, _LARGE = 1.5, 3.0
"""Times the noise, stated or estimated: so much the fit of the rest may leave."""


@dataclass(frozen=True)
class _SampleRange:
    """Samples from first to last of channels (by number) of a recording, of one place."""

    recording: str
    place: str
    channels: list[int]
    first: int
    last: int

    def told(self, model: ForwardModel) -> str:
        run = model.measurement.recordings[self.recording]
        begin, end = (run.times[k] + run.begin for k in (self.first, self.last))
        of = f" of recording {self.recording}" if len(model.measurement.recordings) > 1 else ""
        return f"{self.place}{of} from {begin:.4g} s to {end:.4g} s"


def odd_stretch(model: ForwardModel, point: Array) -> Finding | None:
    """Return what was found about stretches without which the rest fits; None where there are none.

    point: where all was fitted. Runs are not counted. Raises TimeIsUp.
    """
    robust = model.aside(problem=model.problem.model_copy(update={"loss": "cauchy"}))
    if not np.all(robust.loss_scale**2 > 0.0):  # without noise nothing is usual
        return None
    starts = np.vstack([point, starting_points(model)[:_STARTS]])
    best = min(descend_many(robust, starts, patience=_PATIENCE), key=lambda end: end.fitness)
    plain = model.aside(problem=model.problem.model_copy(update={"loss": "squares"}))
    residual = plain.uncounted(best.point[None])[0, : len(model.rows.time)]
    if not np.all(np.isfinite(residual)):
        return None
    found = list(_stretches(model, residual))
    if not 0 < len(found) <= _STRETCHES:
        return None
    rest = _without(plain, found)
    left = misfit(min(descend_many(rest, best.point[None]), key=lambda end: end.fitness).residual)
    stated = rest.rows.noise
    noise = float(np.sqrt(np.mean((rest.rows.estimated * rest.rows.weight) ** 2))) if stated is None else stated
    if left > (_LARGE if stated is None else _LOUD) * noise:
        return None
    names = " and ".join(one.told(model) for one in found)
    size = f"{left:.2g} {of_channels(model.measurement)}".strip()
    step = f"check {names}: cells of a lost marker are left empty"
    return ODD_STRETCH.found(f"without {names} the rest fits, and leaves {size}", step, residual=left)


def _stretches(model: ForwardModel, residual: Array) -> Iterator[_SampleRange]:
    """Of each place, samples in a row that are off, and hardly any between them."""
    rows = model.rows
    usual = np.maximum(rows.estimated * rows.weight, _MAD * float(np.median(np.abs(residual))))
    off = np.abs(residual) > _OFF * usual
    for number, (name, run) in enumerate(model.measurement.recordings.items()):
        for place in dict.fromkeys(channel.place for channel in run.channels):
            channels = [k for k, channel in enumerate(run.channels) if channel.place == place]
            mine = off & (rows.recording == number) & np.isin(rows.channel, channels)
            samples = np.searchsorted(run.times, np.unique(rows.time[mine]))
            for part in _in_a_row(samples):
                if _FEWEST <= len(part) <= _MOST * len(run.times):
                    yield _SampleRange(name, place, channels, int(part[0]), int(part[-1]))


def _in_a_row(samples: npt.NDArray[np.intp]) -> list[npt.NDArray[np.intp]]:
    return np.split(samples, np.flatnonzero(np.diff(samples) > _GAP) + 1)


def _without(model: ForwardModel, stretches: list[_SampleRange]) -> ForwardModel:
    """The model without these samples."""
    recordings = dict(model.measurement.recordings)
    for one in stretches:
        run = recordings[one.recording]
        values = run.values.copy()
        values[one.first : one.last + 1, one.channels] = np.nan
        recordings[one.recording] = replace(run, values=values)
    return model.aside(measurement=replace(model.measurement, recordings=recordings))
