"""Axes that joints keep common to bodies: shared unit vectors, as joint points are shared places."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.mechanics import joints
from shoal.mechanics.affine import Affine, fixed
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.attitudes import Attitudes
from shoal.mechanics.joints import Aligned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import GROUND, Scene


@dataclass
class JointAxis:
    """A unit vector that bodies have in common; `where` is known once one of them is placed.

    images: bodies and the vector in their frames, (3, lanes). made: a body's own constraints keep its length.
    """

    name: str
    images: list[tuple[str, Array]]
    where: Affine | None = None
    holders: set[str] = field(default_factory=set)

    def local(self, body: str) -> Array:
        """The vector in a body's frame."""
        return next(image for owner, image in self.images if owner == body)

    def touches(self, body: str) -> bool:
        """Whether a body has this axis."""
        return any(owner == body for owner, _ in self.images)


def joint_axes(scene: Scene, attitudes: Attitudes) -> list[JointAxis]:
    """Group the axes that joints let coincide, transitively; those of flexible rods are held by constraints."""
    groups: list[JointAxis] = []
    for name, condition in joints.of_scene(scene):
        if not isinstance(condition, Aligned):
            continue
        sides = [side.body for side in (condition.first, condition.second)]
        if all(is_stiff(scene, side) for side in sides):
            images = [(side, attitudes.image(side, condition.axis)) for side in sides]
            if condition.axis is None and _opposed(attitudes, images):
                images[1] = sides[1], -images[1][1]
            _merge(groups, JointAxis(name, images))
    for group in groups:
        for body, image in group.images:
            if body == GROUND:
                group.where = fixed(image)
                group.holders.add(GROUND)
    return groups


def _opposed(attitudes: Attitudes, images: list[tuple[str, Array]]) -> bool:
    """Whether two directions point away from each other at the start."""
    one, other = (attitudes.rotation(body)[:, 0, 0] for body, _ in images)
    return bool(one @ other < 0)


def _merge(groups: list[JointAxis], new: JointAxis) -> None:
    for group in list(groups):
        sign = next((s for p in group.images for q in new.images if (s := _same(p, q))), 0.0)
        if sign:
            groups.remove(group)
            images = [(body, sign * image) for body, image in group.images]
            new.images += [p for p in images if not any(_same(p, q) for q in new.images)]
    groups.append(new)


def _same(one: tuple[str, Array], other: tuple[str, Array]) -> float:
    """1 or -1 if two axes are the same line of the same body, else 0."""
    if one[0] != other[0]:
        return 0.0
    for sign in (1.0, -1.0):
        if np.all(np.abs(one[1] - sign * other[1]) < 1e-9):
            return sign
    return 0.0
