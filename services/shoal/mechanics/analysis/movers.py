"""The bodies that a small motion moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from shoal.mechanics.affine import points
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.frames import PointFrame, RigidFrame

SHARE = 0.1
"""Bodies that move by less than this part of the farthest motion are not named."""
MOST = 4
"""Bodies named at most."""


def movers(placement: Placement, size: float, displacement: npt.NDArray[Any]) -> str:
    """Name the bodies that a displacement of the coordinates, (unknowns,), moves, the one that moves most first.

    size: of the machine [m]; a turn of 1 rad counts as much. The displacement may be complex.
    """
    sizes = {}
    for name, frame in placement.frames.items():
        moving = points(_vectors(frame, size), len(displacement)).moved(displacement)
        sizes[name] = float(np.max(np.linalg.norm(moving, axis=1)))
    largest = max(sizes.values())
    ranked = sorted((name for name in sizes if sizes[name] > SHARE * largest), key=lambda name: -sizes[name])
    return ", ".join(ranked[:MOST]) + (", ..." if len(ranked) > MOST else "")


def _vectors(frame: Any, size: float) -> list[Any]:
    """Return vectors [m] that define the motion of a body."""
    if isinstance(frame, PointFrame):
        return [frame.origin]
    if isinstance(frame, RigidFrame):
        return [frame.origin, *(frame.origin + one * size for one in frame.directors[: len(frame.directors) - 1])]
    return [node[0] for node in frame.nodes]
