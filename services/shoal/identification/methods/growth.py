"""Growth of a deviation of the parameters over the record: by that a record is short or long for a machine."""

from __future__ import annotations

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

LARGE = 30.0
"""A deviation that grows by more than this over the record makes single shooting over all of it fail."""
FRACTAL = 1e3
"""From this growth on false minima are everywhere, and to list those near by tells nothing."""
_PARTS = 10
"""Of a record, compared with the first of them."""


def growth(model: ForwardModel, jacobian: Array) -> float:
    """Growth factor of a deviation over the record, from a Jacobian (rows, parameters) of the residuals.

    The largest singular value of d(channels)/d(initial state), per sample, in the worst tenth of the record over that
    in the first; where no initial state is sought, that of the parameters relative to their range. The number of a
    chaotic motion says that the deviation is large, not how large: finite differences end where it is as large as the
    machine (Lorenz, J. Atmos. Sci. 26, 1969).
    """
    initial = model.parameters.initial
    scaled = jacobian[: len(model.rows.time)] * (model.upper - model.lower)
    scaled = scaled[:, initial] if np.any(initial) else scaled
    largest = []
    for number, recording in enumerate(model.measurement.recordings.values()):
        edges = np.linspace(recording.times[0], recording.times[-1], _PARTS + 1)[1:-1]
        part = np.searchsorted(edges, model.rows.time)
        mine = [scaled[(model.rows.recording == number) & (part == k)] for k in range(_PARTS)]
        sizes = [float(np.linalg.norm(rows, 2)) / np.sqrt(len(rows)) if len(rows) else 0.0 for rows in mine]
        largest.append(max(sizes) / sizes[0] if sizes[0] > 0 else 1.0)
    return max(largest)


def swings(model: ForwardModel) -> int:
    """Largest number of mean crossings of a channel."""
    signals = [signal[np.isfinite(signal)] for r in model.measurement.recordings.values() for signal in r.values.T]
    return max(int(np.sum(np.diff(np.sign(s - np.mean(s))) != 0)) for s in signals if s.size)
