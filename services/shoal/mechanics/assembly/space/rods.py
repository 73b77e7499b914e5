"""The coordinates of a flexible rod in space, and what joints hold of its direction."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.groups import JointPoint, is_stiff, product, transposed
from shoal.mechanics.assembly.pose import Pose, arm
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.holding import direction, of_image
from shoal.mechanics.elements import SPATIAL
from shoal.mechanics.frames import BeamFrame, is_on_axis
from shoal.mechanics.joints import Aligned, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Rod, Scene

ALIGNED = 1e-9
"""Cosine from which two directions do not count as being at a right angle."""


def place_rod(name: str, rod: Rod, mine: list[JointPoint], pose: Pose, result: SpatialPlacement) -> None:
    """Give a rod its nodes; they start unstrained. Raises InputError for a joint beside the axis."""
    element = SPATIAL[rod.element]
    shared: dict[int, JointPoint] = {}
    inner: list[JointPoint] = []
    for point in mine:
        p = point.local(name)
        place = p[0] / rod.length * rod.elements
        node = int(np.rint(np.asarray(place).flat[0]))
        if np.any(np.abs(place - node) > 1e-9) or not is_on_axis(p):
            inner.append(point)
        else:
            shared[node] = point
    nodes = []
    for node in range(rod.elements + 1):
        s = rod.length * node / rod.elements
        at = (s, 0.0, 0.0)
        joint = shared.get(node)
        r, v = pose.point(at), pose.point_velocity(at)
        if joint is not None and joint.where is not None:
            _check_fit(name, rod, r, joint, result)
        position = result.new_vector(r, v) if joint is None else joint.where or result.make(joint, r, v)
        slopes = [
            result.new_vector(arm(pose.directors, tuple(vector)), arm(pose.turning, tuple(vector)))
            for vector in element.nodal_vectors(rod, s)
        ]
        for i, j, value in element.products:
            result.terms.dot(name, slopes[i], slopes[j], 0, -value)
        nodes.append((position, *slopes))
    frame = BeamFrame(name, element, rod.length, tuple(nodes))
    result.frames[name] = frame
    for point in [*shared.values(), *inner]:
        place = point.local(name)
        node_there = frame.node(place)
        if point in inner or point.where is not frame.nodes[node_there or 0][0]:
            result.share(point, frame.point(place))


def _check_fit(name: str, rod: Rod, planned: Array, point: JointPoint, result: SpatialPlacement) -> None:
    """Raises InputError if a joint holds a rod somewhere else than where it would start unstrained."""
    assert point.where is not None
    apart = np.sqrt(np.sum((result.start_of(point.where)[0] - planned) ** 2, axis=0))
    away = np.max(apart)
    if np.any(apart > 1e-6 * rod.length):
        raise InputError(
            f"initial.{name}: joint {point.name} holds {name} {away:.3g} m away from where the unstrained rod would "
            "start"
        )


def hold_rod(scene: Scene, name: str, condition: Aligned | Turned, result: SpatialPlacement) -> None:
    """What a joint holds of the direction of a flexible rod: its axis, since a cable has no section that could turn.

    Raises InputError for what no cable can be held by.
    """
    sides = [condition.first, condition.second]
    rods = [side for side in sides if not is_stiff(scene, side.body)]
    if isinstance(condition, Turned):
        _clamp(scene, name, condition, result)
    elif len(rods) == 1:
        held, rod = next(side for side in sides if side is not rods[0]), rods[0]
        slope = result.direction(scene, rod)
        cosine = float(np.max(np.abs(_axis_of(result, rod) @ _unit(condition.axis))))
        axis = direction(result, held.body, condition.axis)
        if cosine < ALIGNED:
            result.terms.dot(name, axis, slope, 0)
        elif cosine > 1.0 - ALIGNED:
            for normal in turns.across(result.attitudes.image(held.body, condition.axis)):
                result.terms.dot(name, of_image(result, held.body, normal), slope, 0)
        else:
            raise InputError(
                f"joints.{name}.axis: is neither along the rod {rod.body} nor at a right angle to it; a cable has no "
                "section that could hold it"
            )


def _clamp(scene: Scene, name: str, weld: Turned, result: SpatialPlacement) -> None:
    """The axis of a rod keeps its direction in another body, or goes on in that of another rod."""
    first, second = weld.first, weld.second
    if not is_stiff(scene, first.body) and not is_stiff(scene, second.body):
        one, other = (result.direction(scene, side) for side in (first, second))
        if float(np.min(np.abs(_axis_of(result, first) @ _axis_of(result, second)))) < 1.0 - ALIGNED or weld.angle:
            raise InputError(f"joints.{name}: welds two rods that are not in one line; put a rigid body between them")
        for skew in turns.skew(np.eye(3)).transpose(2, 0, 1):
            result.terms.form(name, one, other, skew, 0)
        return
    held, rod = (first, second) if is_stiff(scene, first.body) else (second, first)
    relative = product(transposed(result.attitudes.rotation(held.body)), result.attitudes.rotation(rod.body))
    if weld.angle is not None:
        relative = turns.about_z(weld.angle if held is first else -np.asarray(weld.angle))
    slope = result.direction(scene, rod)
    for normal in turns.across(relative[:, 0]):
        result.terms.dot(name, of_image(result, held.body, normal), slope, 0)


def _axis_of(result: SpatialPlacement, rod: Attachment) -> Array:
    """The direction of a rod at the start, (3,) of the first lane."""
    return np.asarray(result.attitudes.rotation(rod.body)[:, 0, 0])


def _unit(axis: Any) -> Array:
    return np.asarray(np.asarray(axis) / np.linalg.norm(axis))
