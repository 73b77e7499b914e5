"""The unknowns of joints in the plane, their friction, and the displacements of free bodies there."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.evaluate import points
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_forces import Component, Friction, gap, moving, of_places
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.joints import Along, Condition, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Revolute, Slider

_NONE, _NO_TURN, _TURN = np.zeros(plane.DIMENSIONS), np.zeros(1), np.ones(1)


def components(bodies: FreeBodies, name: str, condition: Condition, at: Array) -> list[Component]:
    """The unknowns of a condition of a joint."""
    if isinstance(condition, Turned):
        return [Component(name, "torque", _turning(bodies, condition.first, condition.second, at), _NONE, _TURN)]
    if isinstance(condition, Along):
        assert not isinstance(condition.direction, tuple)
        e, _, across = _sliding(bodies, condition.first, condition.second, condition.direction, at)
        return [Component(name, "normal", across, plane.quarter(e), _NO_TURN)]
    return of_places(bodies, name, condition, at, _NO_TURN)


def friction(bodies: FreeBodies, at: Array, rate: Array) -> Friction:
    """Of all joints."""
    total = np.zeros(bodies.unknowns)
    each: dict[str, tuple[Array, Array]] = {}
    for name, joint in bodies.scene.joints.items():
        if not (isinstance(joint, Revolute | Slider) and (joint.friction or joint.coulomb)):
            continue
        if isinstance(joint, Revolute):
            line, gradient = _NONE, _turning(bodies, joint.first, joint.second, at)
        else:
            line, gradient, _ = _sliding(bodies, joint.first, joint.second, joint.direction, at)
        speed = float(gradient @ rate)
        drag = -joint.friction * speed - joint.coulomb * float(np.tanh(speed / joint.coulomb_speed))
        total += drag * gradient
        each[name] = (line * drag, _NO_TURN if np.any(line) else drag * _TURN)
    return total, each


def displacements(bodies: FreeBodies, at: Array, lever: float) -> Array:
    """Displacements of the free bodies whose work must vanish, (displacements, unknowns)."""
    rows = []

    def add(vector: Affine, value: Array) -> None:
        row = np.zeros(bodies.unknowns)
        row[list(vector.own or ())] = value
        rows.append(row)

    axes = np.eye(plane.DIMENSIONS)
    for frame in bodies.placement.frames.values():
        order = len(frame.nodes[0]) if isinstance(frame, BeamFrame) else 1
        free = frame.vectors[:1] if isinstance(frame, RigidFrame) else frame.vectors
        for k, vector in enumerate(free):
            for axis in axes:
                add(vector, axis * lever ** -float(k % order))
        if isinstance(frame, RigidFrame):
            add(frame.directors[0], plane.quarter(frame.directors[0].at(at)) / lever)
    return np.array(rows)


def _turning(bodies: FreeBodies, first: Attachment, second: Attachment, at: Array) -> Array:
    """d(angle of second - angle of first)."""
    lines = [bodies.placement.direction(bodies.scene, side) for side in (first, second)]
    one, other = points(lines, bodies.unknowns).turning(at)
    return np.asarray(other - one)


def _sliding(bodies: FreeBodies, first: Attachment, second: Attachment, turn: float, at: Array) -> tuple[Array, ...]:
    """Unit vector of a slider's line, and the derivatives of the place along and across it [m]."""
    direction = bodies.placement.direction(bodies.scene, first).turned(plane.rotation(turn))
    line, way = moving(bodies, direction, at), gap(bodies, Along(first, second, turn), at)
    size = np.hypot(*line.value)
    e = line.value / size
    # The line is a direction only: its length does no work, only its turn does.
    turning = plane.cross(line.value, line.slope) / size**2
    along = e @ way.slope + plane.cross(e, way.value) * turning
    across = plane.cross(e, way.slope) - (e @ way.value) * turning
    return e, along, across
