"""A sweep is believed as far as some of its points, run alone and once more with care, bear it out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.sweep import SpotCheck, Sweep
from shoal.engines.verification import verified
from shoal.trajectory import Status

POINTS = 5
"""Looked at, from the first point of the grid to the last, evenly."""


def spot_checked(found: Sweep, engine: Engine) -> Sweep:
    """A sweep with the errors that are estimated at a few of its points. Points that failed are not looked at."""
    good = np.flatnonzero([status is Status.OK for status in found.status])
    if not good.size:
        return found
    looked_at = good[np.unique(np.linspace(0, good.size - 1, POINTS).round().astype(int))]
    times = np.unique([0.0, found.time])
    check = SpotCheck(len(looked_at), len(found.status))
    for point in looked_at:
        values = {path: float(lanes[point]) for path, lanes in found.grid.items()}
        run = verified(engine, found.scene.with_values(values), times)
        estimated = run.model.get("verification", {})
        check = replace(
            check,
            time_error=_larger(check.time_error, estimated.get("time_error")),
            mesh_error=_larger(check.mesh_error, estimated.get("mesh_error")),
            complaint=check.complaint or ("" if run.ok else f"{_words(values)}: {run.message}"),
        )
    return replace(found, check=check)


def _larger(one: float | None, other: float | None) -> float | None:
    return max((error for error in (one, other) if error is not None), default=None)


def _words(values: dict[str, float]) -> str:
    return ", ".join(f"{path} = {value:.4g}" for path, value in values.items())
