"""Unknown forces of joints on free bodies, their friction, and the displacements whose work has to vanish.

A condition of a joint says which unit forces and torques it can exert (`joints`: pushes, twists); none of them does
work in a motion that the condition permits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics import joints, plane
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.free_motion import FreeMotion
from shoal.mechanics.assembly.phases import free_motion
from shoal.mechanics.frames import BeamFrame, Frame, ModalFrame, PointFrame
from shoal.mechanics.numerics.tile import Array, Index
from shoal.mechanics.rope_path import tangents
from shoal.mechanics.ropes import Reeved
from shoal.mechanics.sums import BodyAngle, Measured, Sum, angle_sides, axis_of_angle, coordinate, ends, line_of
from shoal.scene import Revolute, Slider
from shoal.scene.formula import Measure
from shoal.scene.joints import Z


class Component(NamedTuple):
    """One unknown of a joint per unit [N or N m], at every sample.

    gradient: its work per displacement of the free bodies, (samples, unknowns); force, torque: on the second body,
    (samples, d) and (samples, 1 or in space 3)
    """

    joint: str
    name: str
    gradient: Array
    force: Array
    torque: Array

    @property
    def turns(self) -> bool:
        """Return whether it is a torque alone."""
        return bool(np.any(self.torque) and not np.any(self.force))

    def times(self, factor: Array) -> Component:
        """Return it scaled at every sample, (samples,)."""
        scaled = (factor[:, None] * part for part in (self.gradient, self.force, self.torque))
        return Component(self.joint, self.name, *scaled)


def components(motion: FreeMotion) -> list[Component]:
    """Return the unknowns of all joints, in the order of the scene."""
    return [part for name, one in joints.of_scene(motion.scene) for part in of_condition(motion, name, one)]


def of_condition(motion: FreeMotion, name: str, condition: Any) -> Iterator[Component]:
    """Yield the unknowns of one condition of a joint."""
    if isinstance(condition, Sum):
        yield _summed(motion, name, condition)
    elif isinstance(condition, Reeved):
        yield from (tension(motion, name, condition, k) for k in range(len(condition.parts)) if condition.holds)
    else:
        pushes = condition.pushes(motion)
        twists = _resisted(motion, condition, condition.twists(motion))
        for label in pushes | twists:
            yield pair(motion, name, label, condition, pushes.get(label), twists.get(label))


def pair(
    motion: FreeMotion, joint: str, label: str, sides: Any, force: Array | None, torque: Array | None
) -> Component:
    """Return a force at the second place and a torque on the second body, and their opposites on the first.

    sides: a condition or a joint between two places
    """
    samples = len(motion.at)
    gradient = np.zeros((samples, motion.bodies.unknowns))
    if force is not None:
        gradient = gradient + _along(force, motion.sliding(sides))
    if torque is not None:
        gradient = gradient + _along(torque, motion.turning(sides))
    none, no_turn = np.zeros((samples, motion.dimensions)), np.zeros((samples, motion.turn_axes))
    return Component(joint, label, gradient, none if force is None else force, no_turn if torque is None else torque)


def _along(vector: Array, slope: Array) -> Array:
    """Return the part of derivatives (samples or 1, d, unknowns) along a vector (samples, d), (samples, unknowns)."""
    return np.asarray((vector[:, None] @ slope)[:, 0])


def _resisted(motion: FreeMotion, condition: Any, twists: Mapping[str, Array]) -> Mapping[str, Array]:
    """Return those torques that do not turn a cable about its own axis, which resists none."""
    cables = [side for side in (condition.first, condition.second) if motion.is_cable(side.body)] if twists else []
    if not cables:
        return twists
    axes = np.stack(list(twists.values()), axis=1)  # (samples, twists, 3)
    for side in cables:
        along = np.einsum("nkd,nd->nk", axes, motion.slope_of(side))
        _, sizes, right = np.linalg.svd(along[:, None])
        axes = right[:, int(np.any(sizes > 1e-9)) :] @ axes
    count = axes.shape[1]
    return {("mx", "my", "mz")[k] if count == 3 else f"m{k + 1}": axes[:, k] for k in range(count)}


def _summed(motion: FreeMotion, joint: str, condition: Sum) -> Component:
    """Return forces along measures, and torques about the axes of angles, in proportion to their factors."""
    units = [_measured(motion, joint, condition.unit, one).times(factor * np.ones(len(motion.at)))
             for factor, one in condition.parts]  # fmt: skip
    return units[0]._replace(gradient=np.sum([one.gradient for one in units], axis=0))


def _measured(motion: FreeMotion, joint: str, label: str, one: Measured) -> Component:
    """Return a unit force along a measure."""
    scene, none = motion.scene, np.zeros((len(motion.at), motion.dimensions))
    no_turn = np.zeros((len(motion.at), motion.turn_axes))
    if isinstance(one, BodyAngle):
        torque = motion.about(one.side, one.axis)
        return Component(joint, label, _along(torque, motion.turn(one.side)), none, torque)
    kind = one.kind if isinstance(one, Measure) else "position"
    if kind == "position":
        side, axis = coordinate(scene, one)
        slope = motion.slope(motion.placement.point(scene, side))[axis]
        return Component(joint, label, np.broadcast_to(slope, (len(none), len(slope))), motion.axes[axis], no_turn)
    if kind == "distance":
        first, second = (motion.placement.point(scene, end) for end in ends(scene, one))
        way = motion.value(second - first)
        unit = way / np.linalg.norm(way, axis=1, keepdims=True)
        return Component(joint, label, unit @ motion.slope(second - first), unit, no_turn)
    if kind == "slide":
        tie, along = line_of(scene, one)
        return pair(motion, joint, label, tie, motion.line(tie.first, along), None)
    assert isinstance(one, Measure)
    sides, is_plane = angle_sides(scene, one), motion.turn_axes == 1
    torque = motion.turns["torque"] if is_plane else motion.common_axis(*sides, axis_of_angle(scene, one))
    return Component(joint, label, _along(torque, motion.turn(sides[1]) - motion.turn(sides[0])), none, torque)


def tension(motion: FreeMotion, joint: str, condition: Reeved, number: int) -> Component:
    """Return the tension of a part of a rope: what pulls the place at its end towards the span before it."""
    part, placement = condition.parts[number], motion.placement
    centres = np.stack([motion.place(at) for at in part.places], axis=1)
    if motion.dimensions == plane.DIMENSIONS:
        along, _ = tangents(centres, [float(np.max(at.signed_radius)) for at in part.places])
    else:
        way = np.diff(centres, axis=1)
        along = way / np.linalg.norm(way, axis=2, keepdims=True)
    gradient = np.zeros((len(centres), motion.bodies.unknowns))
    for k, (one, other, _) in enumerate(part.spans):
        way = motion.slope(placement.point(motion.scene, other) - placement.point(motion.scene, one))
        gradient -= along[:, k] @ way
    torque = np.zeros((len(centres), motion.turn_axes))
    for drum, factor in part.drums:
        about = motion.about(drum, Z)
        gradient -= factor * _along(about, motion.turn(drum))
        if drum is part.places[-1]:
            torque = -factor * about
    label = "tension" + str(number + 1) * (len(condition.parts) > 1)
    return Component(joint, label, gradient, -along[:, -1], torque)


def rotors(motion: FreeMotion, change: Array) -> Array:
    """Return the generalised forces of rotors: armature times the acceleration of the free motion, against that.

    change: accelerations of the free bodies, as the result (samples, unknowns)
    """
    total = np.zeros_like(change)
    for name, joint in motion.scene.joints.items():
        if not isinstance(joint, Revolute | Slider) or not joint.armature:
            continue
        if isinstance(joint, Slider):
            along = joint.direction if joint.axis is None else joint.axis
            unit = pair(motion, name, "rotor", joint, motion.line(joint.first, along), None)
        else:
            unit = pair(motion, name, "rotor", joint, None, motion.pin(joint))
        products = free_motion(motion.scene, joint, motion.placement)
        (x, *y), (xdd, *ydd) = ([_derivative(motion, change, *one, order) for one in products] for order in (0, 2))
        acceleration = x * ydd[0] - y[0] * xdd if y else xdd
        total -= unit.gradient * (joint.armature * acceleration)[:, None]
    return total


def _derivative(motion: FreeMotion, change: Array, one: Affine, other: Affine, order: int) -> Array:
    """Return a scalar product of vectors, or its second derivative by time, (samples,)."""
    p, q = motion.value(one), motion.value(other)
    if order == 0:
        return np.asarray(np.sum(p * q, axis=1))
    (pd, qd), (pdd, qdd) = ([_rate(vector, x) for vector in (one, other)] for x in (motion.rate, change))
    return np.asarray(np.sum(pdd * q + 2.0 * pd * qd + p * qdd, axis=1))


def _rate(vector: Affine, x: Array) -> Array:
    """Return the linear part of a vector at rates or accelerations (samples, unknowns), (samples, d)."""
    unknowns, coefficients, _ = vector.by_lane
    return np.asarray(x[:, unknowns] @ coefficients[0])


def friction(motion: FreeMotion, held: Mapping[str, Array]) -> dict[str, Component]:
    """Return the friction of every joint that resists. held: the force [N] of those whose friction depends on it."""
    found = {}
    for name, joint in motion.scene.joints.items():
        if not isinstance(joint, Revolute | Slider) or not joint.resists:
            continue
        if isinstance(joint, Slider):
            along = joint.direction if joint.axis is None else joint.axis
            unit = pair(motion, name, "friction", joint, motion.line(joint.first, along), None)
        else:
            unit = pair(motion, name, "friction", joint, None, motion.pin(joint))
        rate = np.einsum("nu,nu->n", unit.gradient, motion.rate)
        found[name] = unit.times(-joint.resistance(rate, held.get(name, 0.0)))
    return found


class Displacements(NamedTuple):
    """Displacements of one free body whose work must vanish, each of a few unknowns.

    unknowns: those of all displacements, one after the other, (entries,); values: of them, (samples, entries); first:
    entry at which each displacement begins, (displacements,)
    """

    unknowns: Index
    values: Array
    first: Index

    def work(self, force: Array) -> Array:
        """Return the work of generalised forces, (samples, unknowns of all), in each displacement."""
        return np.add.reduceat(self.values * force[:, self.unknowns], self.first, axis=1)


def displacements(motion: FreeMotion, lever: float) -> list[Displacements]:
    """Return the displacements of all free bodies; turns are counted as ways at a lever [m]."""
    return [_of_body(motion, frame, lever) for frame in motion.placement.frames.values()]


def work(moves: list[Displacements], force: Array) -> Array:
    """Return the work of generalised forces (samples, unknowns) in all displacements, (samples, displacements)."""
    return np.concatenate([one.work(force) for one in moves], axis=1)


def _of_body(motion: FreeMotion, frame: Frame, lever: float) -> Displacements:
    unknowns: list[int] = []
    parts: list[Array] = []
    first: list[int] = []

    def add(*moves: tuple[Affine, Array]) -> None:
        first.append(len(unknowns))
        for vector, value in moves:
            unknowns.extend(vector.own or ())
            parts.append(np.broadcast_to(value, (len(motion.at), motion.dimensions)))

    axes = np.eye(motion.dimensions)
    if isinstance(frame, PointFrame):
        _translate(add, frame.origin, axes)
    elif isinstance(frame, BeamFrame):
        for node in frame.nodes:
            _translate(add, node[0], axes)
            if motion.turn_axes == 1 or frame.element.director is None:
                for k, vector in enumerate(node[1:], 1):
                    _translate(add, vector, axes * lever ** -float(k))
            else:
                values = [(vector, motion.value(vector)) for vector in node[1:]]
                add((values[0][0], values[0][1] / lever))
                for axis in axes:
                    add(*((vector, np.cross(axis, value) / lever) for vector, value in values))
    elif motion.turn_axes == 1:
        _translate(add, frame.origin, axes)
        _turn_in_plane(motion, frame, lever, add)
    else:
        _translate(add, frame.origin, axes)
        for axis in axes:
            add(*((one, np.cross(axis, motion.value(one)) / lever) for one in frame.directors))
    return Displacements(np.array(unknowns), np.concatenate(parts, axis=1), np.array(first))


def _translate(add: Any, vector: Affine, axes: Array) -> None:
    for axis in axes:
        add((vector, axis))


def _turn_in_plane(motion: FreeMotion, frame: Any, lever: float, add: Any) -> None:
    """Add the turn of a rigid or modal body, and the bending and stretching of the latter."""
    modes = frame.amplitudes if isinstance(frame, ModalFrame) else ()
    quarter = plane.QUARTER.T
    add(*((one, motion.value(one) @ quarter / lever) for one in (frame.directors[0], *modes)))
    e = motion.value(frame.directors[0]) / lever
    for vector in modes:
        add((vector, e))
    stretching = frame.modes.along if isinstance(frame, ModalFrame) else 0
    if stretching:
        add((frame.directors[0], e))
    for vector in modes[: max(stretching - 1, 0)]:
        add((vector, e @ quarter))
