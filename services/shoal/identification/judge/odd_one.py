"""Which of several recordings contradicts the others: the one without which they fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shoal.findings import Finding
from shoal.identification.findings import ODD_RECORDING
from shoal.identification.forward import ForwardModel
from shoal.identification.judge.suspects.of_data import misfit
from shoal.identification.methods.lanes import descend_many
from shoal.identification.methods.starts import starting_points
from shoal.identification.recording.units import of_channels
from shoal.trajectory import Array

_MOST = 6
"""Recordings of which each is left out in turn: those with the largest residuals."""
_STARTS = 3
_PATIENCE = 100.0
_LOUD = 1.5
"""Times the noise: so much a fit without one recording may leave."""
_LARGE = 3.0
"""Times a noise that is only estimated; and times the residual of the others, from where on a recording stands out."""


def odd_one(model: ForwardModel, point: Array, residual: Array) -> Finding | None:
    """Return what was found about recordings that contradict each other; None where there is one or none does.

    point, residual (rows,): where all together were fitted. Raises TimeIsUp.
    """
    recordings = model.measurement.recordings
    if len(recordings) < 2:
        return None
    rows, unit = model.rows, of_channels(model.measurement)
    sizes = {name: misfit(residual[: len(rows.time)][rows.recording == k]) for k, name in enumerate(recordings)}
    largest = sorted(sizes, key=lambda name: -sizes[name])
    found = {name: left for name in largest[:_MOST] if (left := _without(model, point, name)) is not None}
    if len(found) == len(recordings) == 2:
        text = f"recordings {' and '.join(recordings)} fit alone, but not together"
        return ODD_RECORDING.found(text, "check what is known of either recording, and whether they are of one machine")
    if found:
        best = min(found, key=lambda name: found[name])
        size = f"{found[best]:.2g} {unit}".strip()
        text = f"without recording {best} the others fit, and leave {size}"
        return ODD_RECORDING.found(text, f"check recording {best}", residual=found[best])
    worst, *others = largest
    usual = float(np.median([sizes[name] for name in others]))
    if sizes[worst] > _LARGE * usual:
        text = f"the residual of recording {worst} is {sizes[worst]:.2g} {unit}, that of the others about {usual:.2g}"
        return ODD_RECORDING.found(text, f"check recording {worst}", residual=sizes[worst], usual=usual)
    return None


def _without(model: ForwardModel, point: Array, name: str) -> float | None:
    """What the fit of the other recordings leaves, root mean square; None where it is more than their noise."""
    kept = {other: one for other, one in model.measurement.recordings.items() if other != name}
    rest = model.aside(measurement=replace(model.measurement, recordings=kept))
    known: Mapping[str, float] = dict(zip(model.names, point, strict=True))
    there = np.clip(np.array([known[one] for one in rest.names]), rest.lower, rest.upper)
    ends = descend_many(rest, np.vstack([there, starting_points(rest)[:_STARTS]]), patience=_PATIENCE)
    left = min(misfit(end.residual) for end in ends)
    stated = rest.rows.noise
    noise = float(np.sqrt(np.mean((rest.rows.estimated * rest.rows.weight) ** 2))) if stated is None else stated
    return left if left <= (_LARGE if stated is None else _LOUD) * noise else None
