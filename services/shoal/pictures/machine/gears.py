"""Gears of the plane: wheels on their axles whose teeth mesh at all times; belts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.pictures.machine import shapes
from shoal.pictures.machine.marks import Marks
from shoal.pictures.machine.sheet import Part, Sheet
from shoal.scene import GROUND, Attachment, Revolute, Scene
from shoal.scene.joints import Gear
from shoal.trajectory import Array

_BELT = 0.5
"""Sum of the radii of two pulleys over the distance of their axles: a belt leaves it open."""


def gears(marks: Marks) -> Iterator[Part]:
    """Yield what draws the gears whose axles are seen: hinges between each body and the carrier."""
    for name, joint in marks.scene.joints.items():
        if isinstance(joint, Gear):
            ends = [axle(marks.scene, side.body, joint.carrier.body) for side in (joint.first, joint.second)]
            if all(end is not None and marks.is_rigid(end.body) for end in ends):
                yield _pair(marks, name, joint, [end for end in ends if end is not None])


def radii(ratio: float, apart: float, *, ring: bool) -> tuple[float, float]:
    """Return the pitch radii of two wheels [m] whose axles are so far apart; of a ring gear one holds the other."""
    size = abs(ratio)
    if ratio < 0:
        return apart * size / (1 + size), apart / (1 + size)
    if ring and size != 1.0:
        return apart * size / abs(1 - size), apart / abs(1 - size)
    return _BELT * apart * size / (1 + size), _BELT * apart / (1 + size)


def axle(scene: Scene, body: str, carrier: str) -> Attachment | None:
    """Return the place on a body of its hinge on the carrier."""
    for joint in scene.joints.values():
        if isinstance(joint, Revolute) and {joint.first.body, joint.second.body} == {body, carrier}:
            return joint.first if joint.first.body == body else joint.second
    return None


def _pair(marks: Marks, name: str, joint: Gear, ends: list[Attachment]) -> Part:
    frames, places = [marks.frame(end) for end in ends], [marks.point(end) for end in ends]
    ratio, moving = float(joint.ratio), joint.carrier.body != GROUND
    ring = moving and ratio > 0 and ratio != 1.0
    belt = ratio > 0 and not ring

    def draw(sheet: Sheet) -> None:
        one, other = (place(sheet.at, sheet.times)[0] for place in places)
        apart = float(np.linalg.norm(other - one))
        if apart < 2 * sheet.unit:
            return
        sizes = radii(ratio, apart, ring=ring)
        if belt:
            for size, frame in zip(sizes, frames, strict=True):
                sheet.carried(name, "gear", shapes.joined(shapes.circle(size, count=40)), frame)
            if not moving:
                sheet.add(name, "rope", _belt(one, other, sizes))
            return
        counts = shapes.teeth(joint.fraction.numerator.__abs__(), joint.fraction.denominator)
        across = float(np.arctan2(*(other - one)[::-1]))
        # The smaller wheel has a tooth where both touch, the other one a gap; ring gears touch on one side of both.
        small = int(sizes[1] < sizes[0])
        touch = [across, across + np.pi]
        if ring:
            touch = [across + np.pi * (sizes[1] > sizes[0])] * 2
        for k, (size, frame) in enumerate(zip(sizes, frames, strict=True)):
            count = None if counts is None else counts[k]
            axes = sheet.carrier(frame).axes[0]
            first = (
                touch[k]
                - float(np.arctan2(axes[0, 1], axes[0, 0]))
                + (0.0 if k == small or count is None else np.pi / count)
            )
            inside = ring and k != small
            lines = shapes.wheel(size, count, first, inside=inside)
            if inside:
                lines = shapes.joined(lines, shapes.circle(size + 1.5 * sheet.unit, count=48))
            sheet.carried(name, "ring" if inside else "gear", lines, frame)
            if not inside:
                sheet.carried(name, "spoke", _spokes(0.8 * size), frame)

    return draw


def _spokes(size: float) -> Array:
    """Return a cross that shows how a wheel turns."""
    return shapes.joined(np.array([(-size, 0), (size, 0)]), np.array([(0, -size), (0, size)]))


def _belt(one: Array, other: Array, sizes: tuple[float, float]) -> Array:
    """Return both tangents of two pulleys."""
    apart = other - one
    angle, lean = np.arctan2(apart[1], apart[0]), np.arccos((sizes[0] - sizes[1]) / np.linalg.norm(apart))
    ways = [np.array([np.cos(angle + s * lean), np.sin(angle + s * lean)]) for s in (1, -1)]
    return shapes.joined(*(np.stack([one + sizes[0] * way, other + sizes[1] * way]) for way in ways))
