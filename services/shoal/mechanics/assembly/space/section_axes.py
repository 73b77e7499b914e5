"""Vectors along the axes of a rod's section that joints need at a node, besides its slope and director.

A joint asks for a direction: the slope is one, whose length is free, and the director, a unit vector. Others are made
when first asked for, with a small inertia (`masses.ADDED`): the section's third axis, at right angles to both, and the
unit tangent, at right angles to the others.
"""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, combined
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.sections import ALIGNED
from shoal.mechanics.assembly.space.strained import section_at
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Scene


def field_of(scene: Scene, name: str) -> str:
    """Return the path of the joint or load of that name in the scene."""
    return f"joints.{name}" if name in scene.joints else f"loads.{name}"


def director_of(scene: Scene, name: str, result: SpatialPlacement, side: Attachment) -> tuple[Affine, int] | None:
    """The director of a rod at a place, and which axis of the section it is; None: the body has none.

    Raises InputError for a place between the nodes, which the joint or load `name` holds.
    """
    frame = result.frames.get(side.body)
    if not isinstance(frame, BeamFrame) or frame.element.director is None:
        return None
    place = scene.location(side)
    if (node := frame.node(place)) is None:
        apart, where = float(np.max(frame.element_length)), float(np.max(place[0]))
        raise InputError(
            f"{field_of(scene, name)}: holds the section of the director-rod {side.body} at {where:g} m, where it has "
            f"no node; use a point at a multiple of {apart:g} m, or other elements than {len(frame.nodes) - 1}"
        )
    return frame.nodes[node][2], frame.element.director


def along(scene: Scene, name: str, result: SpatialPlacement, side: Attachment, image: Array) -> Affine:
    """A vector of any length along an image in the frame of a body, or of a rod's section at a place."""
    if not is_stiff(scene, side.body) and np.all(np.abs(image[0]) > 1.0 - ALIGNED):
        return result.direction(scene, side) * np.asarray(np.sign(image[0]))
    return unit(scene, name, result, side, image)


def unit(scene: Scene, name: str, result: SpatialPlacement, side: Attachment, image: Array) -> Affine:
    """The unit vector that the frame of a body, or of a rod's section at a place, has so. Raises InputError."""
    if is_stiff(scene, side.body):
        return result.of_image(side, image)
    found = director_of(scene, name, result, side)
    if found is None:
        raise InputError(
            f"{field_of(scene, name)}: holds a section of {side.body}, and {scene.bodies[side.body].element} has none "
            "that turns about its axis; use element: director-rod, or a small rigid body between"
        )
    director, number = found
    image = np.where(np.abs(image) < ALIGNED, 0.0, image)
    axes = {number: director}
    if np.any(image[3 - number]) or np.any(image[0]):
        slope = result.direction(scene, side)
        axes[3 - number] = _axis(scene, name, result, side, 3 - number, (director, slope))
    if np.any(image[0]):
        axes[0] = _axis(scene, name, result, side, 0, (director, axes[3 - number]))
    return combined(tuple(axes.values()), tuple(image[axis] for axis in axes))


def _axis(
    scene: Scene, name: str, result: SpatialPlacement, side: Attachment, number: int, others: tuple[Affine, ...]
) -> Affine:
    """An axis of the section as a vector of its own, at right angles to others."""
    frame = result.frames[side.body]
    assert isinstance(frame, BeamFrame)
    node = frame.node(scene.location(side))
    assert node is not None
    if (node, number) not in frame.axes:
        value = section_at(scene, result, side)[:, number]
        made = result.new_vector(value, turns.cross(result.attitudes.spin(side.body), value))
        result.terms.dot(name, made, made, 0, -1.0)
        for other in others:
            result.terms.dot(name, made, other, 0)
        frame.axes[node, number] = made
    return frame.axes[node, number]
