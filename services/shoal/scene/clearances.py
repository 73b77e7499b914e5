"""All contacts of a scene: those that it states, and those that hold joints with play: pins, balls and guided boxes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from shoal.scene.contacts import Contact, ContactSurface
from shoal.scene.joints import Clearance, Slider


def with_play(scene: Any) -> dict[str, Clearance]:
    """Return the joints that have play, by name."""
    return {name: one for name, one in scene.joints.items() if isinstance(one, Clearance) and one.play is not None}


def contacts_of(scene: Any) -> dict[str, Contact]:
    """Return all contacts of a scene by the path of what states them: first those of joints with play."""
    found = {}
    for name, joint in with_play(scene).items():
        pairs = list(_guide(scene, joint) if isinstance(joint, Slider) else _pin(joint))
        for number, (first, second) in enumerate(pairs, 1):
            path = f"joints.{name}.play" + f".{number}" * (len(pairs) > 1)
            found[path] = Contact.model_construct(
                first=first,
                second=second,
                restitution=joint.restitution,
                tangential_restitution=joint.tangential_restitution,
                mu=getattr(joint, "mu", 0.0),
                mu_static=joint.mu_static,
                rolling=False,
                law=joint.law,
            )
    for name, contact in scene.contacts.items():
        corners = _corners(scene, contact.first) if contact.first.polygon is not None else [contact.first]
        for number, corner in enumerate(corners, 1):
            path = f"contacts.{name}" + f".corner.{number}" * (len(corners) > 1)
            found[path] = contact.model_copy(update={"first": corner})
    return found


def _corners(scene: Any, side: ContactSurface) -> list[ContactSurface]:
    """Return the corners of a polygon, by which it touches a line."""
    x, y = scene.location(side)[:2]
    return [_surface(side.body, (x + a, y + b)) for a, b in side.polygon or ()]


def _surface(body: str, point: Any, **shape: Any) -> ContactSurface:
    """Return a surface without a check, as its numbers may be of lanes."""
    return ContactSurface.model_construct(body=body, point=point, **shape)


def _pin(joint: Any) -> Iterator[tuple[ContactSurface, ContactSurface]]:
    """Yield the pin of the first body and the hole of the second."""
    radius = 0.0 if joint.radius is None else joint.radius
    first, second = joint.first, joint.second
    yield (
        _surface(first.body, first.point, radius=radius),
        _surface(second.body, second.point, hole=radius + joint.play),
    )


def _guide(scene: Any, joint: Slider) -> Iterator[tuple[ContactSurface, ContactSurface]]:
    """Yield the corners of the box: those in front and behind at the line on the left, then those on the right."""
    assert joint.size is not None
    assert joint.play is not None
    length, height = joint.size
    (base_x, base_y), (x, y) = (scene.location(side)[:2] for side in (joint.first, joint.second))
    along, reach = joint.direction, 0.5 * height + joint.play
    for side in (1.0, -1.0):
        place = base_x - side * np.sin(along) * reach, base_y + side * np.cos(along) * reach
        line = along + (np.pi if side > 0.0 else 0.0)  # the box is on the left of it
        for end in (1.0, -1.0):
            corner = x + 0.5 * end * length, y + 0.5 * side * height
            yield _surface(joint.second.body, corner), _surface(joint.first.body, place, line=line)


def check_clearances(scene: Any) -> None:
    """Raises ValueError where a joint cannot have play or backlash in a scene, or between its bodies."""
    for name, joint in scene.joints.items():
        for field in joint.turned if getattr(joint, "backlash", None) is not None else ():
            body = scene.bodies.get(getattr(joint, field).body)
            if body is not None and body.element != "rigid":
                on = getattr(joint, field).body
                raise ValueError(f"joints.{name}.{field}.body: gears with backlash are on rigid bodies, found {on}")
    for name, joint in with_play(scene).items():
        where = f"joints.{name}"
        if scene.dimensions == 3 and joint.kind != "spherical":
            raise ValueError(f"{where}.play: in space a spherical joint has play, a {joint.kind} one does not")
        if joint.mu_static is not None and np.any(joint.mu_static < getattr(joint, "mu", 0.0)):
            raise ValueError(f"{where}.mu_static: must be at least mu, found {joint.mu_static:g}")
        for field in ("first", "second") if isinstance(joint, Slider) else ():
            side = getattr(joint, field)
            body = scene.bodies.get(side.body)
            if body is None and isinstance(side.point, str):
                raise ValueError(f"{where}.{field}.point: a guide with play rests on the ground, found {side.point!r}")
            if body is not None and (body.kind == "point-mass" or body.element != "rigid"):
                raise ValueError(f"{where}.{field}.body: a guide with play takes rigid bodies, found {side.body}")
