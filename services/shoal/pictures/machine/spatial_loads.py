"""Springs, dampers, drives, loads and gears of machines in space."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from shoal.pictures.machine import faces, shapes
from shoal.pictures.machine.drawing import Carrier
from shoal.pictures.machine.gears import axle, radii
from shoal.pictures.machine.loads import ARC, ARROW, LEAST, sag, share_of
from shoal.pictures.machine.marks import Marks, across, between, completed, unit
from shoal.pictures.machine.sheet import Part, Sheet
from shoal.pictures.machine.spatial import is_fixed, local
from shoal.pictures.machine.strength import largest
from shoal.scene import GROUND, Attachment
from shoal.scene.joints import Distance, DrivenAngle, Gear
from shoal.scene.loads import DistributedForce, Force, Spring, Torque, TorsionSpring
from shoal.trajectory import Array


def loads(marks: Marks) -> Iterator[Part]:
    """Yield what draws the springs, drives and loads of a scene in space."""
    scene = marks.scene
    most = largest(scene)
    for name, load in scene.loads.items():
        if isinstance(load, Spring):
            yield _spring(marks, name, load)
        elif isinstance(load, TorsionSpring):
            side = load.second if load.first.body == GROUND else load.first
            yield _turned(marks, name, "spring", side, load.axis, shapes.spiral)
        elif isinstance(load, Force):
            yield _force(marks, name, load, most)
        elif isinstance(load, Torque):
            yield _torque(marks, name, load, most)
        elif isinstance(load, DistributedForce):
            yield from _distributed(marks, name, load)
    for name, joint in scene.joints.items():
        if isinstance(joint, DrivenAngle):
            yield _motor(marks, name, joint)
        elif isinstance(joint, Distance):
            yield _distance(marks, name, joint)
        elif isinstance(joint, Gear):
            yield from _gear(marks, name, joint)


def _ends(marks: Marks, joint: Any) -> Any:
    paths = [marks.point(side) for side in (joint.first, joint.second)]

    def ends(sheet: Sheet) -> tuple[Array, Array]:
        one, other = (np.broadcast_to(path(sheet.at, sheet.times), (len(sheet.times), 3)) for path in paths)
        return one, other

    return ends


def _spring(marks: Marks, name: str, load: Spring) -> Part:
    """Return a coil, with a damper in it, or a damper alone, between their places; the ground where it holds them."""
    ends = _ends(marks, load)
    fixed = [is_fixed(side) for side in (load.first, load.second)]
    coiled = bool(np.any(load.stiffness) or np.any(load.cubic) or load.elastic is not None)
    damped = bool(np.any(load.damping))

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        one, other = ends(sheet)
        for held, place, away in zip(fixed, (one, other), (other, one), strict=True):
            if held:
                sheet.add(name, "hatch", faces.about(faces.plate(1.4 * u, 0.0, u), away[0] - place[0]), at=place[0])
        if coiled or not damped:
            sheet.add(name, "spring", shapes.helix(u), name, between(one, other))
        if damped:
            _cylinder(sheet, name, one, other, 0.45 if coiled else 0.65)

    return draw


def _cylinder(sheet: Sheet, name: str, one: Array, other: Array, size: float) -> None:
    """Draw a cylinder in the middle of two places, as long as the stroke lets it be, with rods to both."""
    u, length = sheet.unit, np.linalg.norm(other - one, axis=1)
    half = min(0.3 * float(np.min(length)), 0.5 * float(np.ptp(length)) + 1.5 * u)
    along = unit(other - one)
    axes = completed([along, across(along)])
    solid = faces.cylinder(size * u, -half, half)[:, [2, 0, 1]]
    sheet.add(name, "solid", solid, f"{name} cylinder", Carrier((one + other) / 2, axes))
    if size > 0.5:
        sheet.add(name, "spring", np.array([(0.0, 0, 0), (1.0, 0, 0)]), name, between(one, other))


def _turned(marks: Marks, name: str, look: str, side: Attachment, axis: Any, shape: Any) -> Part:
    carried = marks.frame(side)

    def draw(sheet: Sheet) -> None:
        lines = faces.about(faces.flat(shape(sheet.unit)), local(sheet.carrier(carried), axis))
        sheet.carried(name, look, lines, carried)

    return draw


def _arrows(sheet: Sheet, name: str, place: Array, vectors: Array, shift: float = 0.0) -> None:
    """Draw an arrow of two flat ones across each other, so that it is seen from all sides."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    second = across(unit(vectors)) * size
    lines = shapes.arrow() - [shift, 0.0]
    both = shapes.joined(faces.flat(lines), faces.flat(lines)[:, [0, 2, 1]])
    sheet.add(name, "load", both, name, Carrier(place, completed([vectors, second])))


def _force(marks: Marks, name: str, load: Force, most: dict[str, float]) -> Part:
    place, (_, _, moves) = marks.point(load.at), marks.frame(load.at)

    def draw(sheet: Sheet) -> None:
        share = share_of(sheet, marks.scene, load.scale)
        way = np.array([*load.force, 0.0][:3]) / (np.linalg.norm(load.force) or 1.0)
        ways = way[None]
        if load.follows:
            axes = moves(sheet.at, sheet.times).axes
            ways = np.einsum("fkd,k->fd", axes, axes[0] @ way)
        size = ARROW * sheet.unit * max(LEAST, most[name])
        vectors = size * (np.ones(1) if share is None else share)[:, None] * ways
        _arrows(sheet, name, place(sheet.at, sheet.times), vectors)
        if share is None:
            _arrows(sheet, f"{name} back", place(sheet.at, sheet.times), -vectors)

    return draw


