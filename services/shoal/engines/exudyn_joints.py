"""Joints inside Exudyn, and how far each of them opens."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shoal.engines.exudyn_bodies import RigidPart
from shoal.engines.exudyn_chain import cross
from shoal.engines.exudyn_connectors import Exchange, Law, add_rail, add_torsion
from shoal.engines.exudyn_ends import Ends
from shoal.engines.exudyn_ground import Coordinate, GroundPart, drive, driven
from shoal.engines.poses import kept_turn, value
from shoal.errors import InputError
from shoal.scene import Attachment, Coupling, Distance, DrivenAngle, Parallel, Perpendicular, Revolute, Slider, Weld
from shoal.scene.joints import Joint
from shoal.trajectory import Array

Gap = Callable[[Array, Array], Array]
"""How far a joint is open [m, or rad where it holds an angle only] for q and v (rows, unknowns), (rows,)."""


def add_joint(ends: Ends, name: str, joint: Joint) -> Gap:
    """Enter a joint without its friction. Raises InputError."""
    items, add = ends.system.items, ends.system.mbs.AddObject
    where = f"joints.{name}"
    if isinstance(joint, Coupling):
        raise InputError(f"{where}: engine exudyn cannot do coupling; use gauss")
    first, second = joint.first, joint.second
    turn = kept_turn(ends.scene, joint)
    points = ends.is_point(first) or ends.is_point(second)
    if isinstance(joint, Revolute) or (isinstance(joint, Weld) and points):
        add(items.ObjectJointRevolute2D(markerNumbers=[ends.hold(first), ends.hold(second)]))
    elif isinstance(joint, Weld | Parallel | Perpendicular):
        ends.require_direction(where, first, second)
        assert turn is not None
        held = 1 if isinstance(joint, Weld) else 0
        add(
            items.ObjectJointGeneric(
                markerNumbers=ends.level(first, second, turn), constrainedAxes=[held, held, 0, 0, 0, 1]
            )
        )
    elif isinstance(joint, Slider):
        ends.require_direction(where, first)
        # Exudyn's normal belongs to its marker 1, which is therefore the body with the line.
        along = joint.direction - (turn or 0.0)
        add(
            items.ObjectJointPrismatic2D(
                markerNumbers=[ends.turn(second), ends.turn(first)],
                axisMarker0=[np.cos(along), np.sin(along), 0.0],
                normalMarker1=[-np.sin(joint.direction), np.cos(joint.direction), 0.0],
                constrainRotation=turn is not None and not points,
            )
        )
    elif isinstance(joint, Distance):
        length = float(np.linalg.norm(ends.start(second) - ends.start(first)))
        if joint.length is not None:
            length = value(joint.length, 0.0)
        add(items.ObjectConnectorDistance(markerNumbers=[ends.hold(first), ends.hold(second)], distance=length))
    else:
        ends.require_direction(where, first, second)
        _drive_angle(ends, where, joint)
    return lambda q, v: _gap(ends, joint, q, v)


def add_friction(ends: Ends, name: str, joint: Joint) -> Exchange | None:
    """Enter the friction of a joint, if it has any."""
    if not isinstance(joint, Revolute | Slider) or not (joint.friction or joint.coulomb):
        return None
    law = Law(damping=joint.friction, coulomb=joint.coulomb, speed=joint.coulomb_speed)
    if isinstance(joint, Slider):
        return add_rail(ends, joint.first, joint.second, joint.direction, law)
    ends.require_direction(f"joints.{name}.friction", joint.first, joint.second)
    return add_torsion(ends, joint.first, joint.second, law, None)


def _drive_angle(ends: Ends, where: str, joint: DrivenAngle) -> None:
    """The angle is a difference of two coordinates, which Exudyn counts from the start."""

    def coordinate(side: Attachment) -> Coordinate:
        part, _ = ends.part(side)
        if isinstance(part, GroundPart):
            return part.node, 0
        if isinstance(part, RigidPart):
            return part.node, 2
        raise InputError(f"{where}: drives the angle of a flexible rod; weld a rigid body to it instead")

    course = driven(ends.system, joint.angle, f"{where}.angle")
    begin = course.value(0.0)
    drive(
        ends.system,
        coordinate(joint.first),
        coordinate(joint.second),
        lambda t: course.value(t) - begin,
        course.slope,
    )


def _gap(ends: Ends, joint: Joint, q: Array, v: Array) -> Array:
    assert not isinstance(joint, Coupling)
    a, b = ends.motion(joint.first, q, v), ends.motion(joint.second, q, v)
    apart = b.position - a.position
    if isinstance(joint, Revolute | Weld):
        return np.asarray(np.linalg.norm(apart, axis=1))
    if isinstance(joint, Slider):
        angle = a.direction + joint.direction
        return np.abs(cross(np.stack([np.cos(angle), np.sin(angle)], axis=1), apart))
    if isinstance(joint, Distance):
        distance = np.linalg.norm(apart, axis=1)
        return np.asarray(np.abs(distance - distance[0]))
    if isinstance(joint, DrivenAngle):
        return np.zeros(len(q))
    turn = kept_turn(ends.scene, joint)
    assert turn is not None
    return np.asarray(np.abs(np.angle(np.exp(1j * (b.direction - a.direction - turn)))))
