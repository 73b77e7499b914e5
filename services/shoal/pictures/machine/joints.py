"""Joints of the plane: pins, the ground under them, clamps, sliders with their guides."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.pictures.machine import shapes
from shoal.pictures.machine.drawing import Carrier
from shoal.pictures.machine.marks import STILL, Marks
from shoal.pictures.machine.sheet import Part, Sheet, facing, turned
from shoal.scene import GROUND, Attachment, Revolute, Rod, Slider
from shoal.scene.joints import Distance, Weld
from shoal.trajectory import Array

_ALIKE = 1e-6
"""Guides whose lines differ by less than this share of a unit are one."""


def joints(marks: Marks) -> Iterator[Part]:
    """Yield what draws the joints of a scene."""
    scene, standing = marks.scene, set[tuple[float, ...]]()
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute | Distance):
            for side in (joint.first, joint.second):
                if _is_fixed(side) and scene.location(side) not in standing:
                    standing.add(scene.location(side))
                    yield _foot(name, np.array(scene.location(side), dtype=float))
        if isinstance(joint, Revolute):
            yield _pin(marks, name, [joint.first, joint.second])
        elif isinstance(joint, Weld):
            yield _clamp(marks, name, joint)
    sliders = {name: joint for name, joint in scene.joints.items() if isinstance(joint, Slider)}
    if sliders:
        yield _guides(marks, sliders)
    for name, point in scene.ground_points.items():
        side = Attachment(body=GROUND, point=name)
        used = (getattr(part, end, None) for part in scene.joints.values() for end in ("first", "second"))
        if side in used and not (point.x.number is not None and point.y.number is not None):
            yield _carriage(marks, name, side)


def _is_fixed(side: Attachment) -> bool:
    return side.body == GROUND and not isinstance(side.point, str)


def _foot(name: str, place: Array) -> Part:
    def draw(sheet: Sheet) -> None:
        triangle, ground = (facing(turned(one, np.pi / 2), sheet.down) for one in shapes.foot(sheet.unit))
        sheet.add(name, "ground", triangle, at=place)
        sheet.add(name, "hatch", ground, at=place)

    return draw


def _pin(marks: Marks, name: str, sides: list[Attachment]) -> Part:
    carried = marks.frame(next((side for side in sides if marks.is_rigid(side.body)), sides[0]))
    return lambda sheet: sheet.carried(name, "pin", shapes.circle(shapes.PIN * sheet.unit), carried)


def _clamp(marks: Marks, name: str, joint: Weld) -> Part:
    """Return the ground that clamps a body, across the direction into the body; a square between two bodies."""
    first, second = joint.first, joint.second
    if not (_is_fixed(first) or _is_fixed(second)):
        carried = marks.frame(first if marks.is_rigid(first.body) else second)
        return lambda sheet: sheet.carried(name, "weld", sheet.unit * shapes.box((-0.45, -0.45), (0.45, 0.45)), carried)
    fixed, moving = (first, second) if _is_fixed(first) else (second, first)
    place, (_, _, moves) = np.array(marks.scene.location(fixed), dtype=float), marks.frame(moving)
    body = marks.scene.bodies.get(moving.body)
    behind = isinstance(body, Rod) and marks.scene.location(moving)[0] > body.length / 2

    def draw(sheet: Sheet) -> None:
        way = moves(sheet.at, sheet.times).axes[0, 0] * (-1.0 if behind else 1.0)
        sheet.add(name, "hatch", facing(shapes.wall(sheet.unit), way), at=place)

    return draw


def _guides(marks: Marks, sliders: dict[str, Slider]) -> Part:
    """Return guides as long as the travel in them, with their blocks; sliders on one line share a guide."""
    frames = {name: (marks.frame(joint.first), marks.point(joint.second)) for name, joint in sliders.items()}

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        rails: dict[tuple[str, int, int], tuple[str, Array, Array, float, list[float]]] = {}
        for name, joint in sliders.items():
            (by, place, moves), second = frames[name]
            carrier = moves(sheet.at, sheet.times)
            way = np.array([np.cos(joint.direction), np.sin(joint.direction)])
            places = second(sheet.at, sheet.times)
            travel = np.einsum("fd,fkd,k->f", places - carrier.moved(place[None])[:, 0], carrier.axes, way)
            turn = joint.direction % np.pi
            side = float(place @ [-np.sin(turn), np.cos(turn)])
            key = by, round(turn / _ALIKE), round(side / (_ALIKE * u))
            start = float(place @ way)
            if key in rails and rails[key][2] @ way < 0:
                start, travel = -start, -travel
            rails.setdefault(key, (name, place, way, joint.direction, []))[4].extend(
                [start + float(np.min(travel)), start + float(np.max(travel))]
            )
            sheet.carriers.setdefault(by, carrier)
            axes = carrier.axes if by != STILL else np.eye(2)[None]
            block = u * 0.5 * np.array(shapes.BLOCK)
            lines = turned(shapes.box((-block[0], -block[1]), (block[0], block[1])), joint.direction)
            if joint.size is None:
                sheet.add(name, "block", lines, f"{name} block", Carrier(places, axes))
        room = (shapes.BLOCK[0] / 2 + 0.8) * u
        for (by, *_), (name, place, way, direction, ends) in rails.items():
            rail = shapes.guide(min(ends) - room, max(ends) + room, u, hatched=by == STILL)
            sheet.add(name, "guide", turned(rail, direction) + place - way * (place @ way), by)

    return draw


def _carriage(marks: Marks, name: str, side: Attachment) -> Part:
    """Return a point of the ground that moves as it is driven."""
    carried = marks.frame(side)
    return lambda sheet: sheet.carried(name, "drive", sheet.unit * shapes.box((-1.2, -0.7), (1.2, 0.7)), carried)
