"""A trajectory in MLflow: a few hundred metrics to look at, the whole of it as a file."""

from __future__ import annotations

import csv
from io import StringIO

import numpy as np
from shoal.trajectory import Trajectory

from shoal_flows.tracking.store import Run

_POINTS = 300


def log_motion(run: Run, motion: Trajectory, marker: str, prefix: str = "") -> None:
    """Metrics `tip/x`, `tip/y` of a marker with the step in ms, and `trajectory.csv` of all markers."""
    chosen = np.unique(np.linspace(0, len(motion.times) - 1, min(_POINTS, len(motion.times))).round().astype(int))
    path = motion.marker(marker)
    for k, name in enumerate(("tip/x", "tip/y")):
        run.series(prefix + name, ((round(1e3 * motion.times[row]), float(path[row, k])) for row in chosen))
    run.text(as_csv(motion), prefix.replace("/", "-") + "trajectory.csv")


def as_csv(motion: Trajectory) -> str:
    """Time [s], x and y [m] and angle [rad] of every marker, with all digits."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["t", *(f"{name}.{part}" for name in motion.markers for part in ("x", "y", "angle"))])
    for row, time in enumerate(motion.times.tolist()):
        cells = [(*motion.points[row, k, :, 0].tolist(), motion.angles[row, k, 0]) for k in range(len(motion.markers))]
        writer.writerow([repr(time), *(repr(float(value)) for cell in cells for value in cell)])
    return stream.getvalue()
