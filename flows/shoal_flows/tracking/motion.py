"""A trajectory in MLflow: a few hundred metrics to look at, the whole of it as a file."""

from __future__ import annotations

import numpy as np
from shoal.pictures.files import columns
from shoal.trajectory import Trajectory

from shoal_flows.tracking.store import Run

_POINTS = 300


def log_motion(run: Run, motion: Trajectory, marker: str, prefix: str = "") -> None:
    """Metrics `tip/x`, `tip/y` (in space `tip/z`) of a marker by ms, and `trajectory.csv` of all markers."""
    chosen = np.unique(np.linspace(0, len(motion.times) - 1, min(_POINTS, len(motion.times))).round().astype(int))
    path = motion.marker(marker)
    for k, axis in enumerate(motion.axes):
        run.series(f"{prefix}tip/{axis}", ((round(1e3 * motion.times[row]), float(path[row, k])) for row in chosen))
    run.text(columns(motion, repr), prefix.replace("/", "-") + "trajectory.csv")
