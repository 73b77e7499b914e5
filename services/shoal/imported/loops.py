"""Joints of URDF that close loops: of links that hang already."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.imported.counterparts import counterparts
from shoal.imported.parts import Parts
from shoal.imported.rounding import ROUNDED, Array
from shoal.imported.source import Source
from shoal.imported.urdf import Loop, Pose


def add_loops(file: Path, source: Source, loops: Iterable[Loop], parts: Parts) -> None:
    """Add the joints that close loops; a line for each that is open at the start. Raises InputError for other types."""
    kinds = source.mujoco.mjtJoint
    types = {
        "continuous": [kinds.mjJNT_HINGE],
        "revolute": [kinds.mjJNT_HINGE],
        "prismatic": [kinds.mjJNT_SLIDE],
        "fixed": [],
    }
    names = {
        source.mujoco.mj_id2name(source.model, source.mujoco.mjtObj.mjOBJ_BODY, k): k for k in range(source.model.nbody)
    }
    for one in loops:
        if gone := [body for body in one.bodies if body not in names]:
            parts.miss(f"{one.element}: closes a loop with {gone[0]}, which is not in the scene")
            continue
        bodies = [names[body] for body in one.bodies]
        first, second = (_of_ground(source, *side) for side in zip(bodies, one.poses, strict=True))
        gap = float(np.linalg.norm(second.place - first.place))
        axis = first.turn @ one.axis
        made: dict[str, Any] = {"kind": "spherical"}
        if one.kind in types:
            (made,) = counterparts(kinds, types[one.kind], [axis] if types[one.kind] else [], together=True)
        elif one.kind not in ("ball", "spherical"):
            raise InputError(f"{file}: {one.element}: closes a loop; type: must be {', '.join(types)} or spherical")
        if gap > ROUNDED and made["kind"] != "slider":
            parts.miss(f"{one.element}: closes a loop that is open by {gap:.3g} m in the pose of the file")
            continue
        places = {"first": source.at(bodies[0], first.place), "second": source.at(bodies[1], second.place)}
        called = one.name if one.name not in parts.joints else f"loop-{one.name}"
        parts.joints[called], parts.origin[f"joints.{called}"] = places | made, str(one.element)


def _of_ground(source: Source, body: int, pose: Pose) -> Pose:
    axes: Array = source.axes(body)
    return Pose(axes, source.data.xpos[body]).then(pose)
