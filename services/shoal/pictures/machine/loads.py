"""Springs, dampers, drives and loads of the plane: coils, cylinders, arrows as large as the load."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.pictures.machine import shapes
from shoal.pictures.machine.drawing import Carrier
from shoal.pictures.machine.marks import Marks, between, unit
from shoal.pictures.machine.sheet import Part, Sheet, facing
from shoal.pictures.machine.strength import largest, strength
from shoal.scene import GROUND, Attachment, Scene
from shoal.scene.function import SignalFunction
from shoal.scene.joints import Distance, DrivenAngle
from shoal.scene.loads import DistributedForce, Force, Spring, Torque, TorsionSpring
from shoal.trajectory import Array

ARROW, LEAST, ARC = 7.0, 0.4, 2.3
"""Length of the largest force, share of it that every load reaches at its own largest, radius of a torque [units]."""
_ALONG = 7
"""Arrows of a distributed force."""


def loads(marks: Marks) -> Iterator[Part]:
    """Yield what draws the springs, drives and loads of a scene."""
    scene = marks.scene
    most = largest(scene)
    for name, load in scene.loads.items():
        if isinstance(load, Spring):
            yield _spring(marks, name, load)
        elif isinstance(load, TorsionSpring):
            yield _torsion(marks, name, load.second if load.first.body == GROUND else load.first)
        elif isinstance(load, Force):
            yield _force(marks, name, load, most)
        elif isinstance(load, Torque):
            yield _torque(marks, name, load, most)
        elif isinstance(load, DistributedForce):
            yield _distributed(marks, name, load)
    for name, joint in scene.joints.items():
        if isinstance(joint, DrivenAngle):
            yield _motor(marks, name, joint)
        elif isinstance(joint, Distance):
            yield _distance(marks, name, joint)


def _spring(marks: Marks, name: str, load: Spring) -> Part:
    """Return a coil, a damper, or both beside each other, between their places; the ground where it holds them."""
    ends = [marks.point(side) for side in (load.first, load.second)]
    grounded = [side.body == GROUND and not isinstance(side.point, str) for side in (load.first, load.second)]
    coiled = bool(np.any(load.stiffness) or np.any(load.cubic) or load.elastic is not None)
    damped = bool(np.any(load.damping))

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        one, other = (np.broadcast_to(end(sheet.at, sheet.times), (len(sheet.times), 2)) for end in ends)
        for fixed, place, away in zip(grounded, (one, other), (other, one), strict=True):
            if fixed:
                sheet.add(name, "hatch", facing(shapes.wall(u), away[0] - place[0]), at=place[0])
        if coiled or not damped:
            lines = shapes.coil(u) + ([0.0, 1.1 * u] if damped else 0.0)
            sheet.add(name, "spring", lines, name, between(one, other))
        if damped:
            _cylinder(sheet, name, "spring", one, other, -1.1 * u if coiled else 0.0)
        if coiled and damped:
            ties = shapes.joined(*(np.array([(x, -1.1 * u), (x, 1.1 * u)]) for x in (0.0, 1.0)))
            sheet.add(name, "spring", ties, name)

    return draw


def _cylinder(sheet: Sheet, name: str, look: str, one: Array, other: Array, y: float) -> None:
    """Draw a cylinder that hangs on one place and its piston on the other, beside their line by y [m]."""
    u, length = sheet.unit, np.linalg.norm(other - one, axis=1)
    found = shapes.dashpot((float(np.min(length)), float(np.max(length))), u)
    if found is None:
        sheet.add(name, look, shapes.damper(u) + np.array([0.0, y]), f"{name} stretched", between(one, other))
        return
    along = unit(other - one)
    axes = np.stack([along, np.stack([-along[:, 1], along[:, 0]], axis=1)], axis=1)
    for lines, place, by in zip(found, (one, other), ("cylinder", "piston"), strict=True):
        sheet.add(name, look, lines + np.array([0.0, y]), f"{name} {by}", Carrier(place, axes))


def _torsion(marks: Marks, name: str, side: Attachment) -> Part:
    carried = marks.frame(side)
    return lambda sheet: sheet.carried(name, "spring", shapes.spiral(sheet.unit), carried)


def _force(marks: Marks, name: str, load: Force, most: dict[str, float]) -> Part:
    place, (_, _, moves) = marks.point(load.at), marks.frame(load.at)

    def draw(sheet: Sheet) -> None:
        share = share_of(sheet, marks.scene, load.scale)
        ways = np.tile(
            np.array(load.force[:2], dtype=float) / (np.linalg.norm(load.force) or 1.0), (len(sheet.times), 1)
        )
        if load.follows:
            axes = moves(sheet.at, sheet.times).axes
            ways = np.einsum("fkd,k->fd", np.broadcast_to(axes, (len(ways), 2, 2)), axes[0] @ ways[0])
        size = ARROW * sheet.unit * max(LEAST, most[name])
        for sense in (1.0,) if share is not None else (1.0, -1.0):
            x = sense * size * (np.ones(1) if share is None else share)[:, None] * ways
            axes = np.stack([x, np.stack([-x[:, 1], x[:, 0]], axis=1)], axis=1)
            sheet.add(name, "load", shapes.arrow(), f"{name} {sense:+g}", Carrier(place(sheet.at, sheet.times), axes))

    return draw


def share_of(sheet: Sheet, scene: Scene, function: SignalFunction) -> Array | None:
    """Return a load over its largest value at each time, (frames,); None where it follows the motion."""
    signed = strength(scene, function, sheet.times)
    return None if signed is None else signed / (np.max(np.abs(signed)) or 1.0)


def _torque(marks: Marks, name: str, load: Torque, most: dict[str, float]) -> Part:
    place = marks.point(load.at)

    def draw(sheet: Sheet) -> None:
        share = share_of(sheet, marks.scene, load.torque)
        turn(sheet, name, place(sheet.at, sheet.times), share, max(LEAST, most[name]))

    return draw


def turn(sheet: Sheet, name: str, place: Array, share: Array | None, size: float) -> None:
    """Draw arcs with a head about a place, as large as a torque; its sign decides which of both is seen.

    share: of the largest torque at each time, (frames,); None where its sign is not known: both are seen
    """
    radius = ARC * sheet.unit * np.sqrt(size)
    for sense in (1.0, -1.0):
        shown = np.ones(1) if share is None else np.maximum(0.0, sense * share)
        if np.any(shown > 0):
            axes = radius * shown[:, None, None] * np.eye(2)
            sheet.add(name, "load", shapes.turning_arrow(sense), f"{name} {sense:+g}", Carrier(place, axes))


def _motor(marks: Marks, name: str, joint: DrivenAngle) -> Part:
    """Return a ring about the axle with an arrow in the direction in which it turns the second body."""
    driven = joint.second if joint.second.body != GROUND else joint.first
    place, carried = marks.point(driven), marks.frame(driven)
    sign = 1.0 if driven is joint.second else -1.0

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        angle = joint.angle(sheet.times)
        rate = sign * np.gradient(angle, sheet.times) if len(angle) > 1 and np.ptp(sheet.times) > 0 else np.zeros(1)
        sheet.carried(name, "drive", shapes.circle(1.05 * u), carried)
        most = float(np.max(np.abs(rate)))
        turn(sheet, name, place(sheet.at, sheet.times), np.sign(rate) * (np.abs(rate) > 1e-6 * most), 1.0)

    return draw


def _distributed(marks: Marks, name: str, load: DistributedForce) -> Part:
    length = marks.scene.bodies[load.body].length  # type: ignore[union-attr]
    sides = [Attachment(body=load.body, point=(float(s), 0.0)) for s in np.linspace(0.0, length, _ALONG)]
    places = [marks.point(side) for side in sides]

    def draw(sheet: Sheet) -> None:
        share = share_of(sheet, marks.scene, load.scale)
        way = np.array(load.force[:2], dtype=float) / (np.linalg.norm(load.force) or 1.0)
        x = 3.0 * sheet.unit * (np.ones(1) if share is None else share)[:, None] * way
        axes = np.stack([x, np.stack([-x[:, 1], x[:, 0]], axis=1)], axis=1)
        for k, place in enumerate(places):
            lines = (shapes.arrow() - [1.0, 0.0]) * [1.0, 1.6]
            sheet.add(name, "load", lines, f"{name} {k}", Carrier(place(sheet.at, sheet.times), axes))

    return draw


def _distance(marks: Marks, name: str, joint: Distance) -> Part:
    """Return a bar on pins, or a cylinder where its length is driven; a rope that sags where it is slack; a strut."""
    ends = [marks.point(side) for side in (joint.first, joint.second)]
    driven = joint.length is not None and joint.length.number is None

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        one, other = (np.broadcast_to(end(sheet.at, sheet.times), (len(sheet.times), 2)) for end in ends)
        if joint.keeps == "at-most":
            sag(sheet, name, one, other, joint.length)
            return
        if driven:
            _cylinder(sheet, name, "drive", one, other, 0.0)
        else:
            sheet.add(name, "link", shapes.box((0.0, -0.3 * u), (1.0, 0.3 * u)), name, between(one, other))
        if joint.keeps == "exactly":
            for k, place in enumerate((one, other)):
                sheet.add(name, "pin", shapes.circle(0.8 * shapes.PIN * u), f"{name} end {k}", still(place))

    return draw


def still(place: Array) -> Carrier:
    """Return what moves with a place [m], (frames, d), and does not turn."""
    d = place.shape[1]
    place = place[:1] if np.ptp(place, axis=0).max() == 0.0 else place
    return Carrier(place, np.eye(d)[None])


def sag(sheet: Sheet, name: str, one: Array, other: Array, length: object) -> None:
    """Draw a rope between two places: straight when it is taut, a parabola of its length that hangs when it is slack.

    The parabola of the sag s over a chord c is longer than it by 8 s^2 / (3 c).
    """
    chord = np.linalg.norm(other - one, axis=1)
    number = getattr(length, "number", None)
    full = float(chord[0] if number is None else number)
    depth = np.sqrt(3.0 / 16.0 * np.maximum(0.0, full**2 - chord**2))
    way = other - one
    x = np.linspace(0.0, 1.0, 17)
    hanging, down = np.stack([x, 4 * x * (1 - x)], axis=1), depth[:, None] * sheet.down
    sheet.add(name, "rope", hanging, name, Carrier(one, np.stack([way, down], axis=1)))
