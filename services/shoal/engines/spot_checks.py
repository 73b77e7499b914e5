"""Spot checks of a sweep: some of its points are run alone and verified by more careful runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.sweep import SpotCheck, Sweep
from shoal.engines.verification import verified
from shoal.error_budget import worst
from shoal.scene import Scene
from shoal.trajectory import Array, Status

POINTS = 5
"""Looked at, from the first point of the grid to the last, evenly."""


def spot_checked(found: Sweep, engine: Engine) -> Sweep:
    """A sweep with the errors that are estimated at a few of its points. Points that failed are not looked at."""
    times = np.unique([0.0, found.time])
    check = spot_check(engine, found.scene, found.grid, found.status, times)
    return replace(found, check=check) if check.looked_at else found


def spot_check(
    engine: Engine, scene: Scene, values: Mapping[str, Array], status: Sequence[Status], times: Sequence[float] | Array
) -> SpotCheck:
    """The errors that are estimated at a few of the points that did not fail, up to `times` [s].

    values: path -> one number per point; status: of every point
    """
    good = np.flatnonzero([one is Status.OK for one in status])
    if not good.size:
        return SpotCheck(0, len(status))
    looked_at = good[np.unique(np.linspace(0, good.size - 1, POINTS).round().astype(int))]
    check = SpotCheck(len(looked_at), len(status))
    for point in looked_at:
        here = {path: float(column[point]) for path, column in values.items()}
        run = verified(engine, scene.with_values(here), times)
        check = replace(
            check,
            errors=worst([check.errors, run.errors]),
            complaint=check.complaint or ("" if run.ok else f"{_words(here)}: {run.explanation}"),
        )
    return check


def _words(values: dict[str, float]) -> str:
    return ", ".join(f"{path} = {value:.4g}" for path, value in values.items())
