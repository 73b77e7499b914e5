"""Angles that friction, springs and motors measure or push about an axis, where flexible rods have it."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.assembly.space.section_axes import along, field_of, unit
from shoal.mechanics.assembly.space.sections import image
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Attachment, Revolute, Scene, Torque, TorsionSpring
from shoal.scene.record import Vector3

_ALONG = 0.9
"""Cosine from which the angle about an axis is not that of the x axis of a body or a section, but of its y axis."""


def make_axes(scene: Scene, result: SpatialPlacement) -> None:
    """The axes of sections that friction, torsion springs and motors will want, as vectors. Raises InputError."""
    for name, joint in scene.joints.items():
        if isinstance(joint, Revolute) and joint.resists:
            turning(scene, name, result, joint.first, joint.second, joint.axis)
    for name, load in scene.loads.items():
        if isinstance(load, TorsionSpring) and load.first_to is None and load.second_to is None:
            turning(scene, name, result, load.first, load.second, load.axis)
        elif isinstance(load, Torque) and load.reaction is not None:
            axis_of(scene, name, result, load.reaction, load.axis)


def axis_of(scene: Scene, name: str, result: SpatialPlacement, side: Attachment, axis: Vector3) -> Affine:
    """The unit vector of a body, or of a rod's section at a node, that points along an axis at the start."""
    return unit(scene, name, result, side, image(scene, result.attitudes, side, axis))


def turning(
    scene: Scene, name: str, result: SpatialPlacement, first: Attachment, second: Attachment, axis: Vector3
) -> tuple[Affine, Affine, Affine]:
    """Directions a, b and d, whose b . a and b . d are the cosine and sine of the angle about an axis, times a length.

    a and d are unit vectors at right angles to the axis, of the first side, or of the second where only that has them:
    the angle from there about the opposite axis is the same. Raises InputError, naming the joint or load, where neither
    has.
    """
    if all(is_stiff(scene, side.body) for side in (first, second)):
        return result.hinge(first, second, axis)
    if not _has_section(scene, result, first):
        if not _has_section(scene, result, second):
            raise InputError(
                f"{field_of(scene, name)}: turns about an axis, and neither {first.body} nor {second.body} has a "
                "section there that tells one; use element: director-rod for one of them, at one of its nodes"
            )
        x, y, z = axis
        return turning(scene, name, result, second, first, (-x, -y, -z))
    if not is_stiff(scene, first.body) and is_stiff(scene, second.body):
        x, y, z = axis
        return turning(scene, name, result, second, first, (-x, -y, -z))
    here, flat = _across(scene, result, first, axis)
    a, d = (unit(scene, name, result, first, one) for one in (flat, turns.cross(here, flat)))
    there, towards = _across(scene, result, second, axis)
    if _has_section(scene, result, second):
        return a, along(scene, name, result, second, towards), d
    if np.any(np.abs(there[0]) > _ALONG):
        raise InputError(
            f"{field_of(scene, name)}: turns about the axis of the cable {second.body}, which knows no turn about it"
        )
    return a, result.direction(scene, second), d


def _has_section(scene: Scene, result: SpatialPlacement, side: Attachment) -> bool:
    """Return whether a body has directions across any axis at a place: a rigid one, or a director rod at a node."""
    frame = result.frames.get(side.body)
    if not isinstance(frame, BeamFrame):
        return is_stiff(scene, side.body)
    return frame.element.director is not None and frame.node(scene.location(side)) is not None


def _across(scene: Scene, result: SpatialPlacement, side: Attachment, axis: Vector3) -> tuple[Array, Array]:
    """An axis in the frame of a body or a section, and the unit vector across it nearest to x, or y along x."""
    here = image(scene, result.attitudes, side, axis)
    flat = np.eye(3)[0 if np.all(np.abs(here[0]) < _ALONG) else 1][:, None]
    return here, turns.unit(flat - here * np.sum(here * flat, axis=0))
