"""Torques under which no theory of rods holds: sections fold over one another."""

from __future__ import annotations

from collections.abc import Collection

from shoal.scene import Rod, Scene, Torque
from shoal.scene.joints import places

BEYOND = 1.0
"""Strain of bending at the surface of a rod beyond which its pressed fibres have no length left."""


def folded(scene: Scene, rods: Collection[str]) -> str:
    """Which torque folds the end of a rod that moves in the plane, or nothing.

    The end that a torque M holds alone bends at the curvature M/(E I), the strain at its surface is M h/(2 E I).
    """
    if scene.dimensions == 3:
        return ""
    held = {(side.body, side.point) for joint in scene.joints.values() for side in places(joint)}
    for name, load in scene.loads.items():
        if not isinstance(load, Torque) or load.at.body not in rods or load.torque.number is None:
            continue
        rod, end = scene.bodies[load.at.body], load.at.point
        if not isinstance(rod, Rod) or end not in ("start", "end") or (load.at.body, end) in held:
            continue
        section = rod.section_at(float(end == "end"))
        assert rod.youngs_modulus is not None
        strain = float(abs(load.torque.number) * section.height / (2 * rod.youngs_modulus * section.bending))
        if strain > BEYOND:
            return (
                f"the torque {name} bends {load.at.body} to a strain of {strain:.2g} at its surface, where no theory "
                f"of rods holds beyond {BEYOND:g}"
            )
    return ""
