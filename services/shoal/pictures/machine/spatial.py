"""Joints of machines in space: hinges, balls, guides with their blocks, and the ground that holds them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from shoal.pictures.machine import faces, shapes
from shoal.pictures.machine.drawing import Carrier
from shoal.pictures.machine.marks import STILL, Marks
from shoal.pictures.machine.sheet import Part, Sheet
from shoal.scene import GROUND, Attachment, PointMass, Revolute, Rod, Slider
from shoal.scene.contacts import ContactSurface
from shoal.scene.joints import Cylindrical, Distance, Planar, Spherical, Universal, Weld
from shoal.trajectory import Array

_HINGE, _BALL, _BLOCK = (0.62, 1.1), 0.75, (2.8, 1.8, 1.8)
"""Radius and half the length of a hinge, radius of a ball, sides of a block [units]."""


def joints(marks: Marks) -> Iterator[Part]:
    """Yield what draws the joints of a scene in space."""
    scene, standing = marks.scene, set[tuple[float, ...]]()
    for name, joint in scene.joints.items():
        sides = [side for side in (getattr(joint, "first", None), getattr(joint, "second", None)) if side is not None]
        for side in sides if isinstance(joint, Revolute | Spherical | Universal | Cylindrical | Distance) else []:
            if is_fixed(side) and scene.location(side) not in standing:
                standing.add(scene.location(side))
                yield _foot(name, np.array(scene.location(side), dtype=float))
        if isinstance(joint, Revolute | Cylindrical):
            yield _hinge(marks, name, joint)
        elif isinstance(joint, Spherical):
            yield _on(marks, name, "solid", _carrying(marks, joint), _ball(thickness(marks, joint)))
        elif isinstance(joint, Universal):
            for side, axis in ((joint.first, joint.axis), (joint.second, joint.second_axis)):
                yield _along(marks, name, "solid", side, axis, lambda u: faces.cylinder(0.4 * u, -1.3 * u, 1.3 * u))
        elif isinstance(joint, Weld):
            yield from _weld(marks, name, joint)
        elif isinstance(joint, Planar):
            yield _along(marks, name, "guide", joint.first, joint.axis, lambda u: faces.plate(4 * u, 0.0, 2 * u))
        elif isinstance(joint, Slider):
            yield _guide(marks, name, joint)


def masses(marks: Marks) -> Iterator[Part]:
    """Yield what draws the point masses that no contact gives a radius."""
    touching = {side.body for contact in marks.scene.contacts.values() for side in (contact.first, contact.second)}
    for name, body in marks.scene.bodies.items():
        if isinstance(body, PointMass) and name not in touching:
            yield _on(marks, name, "ball", Attachment(body=name), faces.ball)


def surfaces(marks: Marks) -> Iterator[Part]:
    """Yield what draws the balls, discs and planes of contacts."""
    for name, contact in marks.scene.contacts.items():
        for field, side, other in (("first", contact.first, contact.second), ("second", contact.second, contact.first)):
            part = f"{name} {field}"
            if side.plane is not None:
                yield _floor(marks, part, side, other)
            elif side.axis is not None:
                yield _along(marks, part, "solid", side, side.axis, _disc(float(side.radius)))
            elif np.any(side.radius):
                yield _on(marks, part, "solid", side, _sphere(float(side.radius)))


def is_fixed(side: Attachment) -> bool:
    """Return whether a place stands still."""
    return side.body == GROUND and not isinstance(side.point, str)


def local(carrier: Carrier, axis: Any) -> Array:
    """Return a direction of the start in the axes of a carrier, (3,)."""
    way = np.array(axis, dtype=float)
    return np.asarray(carrier.axes[0] @ (way / np.linalg.norm(way)))


def _carrying(marks: Marks, joint: Any) -> Attachment:
    """Return the side whose body has axes, the first one if both have."""
    return joint.first if marks.is_rigid(joint.first.body) else joint.second  # type: ignore[no-any-return]


def _on(marks: Marks, name: str, look: str, side: Attachment, shape: Callable[[float], Array]) -> Part:
    carried = marks.frame(side)
    return lambda sheet: sheet.carried(name, look, shape(sheet.unit), carried)


def _along(marks: Marks, name: str, look: str, side: Attachment, axis: Any, shape: Callable[[float], Array]) -> Part:
    """Return a shape about an axis of a body, which is known as it points at the start."""
    carried = marks.frame(side)

    def draw(sheet: Sheet) -> None:
        lines = faces.about(shape(sheet.unit), local(sheet.carrier(carried), axis))
        sheet.carried(name, look, lines, carried)

    return draw


def _foot(name: str, place: Array) -> Part:
    def draw(sheet: Sheet) -> None:
        solid, ground = (faces.about(one, -sheet.down) for one in faces.pyramid(sheet.unit))
        sheet.add(name, "foot", solid, at=place)
        sheet.add(name, "hatch", ground, at=place)

    return draw


def _hinge(marks: Marks, name: str, joint: Revolute | Cylindrical) -> Part:
    thick, size = thickness(marks, joint), 2.0 if isinstance(joint, Cylindrical) else 1.0

    def shape(u: float) -> Array:
        # Seen beside the rods that it joins.
        radius, half = max(_HINGE[0] * u, 0.45 * thick), size * max(_HINGE[1] * u, 0.7 * thick)
        return faces.cylinder(radius, -half, half)

    return _along(marks, name, "solid", _carrying(marks, joint), joint.axis, shape)


def _weld(marks: Marks, name: str, joint: Weld) -> Iterator[Part]:
    """Yield the ground that clamps a body, below it; a cube between two bodies."""
    first, second = joint.first, joint.second
    if not (is_fixed(first) or is_fixed(second)):
        yield _on(marks, name, "solid", _carrying(marks, joint), lambda u: faces.block((1.1 * u,) * 3))
        return
    fixed, moving = (first, second) if is_fixed(first) else (second, first)
    place, carried = np.array(marks.scene.location(fixed), dtype=float), marks.frame(moving)

    def draw(sheet: Sheet) -> None:
        way = sheet.carrier(carried).axes[0, 0]
        sheet.add(name, "hatch", faces.about(faces.plate(1.9 * sheet.unit, 0.0, sheet.unit), way), at=place)

    yield draw


def _guide(marks: Marks, name: str, joint: Slider) -> Part:
    """Return rails as long as the travel, hatched where the ground carries them, and the block between them."""
    frame, second = marks.frame(joint.first), marks.point(joint.second)

    def draw(sheet: Sheet) -> None:
        u, (by, place, _) = sheet.unit, frame
        carrier = sheet.carrier(frame)
        own = np.array([np.cos(joint.direction), np.sin(joint.direction), 0.0])
        way = own if joint.axis is None else local(carrier, joint.axis)
        places = second(sheet.at, sheet.times)
        travel = np.einsum("fd,fkd,k->f", places - carrier.moved(place[None])[:, 0], carrier.axes, way)
        room = (_BLOCK[0] / 2 + 0.8) * u
        start, end = float(np.nanmin(travel)) - room, float(np.nanmax(travel)) + room
        # The rails lie below the block, as far as the axis allows.
        below = carrier.axes[0] @ sheet.down
        below = below - way * (way @ below)
        across = faces.basis(way)[0] if np.linalg.norm(below) < 1e-6 else below / np.linalg.norm(below)
        axes = np.stack([way, -across, np.cross(way, -across)])
        half = _BLOCK[1] / 2 * u
        rails = [np.array([(start, -half, z), (end, -half, z)]) for z in (half, -half)]
        if by == STILL:
            count = max(2, round((end - start) / (1.2 * u)))
            feet = np.linspace(start, end, count + 1)[:-1]
            rails += [np.array([(x, -half, half), (x + 0.6 * (end - start) / count, -half, -half)]) for x in feet]
        sheet.carried(name, "guide", shapes.joined(*rails) @ axes, frame)
        sides = faces.block((_BLOCK[0] * u, _BLOCK[1] * u, _BLOCK[2] * u))
        sheet.add(name, "solid", sides @ axes, f"{name} block", Carrier(places, carrier.axes))

    return draw


def thickness(marks: Marks, joint: Any) -> float:
    """Return the largest side of the sections of the rods at a joint [m], 0 of other bodies."""
    bodies = [marks.scene.bodies.get(side.body) for side in (joint.first, joint.second)]
    sections = [body.section_at(0.0) for body in bodies if isinstance(body, Rod)]
    return max((float(side) for section in sections for side in (section.height, section.width)), default=0.0)


def _ball(thick: float) -> Callable[[float], Array]:
    return lambda u: faces.ball(max(_BALL * u, 0.65 * thick))


def _disc(radius: float) -> Callable[[float], Array]:
    return lambda u: faces.cylinder(radius, -0.3 * u, 0.3 * u, 24)


def _sphere(radius: float) -> Callable[[float], Array]:
    return lambda _: faces.ball(radius)


def _floor(marks: Marks, name: str, side: ContactSurface, other: ContactSurface) -> Part:
    """Return a square as large as the other body comes along a plane."""
    carried, met = marks.frame(side), marks.point(other)

    def draw(sheet: Sheet) -> None:
        carrier = sheet.carrier(carried)
        away = met(sheet.at, sheet.times) - carrier.moved(carried[1][None])[:, 0]
        own = np.einsum("fd,fkd->fk", away, np.broadcast_to(carrier.axes, (len(away), 3, 3)))
        axes = faces.basis(local(carrier, side.plane))
        along = own @ axes[:2].T
        middle = (np.nanmin(along, axis=0) + np.nanmax(along, axis=0)) / 2
        half = float(np.max(np.ptp(along, axis=0))) / 2 + float(other.radius) + 3 * sheet.unit
        lines = faces.plate(half, 0.0, max(sheet.unit, half / 8)) + np.array([*middle, 0.0])
        sheet.carried(name, "hatch", lines @ axes, carried)

    return draw
