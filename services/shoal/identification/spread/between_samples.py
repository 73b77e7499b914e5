"""What a drive may do between its samples, and what that does to an answer.

A table is drawn through by cubic splines or straight lines. Of a signal that has nothing beyond half its sampling rate
a spline of high degree keeps more: the more of it, the closer that one is to the interpolation of Shannon. What both
differ by is the error of the table, as that of a step of integration is told by a formula of higher order. Of a signal
that is sampled finely it is next to nothing, whatever its noise, and it is no impulse where the signal jumps.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.errors import InputError
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import unit
from shoal.identification.spread.given import EXACT, Given
from shoal.identification.spread.model_error import difference, rms_of
from shoal.identification.spread.signal_noise import MATTERS, signals_of
from shoal.scene.function import MOST_ROWS, Function
from shoal.trajectory import Array

_DEGREE = 7
"""Of the spline: at a third of the sampling rate it loses 0.4 %, a cubic one 6 %; the ninth rings at the ends."""
_FINER = 4
"""Rows of the finer table for each of the signal: the cubic spline through them then is that spline."""
_FEWEST = 20
"""Rows, below which a table is drawn by hand rather than sampled."""
_APART = 0.1
"""Of the mean interval between samples: rows that are closer say where something happens, and are meant so."""


def between_samples(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> Given | None:
    """At a point whose channels by recording, and residuals (rows,), are known; None where no drive is too coarse.

    One simulation of every recording for each drive.
    """
    least = MATTERS * rms_of(residual) / np.sqrt(len(residual))
    moved, sizes = list[Array](), list[str]()
    for path, signal in signals_of(model.scene).items():
        # A force law is a function of a way.
        finer = None if path.endswith(".elastic") else finer_of(signal)
        if finer is None:
            continue
        drawn, size = finer
        try:
            rows = difference(model, point, predicted, model.scene.with_values({path: drawn.model_dump(mode="json")}))
        except InputError:
            continue
        if rows is not None and rms_of(rows) >= least:
            moved.append(rows)
            sizes.append(f"{path} ({size:.2g} {unit(path)}".rstrip() + ")")
    if not moved:
        return None
    what = f"what is not known of {' and '.join(sizes)} between its samples"
    return Given(np.array(moved), EXACT, what, "; sample the drive more finely", one_of_many=True)


def finer_of(signal: Function) -> tuple[Function, float] | None:
    """A table as a spline of high degree draws it, and by how much that is another function (root mean square).

    It is not farther off than the samples about the place are from each other. None for tables of few rows, of rows
    that lie together, and of so many that a finer one has no place.
    """
    # Importing scipy takes longer than most identifications take to look here.
    from scipy.interpolate import make_interp_spline

    times, values = np.array(signal.table).T
    gaps, finer = np.diff(times), min(_FINER, MOST_ROWS // len(times))
    if len(times) < _FEWEST or finer < 2 or np.min(gaps) < _APART * np.mean(gaps):
        return None
    places = np.interp(np.arange(finer * len(gaps) + 1) / finer, np.arange(len(times)), times)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(values, 1, mode="edge"), 4)
    reach = np.repeat(np.ptp(near, axis=1), finer)
    off = make_interp_spline(times, values, _DEGREE)(places) - signal(places)
    off[:-1] = np.clip(off[:-1], -reach, reach)
    table = tuple(zip(places.tolist(), (signal(places) + off).tolist(), strict=True))
    return signal.model_copy(update={"table": table, "smooth": True}), float(np.sqrt(np.mean(off**2)))
