"""Joints in space as items of Exudyn: for each condition the items that impose it, and its residual along a motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shoal.engines.exudyn import user
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.connectors import Exchange, ForceLaw, exchange_of
from shoal.engines.exudyn.ground import driven
from shoal.engines.exudyn.space.ends import SpatialEnds, frame_about
from shoal.engines.exudyn.space.rows import Row, Toothed, add_rows, add_teeth, hold_node
from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.space.sections import ALIGNED
from shoal.mechanics.fitting import start_value
from shoal.mechanics.joints import Aligned, Along, Apart, Hinged, InPlane, Meet, Square, Turned, conditions
from shoal.mechanics.sums import Sum, period_of
from shoal.scene import JOINT_KINDS, Attachment, Joint, Revolute, Slider
from shoal.trajectory import Array

Gap = Callable[[Array, Array], Array]
"""Residual of a condition [m or rad] at coordinates and rates (rows, unknowns), (rows,)."""

SPATIAL_JOINTS = frozenset(JOINT_KINDS) - {"coupling", "rope"}


def add_joint(exu: Any, ends: SpatialEnds, name: str, joint: Joint) -> list[Gap]:
    """Add a joint without its friction; return the residuals of its conditions. Raises InputError."""
    ends.system.enter(f"joints.{name}")
    return [CONDITIONS[type(one)](exu, ends, f"joints.{name}", one) for one in conditions(joint, 3)]


def add_friction(ends: SpatialEnds, name: str, joint: Joint) -> Exchange | None:
    """Enter the friction of a joint, if it has any. Raises InputError."""
    if not isinstance(joint, Revolute | Slider) or not joint.resists:
        return None
    ends.system.enter(f"joints.{name}.friction")
    law = ForceLaw.of(joint)
    if isinstance(joint, Revolute):
        return add_twist(ends, f"joints.{name}.friction", joint.first, joint.second, joint.axis, law, None)
    return _add_rail(ends, f"joints.{name}.friction", joint, law)


def add_twist(
    ends: SpatialEnds,
    where: str,
    first: Attachment,
    second: Attachment,
    axis: Any,
    law: ForceLaw,
    rest: float | None,
) -> Exchange:
    """Enter a law over the angle about an axis of two rigid bodies; rest: where it is 0 [rad], else at the start."""
    require_rigid(ends, where, first, second)
    one, other = (frame_about(ends.image(side, axis)) for side in (first, second))
    begin = _angle(ends.start_axes(first)[None] @ one, ends.start_axes(second)[None] @ other)[0]
    origin = begin if rest is None else rest
    options = law.options(ends.system, "springTorqueUserFunction")
    if law.stiffness or law.cubic or law.elastic:
        # A data coordinate lets Exudyn count full turns.
        counter = ends.system.add("NodeGenericData", initialCoordinates=[begin], numberOfDataCoordinates=1)
        options |= {"nodeNumber": counter, "offset": origin}
    ends.system.add(
        "ObjectConnectorTorsionalSpringDamper",
        markerNumbers=[ends.framed(first, one), ends.framed(second, other)],
        **options,
    )

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        a, b = ends.moved(first, q, v), ends.moved(second, q, v)
        angle = np.unwrap(np.concatenate([[begin], _angle(a.axes @ one, b.axes @ other)]))[1:]
        return angle - origin, np.sum((spin(b.axes, b.turning) - spin(a.axes, a.turning)) * (a.axes @ one[:, 2]), 1)

    return exchange_of(law, measure)


def spin(axes: Array, turning: Array) -> Array:
    """Angular velocity [rad/s] along the axes of the ground, (rows, 3)."""
    return np.asarray(0.5 * np.sum(np.cross(axes, turning, axis=1), axis=2))


def require_rigid(ends: SpatialEnds, where: str, *sides: Attachment) -> None:
    """Raises InputError for a flexible rod and for a point mass, which have no frame."""
    for side in sides:
        if ends.is_cable(side):
            raise InputError(f"{where}: engine exudyn gives {side.body}, a cable in space, no frame; use gauss")
    ends.require_direction(where, *sides)


def _angle(first: Array, second: Array) -> Array:
    """The angle about the third axes from the first of one to the first of the other, (rows,)."""
    towards = second[:, :, 0]
    return np.asarray(np.arctan2(np.sum(first[:, :, 1] * towards, 1), np.sum(first[:, :, 0] * towards, 1)))


def _add_rail(ends: SpatialEnds, where: str, joint: Slider, law: ForceLaw) -> Exchange:
    require_rigid(ends, where, joint.first)
    line = ends.slide(joint)
    ends.system.add(
        "ObjectConnectorLinearSpringDamper",
        markerNumbers=[ends.turn(joint.first), ends.turn(joint.second)],
        axisMarker0=line.tolist(),
        **law.options(ends.system, "springForceUserFunction"),
    )

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        a, b = ends.moved(joint.first, q, v), ends.moved(joint.second, q, v)
        along, change = a.axes @ line, a.turning @ line
        apart, speed = b.position - a.position, b.velocity - a.velocity
        return np.sum(along * apart, 1), np.sum(along * speed + change * apart, 1)

    return exchange_of(law, measure)


def _lock(ends: SpatialEnds, first: Attachment, second: Attachment, axes: list[int], one: Array, other: Array) -> None:
    """Exudyn's joint that locks directions of the first marker's frame; one, other: frames (3, 3) in the bodies'."""
    ends.system.add(
        "ObjectJointGeneric",
        markerNumbers=[ends.framed(first, one), ends.framed(second, other)],
        constrainedAxes=axes,
    )


