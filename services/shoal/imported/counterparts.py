"""Which joints of a scene stand for those by which a body of MuJoCo's hangs on its parent."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.imported.axes import are_parallel, are_square
from shoal.imported.rounding import ROUNDED, Array, numbers


def counterparts(kinds: Any, found: list[Any], axes: list[Array], together: bool) -> list[dict[str, Any]]:
    """Kinds and axes of the joints that stand for those found, the one that stands for the first of them last.

    kinds: MuJoCo's mjtJoint. found: of them, from the parent on. axes: unit vectors of the slides and hinges found.
    together: whether those that turn are in one place. A single ball or three hinges that stand for one are not asked
    for here. Returns none if no joints of a scene do.
    """
    hinge, slide, ball = kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE, kinds.mjJNT_BALL
    if not found:
        return [{"kind": "weld"}]
    if found == [hinge]:
        return [{"kind": "revolute", "axis": numbers(axes[0])}]
    if found == [slide]:
        return [_slider(axes[0], "locked")]
    if found == [slide, ball]:
        return [_slider(axes[0], "free")]
    if found == [hinge] * 2 and together and are_square(*axes):
        return [{"kind": "universal", "axis": numbers(axes[0]), "second_axis": numbers(axes[1])}]
    if found == [slide, hinge] and are_parallel(*axes):
        return [{"kind": "cylindrical", "axis": numbers(axes[0])}]
    if found == [slide, hinge] and are_square(*axes):
        return [_planar(axes[1], "axis"), _slider(axes[0], "free")]
    if found[:2] == [slide] * 2 and _is_plane(kinds, found[2:], axes):
        rotation = "locked" if len(found) == 2 else "axis" if found[2] == hinge else "free"
        return [_planar(np.cross(axes[0], axes[1]), rotation)]
    return []


def _slider(axis: Array, rotation: str) -> dict[str, Any]:
    return {"kind": "slider", "axis": numbers(axis), "rotation": rotation}


def _planar(normal: Array, rotation: str) -> dict[str, Any]:
    return {"kind": "planar", "axis": numbers(normal), "rotation": rotation}


def _is_plane(kinds: Any, turns: list[Any], axes: list[Array]) -> bool:
    """Return whether two slides, and a hinge or a ball after them, leave a plane and turns about its normal, or all."""
    normal = np.cross(axes[0], axes[1])
    if np.linalg.norm(normal) < ROUNDED or turns not in ([], [kinds.mjJNT_HINGE], [kinds.mjJNT_BALL]):
        return False
    square = turns == [kinds.mjJNT_HINGE] and np.linalg.norm(np.cross(normal, axes[2]))
    return bool(square < ROUNDED * np.linalg.norm(normal))
