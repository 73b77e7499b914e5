"""Joints inside Exudyn, and how far each of them opens."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.exudyn.bodies import RigidPart
from shoal.engines.exudyn.chain import cross
from shoal.engines.exudyn.connectors import Exchange, ForceLaw, add_rail, add_torsion
from shoal.engines.exudyn.ends import SystemAttachments
from shoal.engines.exudyn.ground import Coordinate, GroundPart, drive, driven, mesh
from shoal.errors import InputError
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.joints import Turned, conditions
from shoal.mechanics.start.rigid_bodies import value_of
from shoal.scene import (
    GROUND,
    Attachment,
    Distance,
    DrivenAngle,
    Gear,
    Joint,
    Parallel,
    Perpendicular,
    Resisted,
    Revolute,
    Slider,
    Weld,
)
from shoal.trajectory import Array

Gap = Callable[[Array, Array], Array]
"""How far a joint is open [m, or rad where it holds an angle only] for q and v (rows, unknowns), (rows,)."""


def add_joint(ends: SystemAttachments, name: str, joint: Joint) -> Gap:
    """Enter a joint without its friction. Raises InputError."""
    enter, gap = of_kind(JOINTS, joint.kind, f"joints.{name}")
    ends.system.enter(f"joints.{name}")
    enter(ends, f"joints.{name}", joint)
    return partial(gap, ends, joint)


def add_friction(ends: SystemAttachments, name: str, joint: Joint) -> Exchange | None:
    """Enter the friction of a joint, if it has any. Raises InputError."""
    if not (isinstance(joint, Resisted) and joint.resists):
        return None
    where = f"joints.{name}.friction"
    rub = of_kind(FRICTION, joint.kind, where)
    ends.system.enter(where)
    return rub(ends, where, joint, ForceLaw.of(joint))


def _add_pin(ends: SystemAttachments, where: str, joint: Revolute | Weld) -> None:
    ends.system.add("ObjectJointRevolute2D", markerNumbers=[ends.hold(joint.first), ends.hold(joint.second)])


def _add_weld(ends: SystemAttachments, where: str, joint: Weld) -> None:
    if ends.is_point(joint.first) or ends.is_point(joint.second):
        _add_pin(ends, where, joint)
    else:
        _add_turn(ends, where, joint, place=1)


def _add_turn(ends: SystemAttachments, where: str, joint: Weld | Parallel | Perpendicular, place: int = 0) -> None:
    """Keep the angle between two bodies; place: 1 if their places stay together as well."""
    ends.require_direction(where, joint.first, joint.second)
    markers = ends.level(joint.first, joint.second, _turn(ends, joint))
    ends.system.add("ObjectJointGeneric", markerNumbers=markers, constrainedAxes=[place, place, 0, 0, 0, 1])


def _add_slider(ends: SystemAttachments, where: str, joint: Slider) -> None:
    ends.require_direction(where, joint.first)
    locked = joint.rotation == "locked"
    # Exudyn's normal belongs to its marker 1, which is therefore the body with the line.
    along = joint.direction - (_turn(ends, joint) if locked else 0.0)
    ends.system.add(
        "ObjectJointPrismatic2D",
        markerNumbers=[ends.turn(joint.second), ends.turn(joint.first)],
        axisMarker0=[np.cos(along), np.sin(along), 0.0],
        normalMarker1=[-np.sin(joint.direction), np.cos(joint.direction), 0.0],
        constrainRotation=locked and not (ends.is_point(joint.first) or ends.is_point(joint.second)),
    )


def _add_distance(ends: SystemAttachments, where: str, joint: Distance) -> None:
    length = ends.start_distance(joint.first, joint.second) if joint.length is None else value_of(joint.length)
    markers = [ends.hold(joint.first), ends.hold(joint.second)]
    ends.system.add("ObjectConnectorDistance", markerNumbers=markers, distance=length)


def _add_drive(ends: SystemAttachments, where: str, joint: DrivenAngle) -> None:
    """The angle is a difference of two coordinates, which Exudyn counts from the start."""
    course = driven(ends.system, joint.angle, f"{where}.angle")
    drive(ends.system, angle_of(ends, where, joint.first), angle_of(ends, where, joint.second), course)


def _add_gear(ends: SystemAttachments, where: str, joint: Gear) -> None:
    if joint.carrier.body != GROUND:
        raise InputError(f"{where}.carrier: engine exudyn cannot do gears on a carrier that turns; use gauss")
    mesh(ends.system, angle_of(ends, where, joint.first), angle_of(ends, where, joint.second), joint.ratio)


def angle_of(ends: SystemAttachments, where: str, side: Attachment) -> Coordinate:
    """The coordinate of Exudyn that is the angle of a body."""
    ends.require_direction(where, side)
    part, _ = ends.part(side)
    if isinstance(part, GroundPart):
        return part.node, 0
    if isinstance(part, RigidPart):
        return part.node, 2
    raise InputError(f"{where}: turns a flexible rod; weld a rigid body to it instead")


def _rub_pin(ends: SystemAttachments, where: str, joint: Revolute, law: ForceLaw) -> Exchange:
    ends.require_direction(where, joint.first, joint.second)
    return add_torsion(ends, joint.first, joint.second, law, None)


def _rub_slider(ends: SystemAttachments, where: str, joint: Slider, law: ForceLaw) -> Exchange:
    return add_rail(ends, joint.first, joint.second, joint.direction, law)


def _turn(ends: SystemAttachments, joint: Weld | Slider | Parallel | Perpendicular) -> float:
    """Angle [rad] from the first direction to the second, which the joint keeps."""
    (turned,) = (one for one in conditions(joint) if isinstance(one, Turned))
    ahead = start_angle(ends.scene, turned.second) - start_angle(ends.scene, turned.first)
    return float(turned.kept(ahead))


def _apart(ends: SystemAttachments, joint: Revolute | Weld | Distance, q: Array, v: Array) -> Array:
    """Distance of the two places."""
    a, b = ends.motion(joint.first, q, v), ends.motion(joint.second, q, v)
    return np.asarray(np.linalg.norm(b.position - a.position, axis=1))


def _off_line(ends: SystemAttachments, joint: Slider, q: Array, v: Array) -> Array:
    a, b = ends.motion(joint.first, q, v), ends.motion(joint.second, q, v)
    angle = a.direction + joint.direction
    return np.abs(cross(np.stack([np.cos(angle), np.sin(angle)], axis=1), b.position - a.position))


def _stretched(ends: SystemAttachments, joint: Distance, q: Array, v: Array) -> Array:
    distance = _apart(ends, joint, q, v)
    return np.asarray(np.abs(distance - distance[0]))


def _twisted(ends: SystemAttachments, joint: Parallel | Perpendicular, q: Array, v: Array) -> Array:
    a, b = ends.motion(joint.first, q, v), ends.motion(joint.second, q, v)
    return np.asarray(np.abs(np.angle(np.exp(1j * (b.direction - a.direction - _turn(ends, joint))))))


def _slipped(ends: SystemAttachments, joint: Gear, q: Array, v: Array) -> Array:
    a, b = (ends.motion(side, q, v).direction for side in (joint.first, joint.second))
    slip = (b - b[0]) - joint.ratio * (a - a[0])
    return np.asarray(np.abs(slip) / max(1.0, abs(joint.ratio)))


def _not_seen(ends: SystemAttachments, joint: DrivenAngle, q: Array, v: Array) -> Array:
    return np.zeros(len(q))


JOINTS: dict[
    str, tuple[Callable[[SystemAttachments, str, Any], None], Callable[[SystemAttachments, Any, Array, Array], Array]]
] = {
    "revolute": (_add_pin, _apart),
    "weld": (_add_weld, _apart),
    "slider": (_add_slider, _off_line),
    "distance": (_add_distance, _stretched),
    "parallel": (_add_turn, _twisted),
    "perpendicular": (_add_turn, _twisted),
    "driven-angle": (_add_drive, _not_seen),
    "gear": (_add_gear, _slipped),
}
"""How a kind is entered, and how far it opens."""
FRICTION: dict[str, Callable[[SystemAttachments, str, Any, ForceLaw], Exchange]] = {
    "revolute": _rub_pin,
    "slider": _rub_slider,
}
