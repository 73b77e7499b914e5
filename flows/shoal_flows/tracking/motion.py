"""A trajectory in MLflow: a few hundred metrics to look at, the whole of it as a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shoal.pictures.files import columns
from shoal.trajectory import Trajectory

from shoal_flows.tracking.store import Run

TIP = "tip"
_POINTS = 300


def tip(markers: Sequence[str], measured: str | None = None) -> str:
    """The marker that is shown if one is: the one that is called so, else one that is measured, else the last."""
    return TIP if TIP in markers else measured or markers[-1]


def log_motion(
    run: Run, motion: Trajectory, measured: str | None = None, prefix: str = "", *, told: bool = True
) -> None:
    """Metrics `tip/x` and so on of a marker by ms, its name as the setting `tip`, and `trajectory.csv` of all markers.

    told: whether the motion is accepted; otherwise there are no metrics, and the name of the file says so
    """
    marker, name = tip(motion.markers, measured), "trajectory.csv" if told else "trajectory-rejected.csv"
    run.params({f"{prefix}tip": marker})
    chosen = np.unique(np.linspace(0, len(motion.times) - 1, min(_POINTS, len(motion.times))).round().astype(int))
    path = motion.marker(marker)
    for k, axis in enumerate(motion.axes if told else ""):
        run.series(f"{prefix}tip/{axis}", ((round(1e3 * motion.times[row]), float(path[row, k])) for row in chosen))
    run.text(columns(motion, repr), prefix.replace("/", "-") + name)


def log_ends(run: Run, motion: Trajectory) -> None:
    """Metrics `final/MARKER/x` and so on of every marker, and of the tip without its name."""
    shown = tip(motion.markers)
    for name in motion.markers:
        for axis, place in zip(motion.axes, motion.marker(name)[-1].tolist(), strict=True):
            run.metric(f"final/{name}/{axis}", place)
            if name == shown:
                run.metric(f"final/{axis}", place)
