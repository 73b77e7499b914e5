"""Constraints of joints on the direction of flexible rods, as dot products of directions.

The slope of a rod stretches, so that only its right angles can be held by products; a director is a unit vector. Two
sections hold each other by as many products of slopes and directors as they keep rotations; where these do not fix
the rotation, the section of one gets further axes as vectors (`section_axes`).
"""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.groups import is_stiff, product, transposed
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.section_axes import along, director_of, unit
from shoal.mechanics.assembly.space.sections import ALIGNED, image, turn_of
from shoal.mechanics.joints import Aligned, Square, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Scene

INDEPENDENT = 0.3
"""Sine of the angle between the rotation that a product keeps and those that others keep, from which it counts."""


def hold_rod(scene: Scene, name: str, condition: Aligned | Turned | Square, result: SpatialPlacement) -> None:
    """Add the constraints of a joint on the direction of a flexible rod: of a cable the axis only.

    Raises InputError for joints that a rod cannot have.
    """
    if isinstance(condition, Turned):
        _weld(scene, name, condition, result)
        return
    first, second = condition.first, condition.second
    if isinstance(condition, Square):
        axes = (first, condition.axis), (second, condition.second_axis)
        one, other = (
            along(scene, name, result, side, image(scene, result.attitudes, side, axis)) for side, axis in axes
        )
        result.terms.dot(name, one, other, 0)
    elif not is_stiff(scene, first.body) and not is_stiff(scene, second.body):
        _hold_common(scene, name, condition, result)
    elif is_stiff(scene, first.body):
        _hold_axis(scene, name, condition, first, second, result)
    else:
        _hold_axis(scene, name, condition, second, first, result)


def _hold_axis(
    scene: Scene, name: str, condition: Aligned, held: Attachment, rod: Attachment, result: SpatialPlacement
) -> None:
    """A rod keeps its direction towards an axis that another body has, or the section of another rod."""
    axis = unit(scene, name, result, held, image(scene, result.attitudes, held, condition.axis))
    slope, here = result.direction(scene, rod), image(scene, result.attitudes, rod, condition.axis)
    director = director_of(scene, name, result, rod)
    cosine = np.abs(here[0])
    if np.all(cosine < ALIGNED):
        result.terms.dot(name, axis, slope, 0)
        if director is not None:
            vector, number = director
            if np.all(np.abs(here[number]) < 1.0 - INDEPENDENT):
                result.terms.dot(name, axis, vector, 0, -here[number])
            else:
                normal = turns.cross(np.eye(3)[0][:, None], here)
                result.terms.dot(name, axis, along(scene, name, result, rod, normal), 0)
    elif np.all(cosine > 1.0 - ALIGNED):
        mine = image(scene, result.attitudes, held, condition.axis)
        for normal in turns.across(mine):
            result.terms.dot(name, along(scene, name, result, held, normal), slope, 0)
    elif director is not None:
        for normal in turns.across(here):
            result.terms.dot(name, axis, along(scene, name, result, rod, normal), 0)
    else:
        x, y, z = condition.axis or (1.0, 0.0, 0.0)
        raise InputError(
            f"joints.{name}.axis: ({x:g}, {y:g}, {z:g}) is neither along the rod {rod.body} nor at a right angle to "
            "it, and a cable has no section to hold another by; use element: director-rod, or put a small rigid body "
            "between them that holds the axis"
        )


def _hold_common(scene: Scene, name: str, condition: Aligned, result: SpatialPlacement) -> None:
    """An axis that two flexible rods have in common is one of a section; two cables have none and need not hold it."""
    sides = condition.first, condition.second
    images = [(side, image(scene, result.attitudes, side, condition.axis)) for side in sides]
    found = []
    for (side, here), (other, _) in (images, images[::-1]):
        if (director := director_of(scene, name, result, side)) is not None:
            found.append((float(np.min(np.abs(here[director[1]]))), side, other))
    if found:
        _, held, rod = max(found, key=lambda one: one[0])
        _hold_axis(scene, name, condition, held, rod, result)
    elif condition.axis is None:
        _go_on(scene, name, condition, result)


