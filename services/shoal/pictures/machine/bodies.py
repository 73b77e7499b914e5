"""Bodies of the plane by their outlines: rods with their thickness, plates and links about their joints.

A rigid body states no shape. One with a surface of a contact has that; others are plates about their joints, and a
body with one joint is a disc that has its radius of gyration.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.pictures.machine import shapes
from shoal.pictures.machine.marks import Marks
from shoal.pictures.machine.sheet import Part, Sheet
from shoal.pictures.outline import joined_places
from shoal.scene import Attachment, PointMass, RigidBody, Rod
from shoal.scene.joints import Gear, Slider
from shoal.scene.ropes import Rope
from shoal.trajectory import Array

_ALONG = 33
_LINK = 0.75
"""Half the width of a link [units]."""
_MASS = 1.0
"""Radius of a point mass [units]."""


def bodies(marks: Marks) -> Iterator[Part]:
    """Yield what draws the bodies that do not bend."""
    scene = marks.scene
    blocks = {joint.second.body for joint in scene.joints.values() if isinstance(joint, Slider)}
    outlined = {side.body for contact in scene.contacts.values() for side in (contact.first, contact.second)
                if side.shape in ("polygon", "cam") or np.any(side.radius)}  # fmt: skip
    wheels = {
        side.body for joint in scene.joints.values() if isinstance(joint, Gear) for side in (joint.first, joint.second)
    }
    for rope in (joint for joint in scene.joints.values() if isinstance(joint, Rope)):
        wheels |= {drum.body for drum in (rope.first, *rope.over, rope.second) if np.any(drum.radius)}
    for name, body in scene.bodies.items():
        if isinstance(body, Rod):
            if body.element == "rigid":
                yield _rod(marks, name, body)
        elif isinstance(body, PointMass):
            if name not in blocks | outlined:
                yield _mass(marks, name)
        elif isinstance(body, RigidBody):
            yield _rigid(marks, name, body, shaped=name in blocks | outlined | wheels)


def profile(rod: Rod) -> Array:
    """Return the outline of a rigid rod in its frame [m], closed, (points, 2)."""
    straight = not rod.curvature and rod.end_height is None
    share = np.linspace(0.0, 1.0, 2 if straight else _ALONG)
    axis = np.array([[place.real, place.imag] for place in (complex(rod.axis(s)) for s in share * rod.length)])
    if not rod.curvature:
        axis = np.stack([share * rod.length, 0 * share], axis=1)
    half = np.asarray(rod.section_at(share).height * np.ones(len(share)))[:, None] / 2
    return np.asarray(ribbon(axis[None], half[:, 0])[0])


def ribbon(axis: Array, half: Array) -> Array:
    """Return the closed outline of strips about lines, (frames, points, 2); half: of their thickness [m], (points,)."""
    along = np.gradient(axis, axis=1)
    along = along / np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-300)
    normal = np.stack([-along[..., 1], along[..., 0]], axis=2) * half[:, None]
    left, right = axis + normal, axis - normal
    return np.concatenate([left, right[:, ::-1], left[:, :1]], axis=1)


def _rod(marks: Marks, name: str, rod: Rod) -> Part:
    carried = marks.frame(Attachment(body=name, point=(0.0, 0.0)))
    return lambda sheet: sheet.carried(name, "body", profile(rod), carried)


def _mass(marks: Marks, name: str) -> Part:
    carried = marks.frame(Attachment(body=name))
    return lambda sheet: sheet.carried(name, "mass", shapes.circle(_MASS * sheet.unit), carried)


def _rigid(marks: Marks, name: str, body: RigidBody, *, shaped: bool) -> Part:
    carried = marks.frame(Attachment(body=name, point=(0.0, 0.0)))
    places = np.array(joined_places(marks.scene, name), dtype=float)
    gyration = float(np.sqrt(np.max(body.inertia) / body.mass))

    def draw(sheet: Sheet) -> None:
        u = sheet.unit
        away = float(np.max(np.linalg.norm(places - places[0], axis=1)))
        if away > 1e-6 * u:
            flat = float(np.linalg.svd(places - places[0], compute_uv=False)[-1]) < 0.5 * u
            sheet.carried(name, "body" if flat else "plate", shapes.hull(places, _LINK * u), carried)
        elif not shaped and gyration > 0:
            middle = np.array(body.centre_of_mass, dtype=float)
            lines = shapes.circle(min(gyration, 8 * u), tuple(middle), count=40)
            sheet.carried(name, "body", lines, carried)
            sheet.carried(name, "spoke", shapes.joined(*(middle + 0.5 * u * way for way in _CROSS)), carried)
            if np.linalg.norm(middle - places[0]) > gyration:
                sheet.carried(name, "body", shapes.hull(np.stack([places[0], middle]), 0.4 * u), carried)

    return draw


_CROSS = (np.array([(-1.0, 0.0), (1.0, 0.0)]), np.array([(0.0, -1.0), (0.0, 1.0)]))
