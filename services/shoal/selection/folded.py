"""Torques under which no theory of rods holds: sections fold over one another."""

from __future__ import annotations

from collections.abc import Collection

from shoal.scene import Rod, Scene, Torque, TorsionSpring
from shoal.scene.joints import places, sides
from shoal.scene.loads import Load

BEYOND = 1.0
"""Strain of bending at the surface of a rod beyond which its pressed fibres have no length left."""


def folded(scene: Scene, rods: Collection[str]) -> str:
    """Which torques fold the end of a rod that moves in the plane, or nothing.

    The end that torques M hold alone bends at the curvature M/(E I), the strain at its surface is M h/(2 E I). Nothing
    is said of an end where a joint, a torsion spring or a torque that changes with time acts.
    """
    if scene.dimensions == 3:
        return ""
    for body in rods:
        rod = scene.bodies[body]
        for end in ("start", "end"):
            names = _alone(scene, body, end)
            if not isinstance(rod, Rod) or not names:
                continue
            section = rod.section_at(float(end == "end"))
            assert rod.youngs_modulus is not None
            moment = sum(_at(scene.loads[name], body, end) for name in names)
            strain = float(abs(moment) * section.height / (2 * rod.youngs_modulus * section.bending))
            if strain > BEYOND:
                said = f"the torque {names[0]} bends" if len(names) == 1 else f"the torques {', '.join(names)} bend"
                return (
                    f"{said} {body} to a strain of {strain:.2g} at its surface, where no theory of rods holds beyond "
                    f"{BEYOND:g}"
                )
    return ""


def _alone(scene: Scene, body: str, end: str) -> list[str]:
    """The constant torques at an end of a rod where nothing else holds its direction."""
    place = (body, end)
    if any(place == (side.body, side.point) for joint in scene.joints.values() for side in places(joint)):
        return []
    found = []
    for name, load in scene.loads.items():
        if not any(place == (side.body, side.point) for side in sides(load).values()):
            continue
        if isinstance(load, TorsionSpring) or (isinstance(load, Torque) and load.torque.number is None):
            return []
        if isinstance(load, Torque):
            found.append(name)
    return found


def _at(load: Load, body: str, end: str) -> float:
    """The moment of a constant torque on an end of a rod [N m]."""
    assert isinstance(load, Torque)
    assert load.torque.number is not None
    here = [(load.at, 1.0), (load.reaction, -1.0)]
    return load.torque.number * sum(sign for side, sign in here if side and (side.body, side.point) == (body, end))