def _lock_place(
    exu: Any, ends: SpatialEnds, first: Attachment, second: Attachment, axes: list[int], frame: Array
) -> None:
    """The same of places only; of a cable, against the ground, without a marker that turns."""
    if ends.is_cable(second) and ends.is_ground(first):
        normals = frame[:, np.array(axes) == 1].T
        base = np.array(ends.part(first)[1])
        hold_node(exu, ends.system, ends.side(first), ends.side(second), normals, base)
    else:
        _lock(ends, first, second, [*axes, 0, 0, 0], frame, np.eye(3))


def _pair(ends: SpatialEnds, condition: Any, q: Array, v: Array) -> tuple[Any, Any]:
    return ends.moved(condition.first, q, v), ends.moved(condition.second, q, v)


def _meet(exu: Any, ends: SpatialEnds, where: str, one: Meet) -> Gap:
    ends.system.add("ObjectJointSpherical", markerNumbers=[ends.hold(one.first), ends.hold(one.second)])
    return lambda q, v: _apart(ends, one, q, v)


def _apart(ends: SpatialEnds, one: Any, q: Array, v: Array) -> Array:
    a, b = _pair(ends, one, q, v)
    return np.asarray(np.linalg.norm(b.position - a.position, axis=1))


def _along(exu: Any, ends: SpatialEnds, where: str, one: Along) -> Gap:
    require_rigid(ends, where, one.first)
    line = ends.line(one.first, one.direction)
    _lock_place(exu, ends, one.first, one.second, [1, 1, 0], frame_about(line))

    def gap(q: Array, v: Array) -> Array:
        a, b = _pair(ends, one, q, v)
        return np.asarray(np.linalg.norm(np.cross(a.axes @ line, b.position - a.position), axis=1))

    return gap


def _in_plane(exu: Any, ends: SpatialEnds, where: str, one: InPlane) -> Gap:
    require_rigid(ends, where, one.first)
    normal = ends.image(one.first, one.axis)
    _lock_place(exu, ends, one.first, one.second, [0, 0, 1], frame_about(normal))

    def gap(q: Array, v: Array) -> Array:
        a, b = _pair(ends, one, q, v)
        return np.asarray(np.abs(np.sum((a.axes @ normal) * (b.position - a.position), axis=1)))

    return gap


def _aligned(exu: Any, ends: SpatialEnds, where: str, one: Aligned) -> Gap:
    cables = [side for side in (one.first, one.second) if ends.is_cable(side)]
    if len(cables) == 2:
        return lambda q, v: np.zeros(len(q))  # neither has a section that could hold an axis
    if cables:
        return _cable_axis(exu, ends, one, cables[0])
    ends.require_direction(where, one.first, one.second)
    images = [ends.image(side, one.axis) for side in (one.first, one.second)]
    _lock(ends, one.first, one.second, [0, 0, 0, 1, 1, 0], *(frame_about(image) for image in images))

    def gap(q: Array, v: Array) -> Array:
        a, b = _pair(ends, one, q, v)
        return np.asarray(np.linalg.norm(np.cross(a.axes @ images[0], b.axes @ images[1]), axis=1))

    return gap


def _cable_axis(exu: Any, ends: SpatialEnds, one: Aligned, cable: Attachment) -> Gap:
    """A cable is held along the axis or at a right angle to it."""
    held = one.second if cable is one.first else one.first
    image = ends.image(held, one.axis)
    slope = ends.placement.start_of(ends.placement.direction(ends.scene, cable))[0][:, 0]
    cosine = abs(float(slope @ ends.start_axes(held) @ image)) / float(np.linalg.norm(slope))
    directions = [image] if cosine < ALIGNED else [part[:, 0] for part in turns.across(image[:, None])]
    return _products(exu, ends, held, cable, [Row(direction, direction) for direction in directions])


def _turned(exu: Any, ends: SpatialEnds, where: str, one: Turned) -> Gap:
    cables = [side for side in (one.first, one.second) if ends.is_cable(side)]
    if len(cables) == 2:
        raise InputError(f"{where}: engine exudyn welds no two cables in space; put a rigid body between them")
    if cables:
        held = one.second if cables[0] is one.first else one.first
        slope = ends.placement.start_of(ends.placement.direction(ends.scene, cables[0]))[0]
        image = turns.unit(ends.start_axes(held).T @ slope)
        rows = [Row(normal[:, 0], normal[:, 0]) for normal in turns.across(image)]
        return _products(exu, ends, held, cables[0], rows)
    if ends.is_point(one.first) or ends.is_point(one.second):
        return lambda q, v: np.zeros(len(q))
    other = ends.start_axes(one.second).T @ ends.start_axes(one.first)
    _lock(ends, one.first, one.second, [0, 0, 0, 1, 1, 1], np.eye(3), other)

    def gap(q: Array, v: Array) -> Array:
        a, b = _pair(ends, one, q, v)
        return np.asarray(np.linalg.norm(b.axes @ other - a.axes, axis=(1, 2)))

    return gap


