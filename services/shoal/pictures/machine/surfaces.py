"""Stops of joints and surfaces of contacts in the plane, on the bodies that carry them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.mechanics.cams import points, segments
from shoal.mechanics.profiles import SIZE
from shoal.mechanics.reach import span
from shoal.pictures.machine import shapes
from shoal.pictures.machine.marks import Marks
from shoal.pictures.machine.sheet import Part, Sheet, turned
from shoal.scene import GROUND, Attachment, Revolute, Rod, Slider
from shoal.scene.clearances import contacts_of, with_play
from shoal.scene.contacts import ContactSurface
from shoal.trajectory import Array

RADIUS, TICK = 0.08, 0.02
"""Of the arc of a stop, and half the length of a tick, over the size of the machine."""
OPEN = 0.6
"""Arc that is drawn of a range with one end [rad]."""
ARC = 24


def surfaces(marks: Marks) -> Iterator[Part]:
    """Yield what draws the limits of joints, with ticks at their ends, and the surfaces of contacts and of play.

    Bodies that bend show none, as they have no axes of their own at a joint.
    """
    scene = marks.scene
    size = span(scene)
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Slider) and joint.stops is not None and _has_axes(marks, joint.first):
            ends = [joint.stops.min, joint.stops.max]
            lines = size * _arc(ends) if isinstance(joint, Revolute) else _ticks(ends, joint, size)
            yield _carried(marks, name, "stop", joint.first, lines)
    stated = {f"contacts.{name}": contact for name, contact in scene.contacts.items()}
    for path, contact in (contacts_of(scene) | stated).items():
        for field, side, other in (("first", contact.first, contact.second), ("second", contact.second, contact.first)):
            name = f"{path.removeprefix('contacts.')} {field}"
            if not _has_axes(marks, side):
                continue
            if side.line is not None:
                yield _floor(marks, name, side, other)
            elif (outline := _outline(side)) is not None:
                solid = side.hole is None and (side.polygon is None or _area(outline) > 0)
                yield _carried(marks, name, "surface" if solid else "stop", side, outline)
    for name, guide in with_play(scene).items():
        if isinstance(guide, Slider):
            assert guide.size is not None
            corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]]) * np.array(guide.size)
            yield _carried(marks, f"{name} box", "surface", guide.second, corners)


def _has_axes(marks: Marks, side: Attachment) -> bool:
    if side.body == GROUND:
        return not isinstance(side.point, str)
    body = marks.scene.bodies[side.body]
    return not isinstance(body, Rod) or body.element == "rigid"


def _carried(marks: Marks, name: str, look: str, side: Attachment, lines: Array) -> Part:
    carried = marks.frame(side)
    return lambda sheet: sheet.carried(name, look, lines, carried)


def _floor(marks: Marks, name: str, side: ContactSurface, other: ContactSurface) -> Part:
    """Return a line as far as the other body comes along it, with the ground on its right."""
    carried, met = marks.frame(side), marks.point(other)
    assert side.line is not None
    angle = float(side.line)
    reach = max([float(other.radius), *(float(np.hypot(*corner)) for corner in other.polygon or ())])

    def draw(sheet: Sheet) -> None:
        carrier = sheet.carrier(carried)
        away = met(sheet.at, sheet.times) - carrier.moved(carried[1][None])[:, 0]
        along = np.einsum("fd,fkd,k->f", away, carrier.axes, [np.cos(angle), np.sin(angle)])
        room = reach + 3 * sheet.unit
        start, end = float(np.nanmin(along)) - room, float(np.nanmax(along)) + room
        sheet.carried(name, "stop", turned(np.array([(start, 0.0), (end, 0.0)]), angle), carried)
        if side.body == GROUND:
            sheet.carried(f"{name} ground", "hatch", turned(shapes.hatch(start, end, 0.0, sheet.unit), angle), carried)

    return draw


def _outline(side: ContactSurface) -> Array | None:
    """Return a circle, a polygon or a cam about the place of a surface [m], (points, 2); None of a point."""
    if side.polygon is not None:
        return np.array([*side.polygon, side.polygon[0]])
    if side.cam is not None:
        outline = points(segments(side.cam, SIZE))
        return np.concatenate([outline, outline[:1]])
    radius = side.radius if side.hole is None else side.hole
    return shapes.circle(float(radius), count=2 * ARC) if radius else None


def _area(outline: Array) -> float:
    x, y = outline.T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def _arc(ends: list[float | None]) -> Array:
    """Return the range of a hinge about its place, in the axes of the first body, (points, 2)."""
    limits = [end for end in ends if end is not None]
    low = limits[0] if ends[0] is not None else limits[0] - OPEN
    high = limits[-1] if ends[1] is not None else limits[0] + OPEN
    angle = np.linspace(low, high, ARC)
    arc = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ways = [np.array([[np.cos(end), np.sin(end)]]) for end in limits]
    ticks = [np.concatenate([(RADIUS - TICK) * way, (RADIUS + 2 * TICK) * way]) for way in ways]
    return shapes.joined(arc, *ticks)


def _ticks(ends: list[float | None], joint: Slider, size: float) -> Array:
    """Return ticks across the line of a slider, from its place [m], (points, 2)."""
    way = np.array([np.cos(joint.direction), np.sin(joint.direction)])
    across = 2 * TICK * size * np.array([-way[1], way[0]])
    places = [end * way for end in ends if end is not None]
    return shapes.joined(*(np.stack([place - across, place + across]) for place in places))