def _weld(scene: Scene, name: str, weld: Turned, result: SpatialPlacement) -> None:
    """A section keeps its direction in another body; a cable goes on in the line of another cable."""
    first, second = weld.first, weld.second
    before, after = (turn_of(result.attitudes, scene, side) for side in (first, second))
    relative = product(transposed(before), after) if weld.angle is None else turns.about_z(weld.angle)
    firm = [side for side in (first, second) if is_stiff(scene, side.body)]
    firm += [side for side in (first, second) if side not in firm and director_of(scene, name, result, side)]
    if not firm:
        _require_straight(name, weld, relative)
        _go_on(scene, name, weld, result)
        return
    if not is_stiff(scene, firm[0].body) and _keep_products(scene, name, weld, relative, result):
        return
    held, rod = (first, second) if firm[0] is first else (second, first)
    there = relative if held is first else transposed(relative)
    slope = result.direction(scene, rod)
    for normal in turns.across(there[:, 0]):
        result.terms.dot(name, along(scene, name, result, held, normal), slope, 0)
    if (director := director_of(scene, name, result, rod)) is not None:
        vector, number = director
        normal = turns.cross(there[:, 0], there[:, number])
        result.terms.dot(name, along(scene, name, result, held, normal), vector, 0)


def _require_straight(name: str, weld: Turned, relative: Array) -> None:
    """Raises InputError for two cables that are welded at an angle."""
    if np.any(np.abs(relative[0, 0]) < 1.0 - ALIGNED):
        degrees = np.degrees(np.arccos(np.clip(np.min(relative[0, 0]), -1.0, 1.0)))
        raise InputError(
            f"joints.{name}: welds the cables {weld.first.body} and {weld.second.body} at {degrees:.3g} degrees, and a "
            "cable has no section to hold another by; use element: director-rod for one of them, or put a small rigid "
            "body between them"
        )


def _go_on(scene: Scene, name: str, condition: Aligned | Turned, result: SpatialPlacement) -> None:
    """Two cables in one line."""
    one, other = (result.direction(scene, side) for side in (condition.first, condition.second))
    for skew in turns.skew(np.eye(3)).transpose(2, 0, 1):
        result.terms.form(name, one, other, skew, 0)


def _keep_products(scene: Scene, name: str, weld: Turned, relative: Array, result: SpatialPlacement) -> bool:
    """Return whether products of slopes and directors keep two sections as they are turned; if so, they are held.

    A product a . b of directions of both keeps the rotation about a x b.
    """
    axes = np.broadcast_to(np.eye(3)[..., None], relative.shape)
    sides = [_directions(scene, name, result, *one) for one in ((weld.first, axes), (weld.second, relative))]
    left = []
    for u, a, long in sides[0]:
        for w, b, wide in sides[1]:
            cosine = np.sum(a * b, axis=0)
            if not (long or wide) or np.all(np.abs(cosine) < ALIGNED):
                left.append((u, w, 0.0 * cosine if long or wide else cosine, turns.cross(a, b)))
    chosen = []
    for _ in range(len(sides[0]) + len(sides[1]) - 1):
        sizes = [float(np.min(np.sum(turn**2, axis=0))) for *_, turn in left]
        if max(sizes, default=0.0) < INDEPENDENT**2:
            return False
        u, w, cosine, best = left.pop(int(np.argmax(sizes)))
        chosen.append((u, w, cosine))
        along_best = turns.unit(best)
        left = [(*one, turn - along_best * np.sum(along_best * turn, axis=0)) for *one, turn in left]
    for u, w, cosine in chosen:
        result.terms.dot(name, u, w, 0, -cosine)
    return True


def _directions(
    scene: Scene, name: str, result: SpatialPlacement, side: Attachment, axes: Array
) -> list[tuple[Affine, Array, bool]]:
    """Slope and director of a rod at a place, what they are in a common frame, and whether their length is free."""
    found = [(result.direction(scene, side), axes[:, 0], True)]
    if (director := director_of(scene, name, result, side)) is not None:
        found.append((director[0], axes[:, director[1]], False))
    return found
