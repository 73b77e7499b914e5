"""Couplings: weighted sums of measures (angles, slides, distances, coordinates) that are constant or driven.

Gears, racks, screws, drums and differentials are such sums. Angles are those of unit vectors, known but for whole turns
of their sum: where all factors are whole multiples of one number, multiples of that times a full turn make no
difference, as of teeth that mesh. Else every angle has an unknown of its own, which counts its turns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.conditions import JointCondition
from shoal.mechanics.numerics.tile import Number
from shoal.scene import Function
from shoal.scene.formula import Measure
from shoal.scene.joints import GROUND, MOST_TEETH, Attachment, CoupledMeasure, Coupling, Slider
from shoal.scene.record import Vector3
from shoal.scene.signals import joint_of, place

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class BodyAngle:
    """The angle of a body at a place, in space about an axis at rest, which is stated as it points at the start."""

    side: Attachment
    axis: Vector3


Measured = BodyAngle | Measure | tuple[Attachment, int]
"""What a sum counts: the angle of a body, a measure of a scene by names, or a coordinate of a place."""


@dataclass(frozen=True)
class Sum(JointCondition):
    """The sum of factor * measure follows a function of time, or stays what it is at the start (value None).

    unit: name of the force that keeps it
    """

    parts: tuple[tuple[Number, Measured], ...]
    value: Function | None
    unit: str = "coupled"

    @property
    def is_of_start(self) -> bool:
        """Return whether the sum is that of the start."""
        return self.value is None

    @property
    def scale(self) -> Number:
        """Return what backlash is counted in: the angle of the second gear, or the sum of a coupling."""
        return self.parts[0][0] if isinstance(self.parts[0][1], BodyAngle) else 1.0

    def is_angle(self, scene: Any) -> bool:
        """Return whether it is a sum of angles alone [rad]."""
        return all(_kind(one) == "angle" for factor, one in self.parts if np.any(factor))

    def turned(self, scene: Any) -> Iterator[Attachment]:
        """Yield the places of whose directions it counts angles."""
        for _, one in self.parts:
            if isinstance(one, BodyAngle):
                yield one.side
            elif _kind(one) == "angle":
                yield from angle_sides(scene, one)

    def constrain(self, name: str, bodies: Any) -> None:
        """Require the sum; separate bodies in space, whose turns are not counted, start as they do."""
        first = fixed(np.eye(bodies.scene.dimensions)[0][:, None])
        total, pairs, roots = fixed(0.0 * first.constant), [], []
        angles: list[tuple[Number, Affine]] = []
        for factor, one in self.parts:
            if not np.any(factor):
                continue
            if isinstance(one, BodyAngle):
                angles += [(factor, bodies.angle(name, one.side, one.axis))] if one.side.body != GROUND else []
            elif _kind(one) == "angle":
                found = bodies.joint_angle(name, one)
                if found is None:
                    return
                angles += [(factor * sign, vector) for sign, vector in found]
            elif _kind(one) == "slide":
                line, way = slide_of(bodies, one)
                pairs.append((line * factor, way))
            elif _kind(one) == "distance":
                gap = _gap(bodies, one)
                span = bodies.span(name, gap, 0.0)
                if span is None:
                    roots.append((factor, gap, 0.0))
                else:
                    total = total + span[0] * factor
            else:
                side, axis = coordinate(bodies.scene, one)
                onto_first = np.outer(first.constant, np.eye(len(first.constant))[axis])
                total = total + bodies.point(bodies.scene, side).turned(onto_first) * factor
        period = period_of([factor for factor, _ in angles])
        if period is None:
            for factor, vector in angles:
                total = total + bodies.count(name, vector) * factor
            angles, period = [], 1.0
        if not (total.terms or np.any(total.constant) or pairs or angles or roots):
            return
        bodies.terms.sum(
            name,
            [(first, total), *pairs],
            angles=angles,
            period=period,
            roots=roots,
            lengths=0 if self.is_angle(bodies.scene) else 1,
            drive=None if self.value is None else self.value.through("neg"),
            of_start=self.value is None,
        )


def _kind(one: Measured) -> str:
    if isinstance(one, BodyAngle):
        return "angle"
    return one.kind if isinstance(one, Measure) else "position"


def parts_of(terms: Sequence[CoupledMeasure]) -> tuple[tuple[Number, Measured], ...]:
    """Return what the terms of a coupling count, with their factors."""
    return tuple((one.factor, one.measure or (one.at, "xyz".index(one.axis))) for one in terms)  # type: ignore[arg-type, misc]


def coordinate(scene: Any, one: Measured) -> tuple[Attachment, int]:
    """Return the place and the axis of a coordinate."""
    if isinstance(one, Measure):
        return place(scene, one.names[0]), "xyz".index(one.names[1])
    assert isinstance(one, tuple)
    return one


def ends(scene: Any, one: Measured) -> tuple[Attachment, Attachment]:
    """Return the places of a distance."""
    assert isinstance(one, Measure)
    first, second = (place(scene, name) for name in one.names)
    return first, second


def angle_sides(scene: Any, one: Measured) -> tuple[Attachment, Attachment]:
    """Return the sides of the angle of a joint, or of a body against the ground."""
    assert isinstance(one, Measure)
    joint = joint_of(scene, one)
    if joint is None:
        return Attachment(body=GROUND, point=(0.0,) * scene.dimensions), Attachment(body=one.names[0])
    return joint.first, joint.second


def place_of_force(scene: Any, joint: Any) -> Attachment:
    """Return the place at which the force of a joint acts: its second, of a coupling that of its first measure."""
    if not isinstance(joint, Coupling):
        return joint.second  # type: ignore[no-any-return]
    (_, one), *_ = parts_of(joint.terms)
    if _kind(one) == "position":
        return coordinate(scene, one)[0]
    if _kind(one) == "distance":
        return ends(scene, one)[1]
    second: Attachment = line_of(scene, one)[0].second if _kind(one) == "slide" else angle_sides(scene, one)[1]
    return second


def axis_of_angle(scene: Any, one: Measure) -> Any:
    """Return the axis of an angle, which points so at the start; None of a body of the plane."""
    return getattr(joint_of(scene, one), "axis", None)


def line_of(scene: Any, one: Measured) -> tuple[Any, Any]:
    """Return the joint of a slide, and the direction of its line."""
    assert isinstance(one, Measure)
    joint = joint_of(scene, one)
    return joint, joint.direction if isinstance(joint, Slider) and joint.axis is None else joint.axis


def slide_of(bodies: Any, one: Measured) -> tuple[Affine, Affine]:
    """Return the line of a slide and the way whose scalar product is its place [m]."""
    joint, along = line_of(bodies.scene, one)
    return bodies.line(joint.first, along), bodies.gap(bodies.scene, joint)


def _gap(bodies: Any, one: Measured) -> Affine:
    first, second = ends(bodies.scene, one)
    way: Affine = bodies.point(bodies.scene, second) - bodies.point(bodies.scene, first)
    return way


def period_of(factors: Sequence[Number]) -> float | None:
    """Return the least sum of factors times whole turns [rad]; None where they are not of whole teeth, or vary."""
    if not factors:
        return 1.0
    if len(factors) == 1 and np.ndim(factors[0]) == 0:
        return TURN * abs(float(factors[0]))
    if any(np.ndim(one) for one in factors):
        return None
    first = float(factors[0])
    ratios = [Fraction(float(one) / first).limit_denominator(MOST_TEETH) for one in factors]
    for ratio, factor in zip(ratios, factors, strict=True):
        if abs(float(ratio) * first - factor) > 1e-12 * abs(factor) or abs(ratio.numerator) > MOST_TEETH:
            return None
    return TURN * abs(first) / math.lcm(*(one.denominator for one in ratios))
