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
from shoal.mechanics.joints import Geared, Sum, Transmitted
from shoal.mechanics.numerics.tile import Array, Index
from shoal.scene import Revolute, Slider


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
    if isinstance(condition, Geared):
        yield _geared(motion, name, condition)
    elif isinstance(condition, Transmitted):
        yield _transmitted(motion, name, condition)
    elif isinstance(condition, Sum):
        yield _coupled(motion, name, condition)
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


def _geared(motion: FreeMotion, joint: str, condition: Geared) -> Component:
    """Return torques in proportion to the teeth."""
    gradient = np.zeros((len(motion.at), motion.bodies.unknowns))
    torques = []
    for side, axis, factor in zip(condition.sides, condition.axes, condition.factors, strict=True):
        torques.append(factor * motion.about(side, axis))
        gradient += _along(torques[-1], motion.turn(side))
    return Component(joint, "torque", gradient, np.zeros((len(motion.at), motion.dimensions)), torques[0])


def _transmitted(motion: FreeMotion, joint: str, condition: Transmitted) -> Component:
    """Return torques about hinges and forces along sliders in proportion to their factors."""
    units = []
    for share in condition.shares:
        one = motion.scene.joints[share.joint]
        if isinstance(one, Slider):
            along = one.direction if one.axis is None else one.axis
            unit = pair(motion, joint, "transmitted", one, motion.line(one.first, along), None)
        else:
            assert isinstance(one, Revolute)
            unit = pair(motion, joint, "transmitted", one, None, motion.pin(one))
        units.append(unit.times(np.full(len(motion.at), share.factor)))
    gradient = np.sum([one.gradient for one in units], axis=0)
    return Component(joint, "transmitted", gradient, units[0].force, units[0].torque)


def _coupled(motion: FreeMotion, joint: str, condition: Sum) -> Component:
    """Return forces along coordinates in proportion to their factors."""
    axes = ["xyz".index(term.axis) for term in condition.terms]
    slopes = [motion.slope(motion.placement.point(motion.scene, term.at)) for term in condition.terms]
    row = sum(term.factor * slope[k] for term, slope, k in zip(condition.terms, slopes, axes, strict=True))
    force = condition.terms[0].factor * motion.axes[axes[0]]
    gradient = np.broadcast_to(row, (len(force), motion.bodies.unknowns))
    return Component(joint, "coupled", gradient, force, np.zeros((len(force), motion.turn_axes)))


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
