"""Samples that contradict the rest: a recording, or a stretch of one marker or sensor, as of a tracker that lost it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from shoal.identification.conventions import MAD, OUTLIER
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import FEW, descend_many
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.measurement import Recording
from shoal.trajectory import Array

_FEWEST, _GAP = 4, 3
"""Samples of a stretch, and from one of them to the next, at most."""
_MOST = 0.5
"""Of the samples of a marker or a sensor: more of them are no stretch."""
_STRETCHES = 2
"""At most: more of them are no lapse of a tracker, but a wrong model."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Samples that a hypothesis leaves out.

    rows: which residual rows, priors of their own parameters among them, (rows,); model: without them
    windows: among how many others they were chosen
    """

    name: str
    kind: str
    rows: npt.NDArray[np.bool_]
    model: ForwardModel
    windows: float = 1.0

    def place(self, whole: ForwardModel, point: Array) -> Array:
        """Return a point of the whole model (parameters,) as one of the model without these samples."""
        known = dict(zip(whole.names, point, strict=True))
        there = np.array([known[name] for name in self.model.names])
        return np.asarray(np.clip(there, self.model.lower, self.model.upper))


def recordings(model: ForwardModel) -> Iterator[LeftOut]:
    """Each of several recordings."""
    runs = model.measurement.recordings
    for number, name in enumerate(runs) if len(runs) > 1 else ():
        rest = {other: one for other, one in runs.items() if other != name}
        yield _without(model, f"recording {name}", "recording", rest, model.rows.recording == number)


def stretches(model: ForwardModel, point: Array) -> Iterator[LeftOut]:
    """One or two stretches that a robust fit sets aside, together. Raises TimeIsUp.

    point: where all was fitted
    """
    robust = model.aside(problem=model.problem.model_copy(update={"loss": "cauchy"}))
    if not np.all(robust.loss_scale**2 > 0.0):  # without noise nothing is usual
        return
    starts = np.vstack([point, starting_points(model)[:FEW]])
    best = min(descend_many(robust, starts), key=lambda end: end.fitness)
    plain = model.aside(problem=model.problem.model_copy(update={"loss": "squares"}))
    residual = plain.uncounted(best.point[None])[0, : len(model.rows.time)]
    found = list(_stretches(model, residual)) if np.all(np.isfinite(residual)) else []
    if not 0 < len(found) <= _STRETCHES:
        return
    runs, rows = dict(model.measurement.recordings), np.zeros(len(residual), dtype=bool)
    for one in found:
        run = runs[one.recording]
        values = run.values.copy()
        values[one.first : one.last + 1, one.channels] = np.nan
        runs[one.recording] = replace(run, values=values)
        rows |= one.rows(model)
    samples = [len(run.times) for run in runs.values()]
    places = sum(len({c.place for c in run.channels}) for run in runs.values())
    windows = (places * max(samples) ** 2 / 2) ** len(found)
    yield _without(
        model, f"samples of {' and '.join(one.words(model) for one in found)}", "stretch", runs, rows, windows
    )


def _without(
    model: ForwardModel,
    name: str,
    kind: str,
    runs: dict[str, Recording],
    rows: npt.NDArray[np.bool_],
    windows: float = 1.0,
) -> LeftOut:
    rest = model.aside(measurement=replace(model.measurement, recordings=runs))
    priors = [model.names[k] not in rest.names for k, _ in model.parameters.priors]
    return LeftOut(name, kind, np.append(rows, np.array(priors, dtype=bool)), rest, windows)


@dataclass(frozen=True)
class _Stretch:
    """Samples from first to last of channels (by number) of a recording, of one place."""

    recording: str
    place: str
    channels: list[int]
    first: int
    last: int

    def words(self, model: ForwardModel) -> str:
        """Return place and times by the clock of the table."""
        run = model.measurement.recordings[self.recording]
        begin, end = (run.times[k] + run.begin for k in (self.first, self.last))
        of = f" of recording {self.recording}" if len(model.measurement.recordings) > 1 else ""
        return f"{self.place}{of} from {begin:.4g} s to {end:.4g} s"

    def rows(self, model: ForwardModel) -> npt.NDArray[np.bool_]:
        """Return which rows of what was measured they are, (rows,)."""
        rows, number = model.rows, list(model.measurement.recordings).index(self.recording)
        times = model.measurement.recordings[self.recording].times
        within = (rows.time >= times[self.first]) & (rows.time <= times[self.last])
        return np.asarray(within & (rows.recording == number) & np.isin(rows.channel, self.channels))


def _stretches(model: ForwardModel, residual: Array) -> Iterator[_Stretch]:
    """Stretches of outliers of each place, with few good samples between them."""
    rows = model.rows
    usual = np.maximum(rows.estimated * rows.weight, MAD * float(np.median(np.abs(residual))))
    off = np.abs(residual) > OUTLIER * usual
    for number, (name, run) in enumerate(model.measurement.recordings.items()):
        for place in dict.fromkeys(channel.place for channel in run.channels):
            channels = [k for k, channel in enumerate(run.channels) if channel.place == place]
            mine = off & (rows.recording == number) & np.isin(rows.channel, channels)
            samples = np.searchsorted(run.times, np.unique(rows.time[mine]))
            for part in np.split(samples, np.flatnonzero(np.diff(samples) > _GAP) + 1):
                if _FEWEST <= len(part) <= _MOST * len(run.times):
                    yield _Stretch(name, place, channels, int(part[0]), int(part[-1]))
