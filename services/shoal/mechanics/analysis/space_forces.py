"""The unknowns of joints in space, their friction, and the displacements of free bodies there.

A body turns by a small vector: of a rigid body half the sum of d x delta d over its directors, of a section that of its
slope and, about it, of its director; a cable has no turn about its axis, and no joint turns it there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import rotation as turns
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_forces import Component, Moving, Rubbing, gap, moving, of_places
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.holding import direction, line_of
from shoal.mechanics.assembly.space.sections import image
from shoal.mechanics.frames import BeamFrame, PointFrame
from shoal.mechanics.joints import Aligned, Along, Geared, Hinged, InPlane, Square, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Attachment, Revolute, Slider

_NONE, _ALL = np.zeros(3), np.eye(3)


def components(bodies: FreeBodies, name: str, condition: Any, at: Array) -> list[Component]:
    """The unknowns of a condition of a joint."""
    if isinstance(condition, Turned):
        return _torques(bodies, name, condition, _ALL, at)
    if isinstance(condition, Aligned):
        axis = _axis(bodies, condition.first, condition.second, condition.axis, at)
        both = all(_is_cable(bodies, side.body) for side in (condition.first, condition.second))
        return [] if both and condition.axis is not None else _torques(bodies, name, condition, _across(axis), at)
    if isinstance(condition, Hinged):
        axis = _axis(bodies, condition.first, condition.second, condition.axis, at)
        return _torques(bodies, name, condition, axis[None], at)
    if isinstance(condition, Geared):
        axes = [_held(bodies, side.body, one, at) for side, one in zip(condition.sides, condition.axes, strict=True)]
        turns_of = [one @ _turn(bodies, side, at) for one, side in zip(axes, condition.sides, strict=True)]
        turning = np.array(condition.factors) @ np.array(turns_of)
        return [Component(name, "torque", turning, _NONE, condition.factors[0] * axes[0])]
    if isinstance(condition, Square):
        one = _pointing(bodies, condition.first, condition.axis, at)
        other = _pointing(bodies, condition.second, condition.second_axis, at)
        return _torques(bodies, name, condition, turns.unit(np.cross(one, other))[None], at)
    if isinstance(condition, Along):
        line = moving(bodies, line_of(_placement(bodies), condition.first.body, condition.direction), at).value
        return _pushes(bodies, name, condition, _across(line), at)
    if isinstance(condition, InPlane):
        return _pushes(bodies, name, condition, _held(bodies, condition.first.body, condition.axis, at)[None], at)
    return of_places(bodies, name, condition, at, _NONE)


def rubbing(bodies: FreeBodies, joint: Revolute | Slider, at: Array) -> Rubbing:
    """What the friction of a joint acts on."""
    if isinstance(joint, Revolute):
        axis = _axis(bodies, joint.first, joint.second, joint.axis, at)
        return Rubbing(axis @ _turning(bodies, joint, at), _NONE, axis)
    along = joint.direction if joint.axis is None else joint.axis
    line = moving(bodies, line_of(_placement(bodies), joint.first.body, along), at).value
    return Rubbing(line @ _sliding(bodies, joint, at), line, _NONE)


def displacements(bodies: FreeBodies, at: Array, lever: float) -> Array:
    """Displacements of the free bodies whose work must vanish, (displacements, unknowns)."""
    rows = []

    def add(*moves: tuple[Any, Array]) -> None:
        row = np.zeros(bodies.unknowns)
        for vector, value in moves:
            row[list(vector.own or ())] = value
        rows.append(row)

    for frame in bodies.placement.frames.values():
        if isinstance(frame, PointFrame):
            for axis in _ALL:
                add((frame.origin, axis))
        elif isinstance(frame, BeamFrame):
            for node in frame.nodes:
                for axis in _ALL:
                    add((node[0], axis))
                if frame.element.director is None:
                    for k, vector in enumerate(node[1:], 1):
                        for axis in _ALL:
                            add((vector, axis * lever ** -float(k)))
                    continue
                vectors = [(vector, vector.at(at)) for vector in node[1:]]
                add((vectors[0][0], vectors[0][1] / lever))
                for axis in _ALL:
                    add(*((vector, np.cross(axis, value) / lever) for vector, value in vectors))
        else:
            for axis in _ALL:
                add((frame.origin, axis))
                add(*((vector, np.cross(axis, vector.at(at)) / lever) for vector in frame.directors))
    return np.array(rows)


def _torques(bodies: FreeBodies, name: str, condition: Any, axes: Array, at: Array) -> list[Component]:
    """Torques along some axes, (axes, 3); what would turn a cable about itself is left out."""
    for side in (condition.first, condition.second):
        if _is_cable(bodies, side.body):
            along = turns.unit(moving(bodies, bodies.placement.direction(bodies.scene, side), at).value)
            _, sizes, right = np.linalg.svd((axes @ along)[None])
            axes = right[int(np.sum(sizes > 1e-9)) :] @ axes
    turning = _turning(bodies, condition, at)
    names = ["mx", "my", "mz"] if len(axes) == 3 else [f"m{k + 1}" for k in range(len(axes))]
    return [Component(name, one, axis @ turning, _NONE, axis) for one, axis in zip(names, axes, strict=True)]


def _pushes(bodies: FreeBodies, name: str, condition: Any, normals: Array, at: Array) -> list[Component]:
    """Forces along some normals at the second place, (normals, 3)."""
    sliding = _sliding(bodies, condition, at)
    names = ["normal"] if len(normals) == 1 else [f"normal{k + 1}" for k in range(len(normals))]
    return [Component(name, one, n @ sliding, n, _NONE) for one, n in zip(names, normals, strict=True)]


def _sliding(bodies: FreeBodies, condition: Any, at: Array) -> Array:
    """d(second place) relative to the first body, as seen from it, (3, unknowns)."""
    way = gap(bodies, condition, at)
    return way.slope - np.cross(_turn(bodies, condition.first, at).T, way.value).T


def _turning(bodies: FreeBodies, condition: Any, at: Array) -> Array:
    """The turn of the second body less that of the first, (3, unknowns)."""
    return _turn(bodies, condition.second, at) - _turn(bodies, condition.first, at)


def _turn(bodies: FreeBodies, side: Attachment, at: Array) -> Array:
    """The small turn of a body at a place by the coordinates of the free bodies, (3, unknowns)."""
    frame = None if side.body == GROUND else bodies.placement.frames[side.body]
    if frame is None or isinstance(frame, PointFrame):
        return np.zeros((3, bodies.unknowns))
    if not isinstance(frame, BeamFrame):
        return 0.5 * sum((_by(moving(bodies, one, at)) for one in frame.directors), np.zeros((3, bodies.unknowns)))
    slope = moving(bodies, bodies.placement.direction(bodies.scene, side), at)
    square = float(slope.value @ slope.value)
    total = _by(slope) / square
    node = frame.node(bodies.scene.location(side))
    if frame.element.director is not None and node is not None:
        along, director = slope.value / np.sqrt(square), moving(bodies, frame.nodes[node][2], at)
        total = total + np.outer(along, np.cross(along, director.value) @ director.slope)
    return np.asarray(total)


def _by(vector: Moving) -> Array:
    """v x delta v, (3, unknowns)."""
    return np.asarray(np.cross(vector.value, vector.slope.T).T)


def _axis(bodies: FreeBodies, first: Attachment, second: Attachment, axis: Any, at: Array) -> Array:
    """A common axis of two bodies, as one that is rigid has it, or a section."""
    sides = sorted((first, second), key=lambda side: (_is_rod(bodies, side.body), _is_cable(bodies, side.body)))
    return _pointing(bodies, sides[0], axis, at)


def _pointing(bodies: FreeBodies, side: Attachment, axis: Any, at: Array) -> Array:
    """The unit vector of a body, or of a section, that pointed along an axis at the start; None: its x axis.

    A cable has its slope only; any other axis is that of the start.
    """
    if not _is_rod(bodies, side.body):
        return _held(bodies, side.body, axis, at)
    if _is_cable(bodies, side.body):
        if axis is not None:
            return turns.unit(np.array(axis, dtype=float))
        return turns.unit(moving(bodies, bodies.placement.direction(bodies.scene, side), at).value)
    return _of_section(bodies, side, axis, at)


def _held(bodies: FreeBodies, body: str, axis: Any, at: Array) -> Array:
    """The unit vector of a rigid body or the ground that pointed along an axis at the start."""
    return moving(bodies, direction(_placement(bodies), body, axis), at).value


def _of_section(bodies: FreeBodies, side: Attachment, axis: Any, at: Array) -> Array:
    """The same of a section of a director rod."""
    placement = _placement(bodies)
    frame = bodies.placement.frames[side.body]
    assert isinstance(frame, BeamFrame)
    here = image(bodies.scene, placement.attitudes, side, axis)[:, 0]
    node = frame.node(bodies.scene.location(side))
    assert node is not None
    along, director = (turns.unit(vector.at(at)) for vector in frame.nodes[node][1:3])
    other = np.cross(along, director)
    y, z = (director, other) if frame.element.director == 1 else (-other, director)
    return np.asarray(here @ np.array([along, y, z]))


def _is_rod(bodies: FreeBodies, body: str) -> bool:
    return body != GROUND and isinstance(bodies.placement.frames[body], BeamFrame)


def _is_cable(bodies: FreeBodies, body: str) -> bool:
    frame = None if body == GROUND else bodies.placement.frames[body]
    return isinstance(frame, BeamFrame) and frame.element.director is None


def _placement(bodies: FreeBodies) -> SpatialPlacement:
    assert isinstance(bodies.placement, SpatialPlacement)
    return bodies.placement


def _across(axis: Array) -> Array:
    """Two unit vectors at right angles to an axis, (2, 3)."""
    return np.array([one[:, 0] for one in turns.across(turns.unit(axis)[:, None])])
