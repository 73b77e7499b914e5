"""The unknowns of joints on free bodies: what the forces of a plane and of space have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis.evaluate import points
from shoal.mechanics.analysis.free_bodies import FreeBodies
from shoal.mechanics.joints import Apart, Meet, Sum, unknown
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Revolute, Slider


class Component(NamedTuple):
    """One unknown of a joint: its work per displacement of the free bodies, (unknowns,).

    force [N], torque [N m]: what it is per unit, (d,) and (1,) or in space (3,).
    """

    joint: str
    name: str
    gradient: Array
    force: Array
    torque: Array

    @property
    def turns(self) -> bool:
        """Whether it is a torque."""
        return bool(np.any(self.torque))


class Rubbing(NamedTuple):
    """What the friction of a joint acts on: the derivative of its slip, (unknowns,), and force and torque per unit."""

    gradient: Array
    force: Array
    torque: Array


Friction = tuple[Array, dict[str, tuple[Array, Array]]]
"""Generalised force of all joint friction, (unknowns,), and force and torque of each joint's on its second body."""


def friction(
    bodies: FreeBodies,
    at: Array,
    rate: Array,
    rubbing: Callable[[FreeBodies, Revolute | Slider, Array], Rubbing],
    held: Mapping[str, float],
) -> Friction:
    """Of all joints. held: the force of those [N] whose friction depends on it."""
    total = np.zeros(bodies.unknowns)
    each: dict[str, tuple[Array, Array]] = {}
    for name, joint in bodies.scene.joints.items():
        if isinstance(joint, Revolute | Slider) and joint.resists:
            gradient, force, torque = rubbing(bodies, joint, at)
            against = -float(joint.resistance(gradient @ rate, held.get(name, 0.0)))
            total += against * gradient
            each[name] = against * force, against * torque
    return total, each


class Moving(NamedTuple):
    """A vector of the free bodies and its derivative: (d,) and (d, unknowns)."""

    value: Array
    slope: Array


def moving(bodies: FreeBodies, vector: Affine, at: Array) -> Moving:
    """A vector at the coordinates of the free bodies."""
    found = points([vector], bodies.unknowns)
    return Moving(found.at(at)[0], found.matrix[0])


def place(bodies: FreeBodies, side: Attachment, at: Array) -> Moving:
    """The place of an attachment."""
    return moving(bodies, bodies.placement.point(bodies.scene, side), at)


def gap(bodies: FreeBodies, condition: Any, at: Array) -> Moving:
    """The way from the first place of a condition to the second."""
    return moving(bodies, bodies.placement.gap(bodies.scene, condition), at)


def of_places(bodies: FreeBodies, name: str, condition: Any, at: Array, torque: Array) -> list[Component]:
    """Of conditions that know no direction: forces only; torque: none."""
    if isinstance(condition, Sum):
        axes = ["xyz".index(term.axis) for term in condition.terms]
        rows = [place(bodies, term.at, at).slope[axis] for term, axis in zip(condition.terms, axes, strict=True)]
        gradient = sum(term.factor * row for term, row in zip(condition.terms, rows, strict=True))
        force = condition.terms[0].factor * np.eye(bodies.scene.dimensions)[axes[0]]
        return [Component(name, "coupled", np.asarray(gradient), force, torque)]
    if not isinstance(condition, Meet | Apart):
        raise unknown(condition)
    between = gap(bodies, condition, at)
    if isinstance(condition, Apart):
        length = np.linalg.norm(between.value)
        along = between.value / length if length > 0 else np.eye(len(between.value))[0]
        return [Component(name, "axial", along @ between.slope, along, torque)]
    return [
        Component(name, f"f{axis}", slope, unit, torque)
        for axis, slope, unit in zip("xyz", between.slope, np.eye(len(between.value)), strict=False)
    ]
