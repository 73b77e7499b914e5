"""What the plane and space share of placing bodies: moving points of the ground, the order of bodies, point masses.

The walk over the bodies stays twice (`placement`, `space.placement`): one with rules of either as parameters was 23
lines longer, as directors, poses and what leads a body differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.groups import JointPoint, moving
from shoal.mechanics.assembly.pose import Pose, value_and_rate
from shoal.mechanics.frames import PointFrame
from shoal.scene import GROUND, Function, Scene


def place_driver(name: str, path: Sequence[Function], points: Sequence[JointPoint], result: Placement) -> None:
    """A moving point of the ground is a vector that constraints drive. Raises InputError."""
    begin = np.array([value_and_rate(coordinate) for coordinate in path])
    vector = result.new_vector(begin[:, :1], begin[:, 1:])
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
