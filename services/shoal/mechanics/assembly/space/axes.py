"""Axes that joints keep common to bodies: shared unit vectors, as joint points are shared places."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.assembly.space.sections import Owner, shared
from shoal.mechanics.elements.element import Element
from shoal.mechanics.joints import Aligned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Scene


@dataclass
class JointAxis:
    """A unit vector that bodies have in common; `where` is known once one of them is placed.

    images: who has it, and the vector in their frames, (3, lanes). joints: those that hold it. holders: whose own
    constraints keep its length.
    """

    name: str
    images: list[tuple[Owner, Array]]
    where: Affine | None = None
    holders: set[Owner] = field(default_factory=set)
    joints: set[str] = field(default_factory=set)

    def local(self, body: Owner) -> Array:
        """The vector in a body's frame."""
        return next(image for owner, image in self.images if owner == body)

    def touches(self, body: Owner) -> bool:
        """Return whether a body has this axis."""
        return any(owner == body for owner, _ in self.images)


def joint_axes(scene: Scene, attitudes: Attitudes, elements: dict[str, Element]) -> list[JointAxis]:
    """Group the axes that joints let coincide, transitively; constraints hold those that a rod cannot share."""
    groups: list[JointAxis] = []
    for name, condition in joints.of_scene(scene):
        if not isinstance(condition, Aligned):
            continue
        sides = condition.first, condition.second
        images = [found for side in sides if (found := shared(scene, attitudes, elements, side, condition.axis))]
        if len(images) == len(sides):
            if condition.axis is None and _opposed(attitudes, sides[0].body, sides[1].body):
                images[1] = images[1][0], -images[1][1]
            _merge(groups, JointAxis(name, images, joints={name}))
    for group in groups:
        for body, image in group.images:
            if body == GROUND:
                group.where = fixed(image)
                group.holders.add(GROUND)
    return groups


def _opposed(attitudes: Attitudes, first: str, second: str) -> bool:
    """Return whether the x axes of two bodies point away from each other at the start."""
    one, other = (attitudes.rotation(body)[:, 0, 0] for body in (first, second))
    return bool(one @ other < 0)


def _merge(groups: list[JointAxis], new: JointAxis) -> None:
    for group in list(groups):
        sign = next((s for p in group.images for q in new.images if (s := _same(p, q))), 0.0)
        if sign:
            groups.remove(group)
            new.joints |= group.joints
            images = [(body, sign * image) for body, image in group.images]
            new.images += [p for p in images if not any(_same(p, q) for q in new.images)]
    groups.append(new)


def _same(one: tuple[Owner, Array], other: tuple[Owner, Array]) -> float:
    """1 or -1 if two axes are the same line of the same body, else 0."""
    if one[0] != other[0]:
        return 0.0
    for sign in (1.0, -1.0):
        if np.all(np.abs(one[1] - sign * other[1]) < 1e-9):
            return sign
    return 0.0
