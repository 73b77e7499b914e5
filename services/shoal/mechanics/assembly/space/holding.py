"""What sharing could not express of the joints in space, as constraints."""

from __future__ import annotations

from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine, combined, fixed
from shoal.mechanics.assembly.distances import keep_distance, keep_sum
from shoal.mechanics.assembly.groups import is_stiff
from shoal.mechanics.assembly.space.coordinates import SpatialPlacement
from shoal.mechanics.frames import BeamFrame, RigidFrame
from shoal.mechanics.joints import Aligned, Along, Apart, Geared, Hinged, InPlane, Meet, Square, Sum, Turned
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.plane import vector
from shoal.scene import GROUND, Attachment, Scene


def hold(scene: Scene, result: SpatialPlacement) -> None:
    """What sharing could not express of the joints' conditions."""
    for name, condition in joints.of_scene(scene):
        before = len(result.terms.held)
        if isinstance(condition, Geared):
            _keep_mesh(name, condition, result)
        elif isinstance(condition, Meet) and condition.held:
            result.terms.vanish(name, result.gap(scene, condition))
        elif not isinstance(condition, Meet | Turned | Aligned):  # shared, or constraints where loops close
            _keep(scene, name, condition, result)
        result.terms.press(name, condition, before)


def direction(result: SpatialPlacement, body: str, axis: Any) -> Affine:
    """The unit vector of a rigid body or the ground that points along an axis at the start; None: its x axis."""
    image = result.attitudes.image(body, axis)
    return of_image(result, body, image)


def of_image(result: SpatialPlacement, body: str, image: Any) -> Affine:
    """The vector of a rigid body or the ground that its own frame has so."""
    if body == GROUND:
        return fixed(image)
    if not isinstance(result.frames[body], RigidFrame):
        raise InputError(f"{body} is flexible; in space only a rigid body holds an axis, a line or an angle")
    return combined(result.attitudes.kept.of_body(body), tuple(image))


def hinge(
    scene: Scene, result: SpatialPlacement, first: Attachment, second: Attachment, axis: Any
) -> tuple[Affine, Affine, Affine]:
    """Directions at right angles to an axis: of the first body, of the second, and the first's turned by 90 degrees.

    Both are images of the bodies' x axes, or of another where that is along the axis.
    """
    found = []
    for side in (first, second):
        image = result.attitudes.image(side.body, axis)
        along = np.eye(3)[0 if np.all(np.abs(image[0]) < 0.9) else 1][:, None]
        flat = turns.unit(along - image * np.sum(image * along, axis=0))
        found.append((side.body, image, flat))
    (body, image, flat), (other, _, there) = found
    ahead = turns.cross(image, flat)
    if isinstance(result.frames.get(other), BeamFrame):
        towards = result.direction(scene, second)
    else:
        towards = of_image(result, other, there)
    return of_image(result, body, flat), towards, of_image(result, body, ahead)


def _keep(scene: Scene, name: str, condition: Any, result: SpatialPlacement) -> None:
    terms = result.terms
    if isinstance(condition, Along):
        if not condition.is_fixed:
            body = condition.first.body
            _require_rigid(scene, name, body)
            for normal in turns.across(_line(result, body, condition.direction)):
                terms.dot(name, of_image(result, body, normal), result.gap(scene, condition), 1)
    elif isinstance(condition, InPlane):
        gap = result.point(scene, condition.second) - result.point(scene, condition.first)
        terms.dot(name, direction(result, condition.first.body, condition.axis), gap, 1)
    elif isinstance(condition, Square):
        if not all(is_stiff(scene, side.body) for side in (condition.first, condition.second)):
            return  # see `rod_joints`
        one = direction(result, condition.first.body, condition.axis)
        terms.dot(name, one, direction(result, condition.second.body, condition.second_axis), 0)
    elif isinstance(condition, Hinged):
        a, b, ahead = hinge(scene, result, condition.first, condition.second, condition.axis)
        terms.dot(name, a, b, 0, drive=condition.angle.through("cos", "neg"))
        terms.dot(name, ahead, b, 0, drive=condition.angle.through("sin", "neg"))
    elif isinstance(condition, Apart):
        keep_distance(scene, name, condition, result)
    elif isinstance(condition, Sum):
        keep_sum(scene, name, condition, result)
    else:
        raise joints.unknown(condition)


def _keep_mesh(name: str, condition: Geared, result: SpatialPlacement) -> None:
    """Each angle is that of a vector across an axis at rest, so that two of its components tell it, as in the plane."""
    parts = []
    for side, axis, factor in zip(condition.sides, condition.axes, condition.factors, strict=True):
        if side.body == GROUND or not factor:
            continue
        if not isinstance(result.frames[side.body], RigidFrame):
            raise InputError(f"joints.{name}: turns {side.body}, which is not rigid; weld a rigid body to it instead")
        if not rests(direction(result, side.body, axis)):
            told = ", ".join(f"{np.ravel(part)[-1]:g}" for part in axis)
            raise InputError(
                f"joints.{name}: {side.body} does not turn about an axis at rest, ({told}) at the start; gears in "
                "space turn on hinges whose axes the ground holds"
            )
        image = result.attitudes.image(side.body, axis)
        across = of_image(result, side.body, turns.across(image)[0])
        one, other = turns.across(turns.unit(vector(*axis)))
        frame = np.stack(np.broadcast_arrays(one, other, turns.cross(one, other)))
        parts.append((factor, across.turned(frame)))
    result.terms.mesh(name, tuple(parts), 0.0, 2 * np.pi / condition.most)


def rests(vector: Affine) -> bool:
    """Return whether a vector depends on the coordinates by no more than round-off."""
    return all(np.max(np.abs(coefficient)) <= 1e-12 for coefficient in vector.terms.values())


def _line(result: SpatialPlacement, body: str, along: Any) -> Array:
    """The unit vector of a line in a body's frame: of an axis at the start, or at an angle in the frame."""
    if isinstance(along, tuple):
        return result.attitudes.image(body, along)
    return turns.about_z(along)[:, 0]


def line_of(result: SpatialPlacement, body: str, along: Any) -> Affine:
    """The direction of a line that a body holds."""
    return of_image(result, body, _line(result, body, along))


def _require_rigid(scene: Scene, name: str, body: str) -> None:
    if body != GROUND and scene.bodies[body].element != "rigid":
        raise InputError(f"joints.{name}.first.body: {body} is flexible; in space a line is held by a rigid body")
