"""The ground inside Exudyn, and points of it that move as functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from shoal.engines.course import Course
from shoal.engines.exudyn.bodies import Energy, Motion, Place, RigidPart, System
from shoal.engines.poses import InitialPose
from shoal.errors import InputError
from shoal.scene import Function, MovingPoint, PointMass
from shoal.trajectory import Array

Coordinate = tuple[Any, int]
"""A node and the number of one of its coordinates."""


@dataclass(frozen=True)
class GroundPart:
    """ObjectGround, and a node whose coordinates are zero, against which coordinates are driven."""

    body: Any
    node: Any

    @classmethod
    def add(cls, system: System) -> GroundPart:
        """Enter the ground."""
        body = system.mbs.AddObject(system.items.ObjectGround())
        return cls(body, system.mbs.AddNode(system.items.NodePointGround()))

    def hold(self, system: System, place: Place) -> Any:
        """See Part."""
        return system.marker("MarkerBodyPosition", self.body, place)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Part."""
        return system.turned(self.body, place, angle)

    def motion(self, q: Array, v: Array, place: Place) -> Motion:
        """See Part."""
        still = np.zeros(len(q))
        return Motion(np.tile(place, (len(q), 1)).astype(float), np.zeros((len(q), 2)), still, still)

    def energy(self, q: Array, v: Array) -> Energy:
        """See Part."""
        return Energy(np.zeros(len(q)), np.zeros(len(q)), np.zeros((len(q), 2)))

    def damping(self, q: Array, v: Array) -> Array:
        """See Part."""
        return np.zeros(len(q))


def add_moving_point(system: System, ground: GroundPart, name: str, path: MovingPoint, pose: InitialPose) -> RigidPart:
    """Enter a point of the ground that moves: a body whose three coordinates are all driven, so its mass is idle."""
    part = RigidPart.add(system, PointMass(mass=1.0), pose)
    for axis, f in enumerate((path.x, path.y)):
        course = driven(system, f, f"ground_points.{name}")
        drive(system, (ground.node, 0), (part.node, axis), partial(_moved, course, course.value(0.0)), course.slope)
    drive(system, (ground.node, 0), (part.node, 2), lambda t: 0.0, lambda t: 0.0)
    return part


def driven(system: System, f: Function, field: str) -> Course:
    """A prescribed position. Raises InputError where its rate jumps: Exudyn knows no impact there."""
    try:
        course = system.clock.course(f, held=True)
    except InputError as error:
        raise InputError(f"{field}: {str(error).removeprefix('function: ')}") from None
    if jumps := course.jumps():
        raise InputError(f"{field}: engine exudyn cannot do a drive whose rate jumps, at t = {jumps[0]:.7g}; use gauss")
    return course


def _moved(course: Course, begin: float, time: float) -> float:
    return course.value(time) - begin


def drive(
    system: System,
    first: Coordinate,
    second: Coordinate,
    offset: Callable[[float], float],
    rate: Callable[[float], float],
) -> None:
    """Keep second - first equal to a function of time with its rate; coordinates count from the start."""
    markers = [
        system.mbs.AddMarker(system.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        for node, coordinate in (first, second)
    ]
    system.mbs.AddObject(
        system.items.ObjectConnectorCoordinate(
            markerNumbers=markers,
            offsetUserFunction=lambda mbs, t, item, given: offset(t),
            offsetUserFunction_t=lambda mbs, t, item, given: rate(t),
        )
    )
