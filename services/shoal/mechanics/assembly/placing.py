"""Steps of placing bodies in the plane and in space: moving points, the order of bodies, point masses, constraints.

The walk over the bodies stays twice (`placement`, `space.placement`): one with rules of either as parameters was 23
lines longer, as directors, poses and what leads a body differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics.assembly.coordinates import Placement, Pose
from shoal.mechanics.assembly.groups import JointPoint, is_stiff, moving
from shoal.mechanics.fitting import start_slope, start_value
from shoal.mechanics.frames import PointFrame
from shoal.mechanics.joints import Along, Turned
from shoal.mechanics.ropes import Reeved
from shoal.mechanics.sums import Sum
from shoal.scene import GROUND, Function, Scene


def place_driver(name: str, path: Sequence[Function], points: Sequence[JointPoint], result: Placement) -> None:
    """A moving point of the ground is a vector that constraints drive. Raises InputError."""
    place, rate = (np.array([[part(coordinate)] for coordinate in path]) for part in (start_value, start_slope))
    vector = result.new_vector(place, rate)
    result.drivers[moving(name)] = vector
    result.terms.vanish(f"{GROUND}.{name}", vector, tuple(coordinate.through("neg") for coordinate in path))
    for point in points:
        if point.touches(moving(name)):
            if point.where is not None:
                raise InputError(f"joints.{point.name}: joins the moving point {name} to a fixed one")
            point.where = vector


def next_body(
    scene: Scene, waiting: list[str], touching: Mapping[str, Sequence[JointPoint]], is_led: Callable[[str], bool]
) -> str:
    """The next body whose start is known: by a joint point, by its own field, by a line, by what else leads it."""
    known: list[Callable[[str], bool]] = [
        lambda name: any(point.where is not None for point in touching[name]),
        lambda name: scene.start(name).position is not None,
        lambda name: any(point.line for point in touching[name]),
        is_led,
    ]
    for is_known in known:
        for name in waiting:
            if is_known(name):
                return name
    return waiting[0]


def place_point(name: str, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    """Give a point mass its coordinates, those of its joint if it has one."""
    for point in mine[:1]:
        point.where = point.where or result.make(point, pose.position, pose.velocity)
    origin = mine[0].where if mine else result.new_vector(pose.position, pose.velocity)
    assert origin is not None
    result.frames[name] = PointFrame(name, origin)


def hold(scene: Scene, result: Placement) -> None:
    """Add the terms of all conditions that bodies do not share. Raises InputError for what a rod cannot keep."""
    for name, joint in scene.joints.items():
        conditions = joints.conditions(joint, scene.dimensions)
        for condition in conditions:
            before = len(result.terms.held)
            _require_able(scene, name, condition)
            if not result.shares(condition, condition is joints.weld_of(conditions)):
                condition.constrain(name, result)
            result.terms.press(name, condition, before)


def _require_able(scene: Scene, name: str, condition: object) -> None:
    """Raise InputError where a flexible rod would have to turn by an angle, or in space to hold a line."""
    flexible = "a flexible rod; weld a rigid body to it instead"
    if isinstance(condition, Turned) and condition.driven:
        if not all(is_stiff(scene, side.body) for side in (condition.first, condition.second)):
            raise InputError(f"joints.{name}: drives the angle of {flexible}")
    elif isinstance(condition, Sum | Reeved) and scene.dimensions == 2:
        if not all(is_stiff(scene, side.body) for side in condition.turned(scene)):
            raise InputError(f"joints.{name}: turns {flexible}")
    elif isinstance(condition, Along) and scene.dimensions == 3 and not condition.is_fixed:
        body = condition.first.body
        if not is_stiff(scene, body):
            raise InputError(f"joints.{name}.first.body: {body} is flexible; in space a line is held by a rigid body")
