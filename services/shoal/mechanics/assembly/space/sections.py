"""The sections of flexible rods in space: how they are turned at rest, and which of their axes joints share."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.rods import node_of
from shoal.mechanics.assembly.space.attitudes import Attitudes, section
from shoal.mechanics.elements import SPATIAL
from shoal.mechanics.elements.element import Element
from shoal.mechanics.elements.unstrained import unstrained
from shoal.mechanics.frames import Place
from shoal.mechanics.joints import Aligned, Turned
from shoal.mechanics.numerics.tile import Array, Number
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Attachment, Rod, Scene

ALIGNED = 1e-9
"""Cosine from which two directions do not count as being at a right angle."""
Owner = str | tuple[str, int]
"""Who has an axis: a rigid body or the ground, or a node of a rod."""


def flexible(scene: Scene, body: str) -> Rod | None:
    """The rod of that name, if it is flexible."""
    found = None if body == GROUND else scene.bodies[body]
    return found if isinstance(found, Rod) and found.element != "rigid" else None


def material(scene: Scene, body: str, place: Place) -> Place:
    """A place of an unstrained body in its own frame [m]; of a flexible rod by its arc length."""
    rod = flexible(scene, body)
    return place if rod is None else tuple(unstrained(rod, place[0])[0])


def image(scene: Scene, attitudes: Attitudes, side: Attachment, axis: Any) -> Array:
    """The unit vector of an axis, as it points at the start, in the frame of a body or of the section at a place.

    None: its x axis.
    """
    if axis is None:
        return vector(1.0, 0.0, 0.0)
    return turns.back(section(scene, side), attitudes.image(side.body, axis))


def chosen_elements(scene: Scene, attitudes: Attitudes) -> dict[str, Element]:
    """The element of every flexible rod; the director is the axis of the section that a joint can share with it.

    Hinges between two flexible rods come first, then welds between them, of which the one at a right angle to both axes
    lets most be held by products.
    """
    wishes: dict[str, list[tuple[int, int]]] = {}
    for _, condition in joints.of_scene(scene):
        if not isinstance(condition, Aligned | Turned):
            continue
        sides = condition.first, condition.second
        both = all(flexible(scene, side.body) is not None for side in sides)
        for side in sides:
            if flexible(scene, side.body) is None or (isinstance(condition, Turned) and not both):
                continue
            if isinstance(condition, Turned):
                one, other = (turn_of(attitudes, scene, end)[:, 0, 0] for end in sides)
                here = turn_of(attitudes, scene, side)[..., 0].T @ np.cross(one, other)
                here = here / max(float(np.linalg.norm(here)), ALIGNED)
            else:
                here = image(scene, attitudes, side, condition.axis)[:, 0]
            rank = both + isinstance(condition, Aligned) * both
            along = [k for k in (1, 2) if abs(here[k]) > 1.0 - ALIGNED]
            wishes.setdefault(side.body, []).extend((rank, k) for k in along)
    found = {}
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod) or body.element == "rigid":
            continue
        element = SPATIAL[body.element]
        wish = max(wishes.get(name, []), key=lambda one: one[0], default=(0, element.director))[1]
        if body.director is not None:
            wish = "xyz".index(body.director)
        found[name] = element.other if element.other is not None and wish != element.director else element
    return found


def shared(
    scene: Scene, attitudes: Attitudes, elements: dict[str, Element], side: Attachment, axis: Any
) -> tuple[Owner, Array] | None:
    """Return the owner of an axis as a vector of its own, and the vector in its frame; None for a rod without it."""
    if is_stiff(scene, side.body):
        return side.body, attitudes.image(side.body, axis)
    rod, element = flexible(scene, side.body), elements[side.body]
    assert rod is not None
    node = node_of(rod, scene.location(side))
    here = image(scene, attitudes, side, axis)
    if node is None or element.director is None or np.any(np.abs(here[element.director]) < 1.0 - ALIGNED):
        return None
    return (side.body, node), here


def turn_of(attitudes: Attitudes, scene: Scene, side: Attachment) -> Array:
    """The rotation whose columns are the axes of a body, or of the section at a place of a rod, at the start."""
    return turns.product(attitudes.rotation(side.body), section(scene, side))


def arc(rod: Rod, node: int) -> Number:
    """The arc length of a node [m]."""
    return rod.length * node / rod.elements
