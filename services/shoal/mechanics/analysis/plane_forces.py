"""The unknowns of joints in the plane, their friction, and the displacements of free bodies there."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.evaluate import points
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.analysis.joint_forces import Component, Rubbing, gap, moving, of_places
from shoal.mechanics.frames import BeamFrame, ModalFrame, RigidFrame
from shoal.mechanics.joints import Along, Condition, Geared, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Revolute, Slider

_NONE, _NO_TURN, _TURN = np.zeros(plane.DIMENSIONS), np.zeros(1), np.ones(1)


def components(bodies: FreeBodies, name: str, condition: Condition, at: Array) -> list[Component]:
    """The unknowns of a condition of a joint."""
    if isinstance(condition, Turned):
        return [Component(name, "torque", _turning(bodies, condition.first, condition.second, at), _NONE, _TURN)]
    if isinstance(condition, Geared):
        lines = [bodies.placement.direction(bodies.scene, side) for side in condition.sides]
        turning = np.array(condition.factors) @ points(lines, bodies.unknowns).turning(at)
        return [Component(name, "torque", turning, _NONE, _TURN * condition.factors[0])]
    if isinstance(condition, Along):
        assert not isinstance(condition.direction, tuple)
        e, _, across = _sliding(bodies, condition.first, condition.second, condition.direction, at)
        return [Component(name, "normal", across, plane.quarter(e), _NO_TURN)]
    return of_places(bodies, name, condition, at, _NO_TURN)


def rubbing(bodies: FreeBodies, joint: Revolute | Slider, at: Array) -> Rubbing:
    """What the friction of a joint acts on."""
    if isinstance(joint, Revolute):
        return Rubbing(_turning(bodies, joint.first, joint.second, at), _NONE, _TURN)
    line, gradient, _ = _sliding(bodies, joint.first, joint.second, joint.direction, at)
    return Rubbing(gradient, line, _NO_TURN)


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
            modes = frame.amplitudes if isinstance(frame, ModalFrame) else ()
            row = np.zeros(bodies.unknowns)
            for vector in (frame.directors[0], *modes):
                row[list(vector.own or ())] = plane.quarter(vector.at(at)) / lever
            rows.append(row)
            e = frame.directors[0].at(at) / lever
            for vector in modes:
                add(vector, e)
            stretching = frame.modes.along if isinstance(frame, ModalFrame) else 0
            if stretching:
                add(frame.directors[0], e)
            for vector in modes[: max(stretching - 1, 0)]:
                add(vector, plane.quarter(e))
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
