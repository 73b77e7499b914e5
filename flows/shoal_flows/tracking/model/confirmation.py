"""The identified machine on a second engine: whether what was fitted is the machine's motion or our solver's error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from shoal.engines import get_engine
from shoal.errors import ShoalError
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.units import QUANTITIES
from shoal.pictures.answer import Answer
from shoal.trajectory import Array

ACCURACY = 1e-4
"""Of the range of a signal: how far engines may differ where no noise is stated and the fit leaves even less."""


@dataclass(frozen=True)
class Confirmation:
    """Confirmation of the fitted signals by a second engine.

    signal: with the largest difference relative to the allowed one; away, allowed: root mean square there, in its unit
    refusal: why there is no answer, else empty
    """

    engine: str
    signal: str = ""
    away: float = np.nan
    allowed: float = np.nan
    unit: str = ""
    refusal: str = ""

    @property
    def ok(self) -> bool:
        """Return whether the second engine sees the same motion."""
        return self.away <= self.allowed

    def __str__(self) -> str:
        if self.refusal:
            return f"{self.engine} does not confirm the motion: {self.refusal}"
        words = "confirms" if self.ok else "does not confirm"
        numbers = f"differs by {self.away:.1e} {self.unit} (RMS), allowed are {self.allowed:.1e} {self.unit}"
        return f"{self.engine} {words} the motion: {self.signal} {numbers}"


def confirm(answer: Answer) -> Confirmation:
    """Simulate what was identified on Exudyn (on ours, if Exudyn was fitted), at every sample of every recording.

    Allowed is the noise of each signal as stated, else as estimated from what the fit leaves, and at least `ACCURACY`.
    """
    estimate = answer.estimate
    engine = "gauss" if estimate.engine.startswith("exudyn") else "exudyn"
    try:
        model = replace(answer.model, engine=get_engine(engine))
        seen = {name: model.observe(answer.point[None], name)[0] for name in estimate.predicted}
    except (ShoalError, ModuleNotFoundError) as error:
        return Confirmation(engine, refusal=str(error))
    if not all(np.all(np.isfinite(values)) for values in seen.values()):
        return Confirmation(engine, refusal=model.refusal or "its simulation failed")
    rows = [
        Confirmation(engine, f"{name}/{signal}" if len(seen) > 1 else signal, away, allowed, unit)
        for name, recording in estimate.measurement.recordings.items()
        for signal, away, allowed, unit in _signals(recording, estimate.predicted[name], seen[name])
    ]
    return max(rows, key=lambda row: row.away / row.allowed)


def _signals(recording: Recording, fitted: Array, seen: Array) -> Iterator[tuple[str, float, float, str]]:
    """Name, distance of the engines, what is allowed, and unit of every channel; arrays are (samples, channels)."""
    left = recording.values - fitted
    for k, channel in enumerate(recording.channels):
        stated = float(recording.noise[k])
        estimated = max(float(np.sqrt(np.nanmean(left[:, k] ** 2))), ACCURACY * float(np.ptp(fitted[:, k])))
        away = float(np.sqrt(np.mean((seen[:, k] - fitted[:, k]) ** 2)))
        yield channel.label, away, stated if np.isfinite(stated) else estimated, QUANTITIES[channel.quantity]