def _turn(sheet: Sheet, name: str, place: Array, axes: Array, share: Array | None, size: float) -> None:
    """Draw arcs with a head about the third of some axes, (frames, 3, 3); see `loads.turn`."""
    radius = ARC * sheet.unit * np.sqrt(size)
    for sense in (1.0, -1.0):
        shown = np.ones(1) if share is None else np.maximum(0.0, sense * share)
        if np.any(shown > 0):
            lines = faces.flat(shapes.turning_arrow(sense))
            sheet.add(name, "load", lines, f"{name} {sense:+g}", Carrier(place, radius * shown[:, None, None] * axes))


def _torque(marks: Marks, name: str, load: Torque, most: dict[str, float]) -> Part:
    place = marks.point(load.at)
    frame = marks.frame(Attachment(body=GROUND, point=(0.0, 0.0, 0.0)) if load.reaction is None else load.reaction)

    def draw(sheet: Sheet) -> None:
        carrier, share = sheet.carrier(frame), share_of(sheet, marks.scene, load.torque)
        axes = faces.basis(local(carrier, load.axis)) @ carrier.axes
        _turn(sheet, name, place(sheet.at, sheet.times), axes, share, max(LEAST, most[name]))

    return draw


def _motor(marks: Marks, name: str, joint: DrivenAngle) -> Part:
    """Return a ring about the axis with an arrow in the direction in which it turns the second body."""
    driven = joint.second if joint.second.body != GROUND else joint.first
    other = joint.first if driven is joint.second else joint.second
    place, frame = marks.point(driven), marks.frame(other if marks.is_rigid(other.body) else driven)
    ring = _turned(marks, name, "drive", driven, joint.axis, lambda u: shapes.circle(1.2 * u))
    sign = 1.0 if driven is joint.second else -1.0

    def draw(sheet: Sheet) -> None:
        ring(sheet)
        rate = sign * np.gradient(joint.angle(sheet.times), sheet.times) if np.ptp(sheet.times) > 0 else np.zeros(1)
        carrier = sheet.carrier(frame)
        axes = faces.basis(local(carrier, joint.axis)) @ carrier.axes
        turns = np.abs(rate) > 1e-6 * np.max(np.abs(rate))
        _turn(sheet, name, place(sheet.at, sheet.times), axes, np.sign(rate) * turns, 1.0)

    return draw


def _distributed(marks: Marks, name: str, load: DistributedForce) -> Iterator[Part]:
    length = marks.scene.bodies[load.body].length  # type: ignore[union-attr]
    for k, s in enumerate(np.linspace(0.0, length, 7)):
        place = marks.point(Attachment(body=load.body, point=(float(s), 0.0, 0.0)))

        def draw(sheet: Sheet, place: Any = place, k: int = k) -> None:
            share = share_of(sheet, marks.scene, load.scale)
            way = np.array([*load.force, 0.0][:3]) / (np.linalg.norm(load.force) or 1.0)
            vectors = 3.0 * sheet.unit * (np.ones(1) if share is None else share)[:, None] * way
            _arrows(sheet, f"{name} {k}", place(sheet.at, sheet.times), vectors, 1.0)

        yield draw


def _distance(marks: Marks, name: str, joint: Distance) -> Part:
    """Return a bar, a cylinder where its length is driven, or a rope that sags where it is slack."""
    ends = _ends(marks, joint)
    driven = joint.length is not None and joint.length.number is None

    def draw(sheet: Sheet) -> None:
        one, other = ends(sheet)
        if joint.keeps == "at-most":
            sag(sheet, name, one, other, joint.length)
        elif driven:
            _cylinder(sheet, name, one, other, 0.65)
        else:
            bar = faces.cylinder(0.25 * sheet.unit, 0.0, 1.0, 6)[:, [2, 0, 1]]
            sheet.add(name, "solid", bar, name, between(one, other))

    return draw


def _gear(marks: Marks, name: str, joint: Gear) -> Iterator[Part]:
    """Yield the wheels of gears whose axes are parallel and whose axles are seen, as discs that touch."""
    found = [axle(marks.scene, side.body, joint.carrier.body) for side in (joint.first, joint.second)]
    ends = [end for end in found if end is not None and marks.is_rigid(end.body)]
    one, other = (np.array(axis) / np.linalg.norm(axis) for axis in joint.axes)
    if len(ends) < 2 or abs(one @ other) < 1 - 1e-6:
        return
    frames, places = [marks.frame(end) for end in ends], [marks.point(end) for end in ends]
    ring = joint.carrier.body != GROUND and joint.ratio > 0 and joint.ratio != 1.0

    def draw(sheet: Sheet) -> None:
        first, second = (place(sheet.at, sheet.times)[0] for place in places)
        apart = second - first
        apart = apart - one * (apart @ one)
        if np.linalg.norm(apart) < 2 * sheet.unit:
            return
        sizes = radii(float(joint.ratio) * (1.0 if one @ other > 0 else -1.0), float(np.linalg.norm(apart)), ring=ring)
        for size, frame in zip(sizes, frames, strict=True):
            axis = local(sheet.carrier(frame), joint.axis)
            thick = 0.5 * sheet.unit
            wheel = faces.prism(shapes.circle(size, count=28)[:-1], -thick, thick)
            sheet.carried(name, "wheel", faces.about(wheel, axis), frame)
            spoke = np.array([(-0.8 * size, 0), (0.8 * size, 0)])
            for side in (-1.01, 1.01):
                sheet.carried(name, "spoke", faces.about(faces.flat(spoke, side * thick), axis), frame)

    yield draw
