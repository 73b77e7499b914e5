"""Drives whose table does not cover the motion: outside it they hold, and their rate jumps at its ends."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.scene.function import Function
from shoal.scene.scene import Scene

_NO_JUMP = 1e-9
"""Of the largest rate between two rows of a table: less is no jump."""


def held_drives(scene: Scene) -> list[str]:
    """Return a sentence for each end of a drive's table at which its rate jumps within the scene's duration."""
    return [line for path, drive, unit in _drives(scene) for line in _jumps(path, drive, unit, scene.solver.duration)]


def _drives(scene: Scene) -> Iterator[tuple[str, Function, str]]:
    """Yield the functions of time that constraints follow, with their paths and units."""
    for name, joint in scene.joints.items():
        for field, unit in (("angle", "rad"), ("length", "m"), ("value", "m")):
            if isinstance(drive := getattr(joint, field, None), Function):
                yield f"joints.{name}.{field}", drive, unit
    for name, point in scene.ground_points.items():
        for axis in "xyz"[: scene.dimensions]:
            yield f"ground_points.{name}.{axis}", getattr(point, axis), "m"


def _jumps(path: str, drive: Function, unit: str, end: float) -> Iterator[str]:
    if drive.table is None or len(drive.table) < 2:
        return
    times, values = np.array(drive.table).T
    least = _NO_JUMP * float(np.max(np.abs(np.diff(values) / np.diff(times))))
    first, last = drive.table_slope(times[0], left=False), drive.table_slope(times[-1], left=True)
    if 0.0 < times[0] < end and abs(first) > least:
        holds = f"its table begins at {times[0]:.6g} s: until then it holds {values[0]:.6g} {unit}"
        yield f"{path}: {holds}, then its rate jumps from 0 to {first:.4g} {unit}/s"
    if times[-1] < end and abs(last) > least:
        holds = f"its table ends at {times[-1]:.6g} s, before the motion at {end:.6g} s"
        jumps = f"there its rate jumps from {last:.4g} {unit}/s to 0"
        yield f"{path}: {holds}: {jumps}, and it holds {values[-1]:.6g} {unit}"