def _square(exu: Any, ends: SpatialEnds, where: str, one: Square) -> Gap:
    require_rigid(ends, where, one.first, one.second)
    images = ends.image(one.first, one.axis), ends.image(one.second, one.second_axis)
    # Exudyn locks the product of the first axis of one and the second axis of the other.
    first, other = np.roll(frame_about(images[0]), 1, axis=1), np.roll(frame_about(images[1]), -1, axis=1)
    _lock(ends, one.first, one.second, [0, 0, 0, 0, 0, 1], first, other)

    def gap(q: Array, v: Array) -> Array:
        a, b = _pair(ends, one, q, v)
        return np.asarray(np.abs(np.sum((a.axes @ images[0]) * (b.axes @ images[1]), axis=1)))

    return gap


def _hinged(exu: Any, ends: SpatialEnds, where: str, one: Hinged) -> Gap:
    require_rigid(ends, where, one.first, one.second)
    course = driven(ends.system, one.angle, f"{where}.angle")
    here, there = (frame_about(ends.image(side, one.axis)) for side in (one.first, one.second))

    wanted = [ends.system.function(make, course.value, course.slope) for make in (user.cosine, user.sine)]
    rows = [Row(here[:, axis], there[:, 0], one) for axis, one in enumerate(wanted)]
    add_rows(exu, ends.system, ends.side(one.first), ends.side(one.second), rows)
    return lambda q, v: np.zeros(len(q))


def _meshed(exu: Any, ends: SpatialEnds, where: str, one: Sum) -> Gap:
    """Gears, whose angles are counted from the start, so that they add up to nothing."""
    factors, turned = zip(*one.parts, strict=True)
    second, first, carrier = (part.side for part in turned)
    if not ends.is_ground(carrier):
        raise InputError(f"{where}.carrier: engine exudyn cannot do gears on a carrier that turns; use gauss")
    require_rigid(ends, where, first, second)
    sides, frames = (
        (first, second),
        [frame_about(turns.unit(np.array(axis))) for axis in (turned[1].axis, turned[0].axis)],
    )
    images = [ends.start_axes(side).T @ frame[:, 0] for side, frame in zip(sides, frames, strict=True)]
    weights, period = factors[1::-1], period_of(factors) or 0.0
    toothed = [
        Toothed(ends.side(side), weight, image, frame[:, :2].T)
        for side, weight, image, frame in zip(sides, weights, images, frames, strict=True)
    ]
    add_teeth(exu, ends.system, (toothed[0], toothed[1]), period)

    def gap(q: Array, v: Array) -> Array:
        angles = [
            np.arctan2(*((ends.moved(side, q, v).axes @ image) @ frame[:, [1, 0]]).T)
            for side, image, frame in zip(sides, images, frames, strict=True)
        ]
        apart = sum(weight * angle for weight, angle in zip(weights, angles, strict=True))
        return np.asarray(np.abs(apart - period * np.rint(apart / period)))

    return gap


def _distant(exu: Any, ends: SpatialEnds, where: str, one: Apart) -> Gap:
    length = ends.start_distance(one.first, one.second) if one.length is None else start_value(one.length)
    markers = [ends.hold(one.first), ends.hold(one.second)]
    ends.system.add("ObjectConnectorDistance", markerNumbers=markers, distance=length)
    return lambda q, v: np.asarray(np.abs(_apart(ends, one, q, v) - length))


def _products(exu: Any, ends: SpatialEnds, held: Attachment, cable: Attachment, rows: list[Row]) -> Gap:
    """Directions of a body stay at right angles to a cable."""
    add_rows(exu, ends.system, ends.side(held), ends.side(cable), rows)

    def gap(q: Array, v: Array) -> Array:
        axes, slope = ends.moved(held, q, v).axes, ends.moved(cable, q, v).axes[:, :, 0]
        return np.asarray(np.linalg.norm([np.sum((axes @ row.first) * slope, axis=1) for row in rows], axis=0))

    return gap


def still(system: System, ground: Any, body: Any) -> None:
    """Keep a body from turning."""
    markers = [part.turn(system, (0.0, 0.0, 0.0)) for part in (ground, body)]
    system.add("ObjectJointGeneric", markerNumbers=markers, constrainedAxes=[0, 0, 0, 1, 1, 1])


CONDITIONS: dict[type, Callable[[Any, SpatialEnds, str, Any], Gap]] = {
    Meet: _meet,
    Along: _along,
    InPlane: _in_plane,
    Aligned: _aligned,
    Turned: _turned,
    Square: _square,
    Hinged: _hinged,
    Sum: _meshed,
    Apart: _distant,
}
"""How a condition is entered; what it returns tells how far it opens."""
