"""The ground inside Exudyn, and points of it that move as functions of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from shoal.engines.course import PiecewiseFunction
from shoal.engines.exudyn import user
from shoal.engines.exudyn.bodies import Holder, Place, PointMotion, RigidPart, System
from shoal.engines.poses import InitialPose
from shoal.errors import InputError
from shoal.scene import Function, MovingPoint, PointMass
from shoal.trajectory import Array

Coordinate = tuple[Any, int]
"""A node and the number of one of its coordinates."""


@dataclass(frozen=True)
class GroundPart(Holder):
    """ObjectGround, and a node whose coordinates are zero, against which coordinates are driven."""

    body: Any
    node: Any

    @classmethod
    def add(cls, system: System) -> Self:
        """Enter the ground."""
        return cls(system.add("ObjectGround"), system.add("NodePointGround"))

    def hold(self, system: System, place: Place) -> Any:
        """See Holder."""
        return system.marker("MarkerBodyPosition", self.body, place)

    def turn(self, system: System, place: Place, angle: float = 0.0) -> Any:
        """See Holder."""
        return system.turned(self.body, place, angle)

    def motion(self, q: Array, v: Array, place: Place) -> PointMotion:
        """See Holder."""
        still = np.zeros(len(q))
        return PointMotion(np.tile(place, (len(q), 1)).astype(float), np.zeros((len(q), 2)), still, still)


def add_moving_point(system: System, ground: GroundPart, name: str, path: MovingPoint, pose: InitialPose) -> RigidPart:
    """Enter a point of the ground that moves: a body whose three coordinates are all driven, so its mass is idle."""
    part = RigidPart.add(system, PointMass(mass=1.0), pose)
    for axis, f in enumerate((path.x, path.y)):
        drive(system, (ground.node, 0), (part.node, axis), driven(system, f, f"ground_points.{name}"))
    drive(system, (ground.node, 0), (part.node, 2), system.course(Function(number=0.0), f"ground_points.{name}"))
    return part


def driven(system: System, f: Function, field: str) -> PiecewiseFunction:
    """A prescribed position. Raises InputError where its rate jumps: Exudyn knows no impact there."""
    course = system.course(f, field, held=True)
    if jumps := course.jumps():
        raise InputError(f"{field}: engine exudyn cannot do a drive whose rate jumps, at t = {jumps[0]:.7g}; use gauss")
    return course


def mesh(system: System, first: Coordinate, second: Coordinate, ratio: float) -> None:
    """Let second be `ratio` times first; Exudyn counts coordinates from the start."""
    # Its constraint is factor1 times the coordinate of marker 1, less that of marker 0.
    system.add("ObjectConnectorCoordinate", markerNumbers=coordinates(system, second, first), factor1=ratio)


def coordinates(system: System, *of: Coordinate) -> list[Any]:
    """New markers on coordinates of nodes."""
    return [system.add("MarkerNodeCoordinate", nodeNumber=node, coordinate=number) for node, number in of]


def drive(system: System, first: Coordinate, second: Coordinate, course: PiecewiseFunction) -> None:
    """Let second - first follow a function of time; Exudyn counts coordinates from the start."""
    markers = coordinates(system, first, second)
    system.add(
        "ObjectConnectorCoordinate",
        markerNumbers=markers,
        offsetUserFunction=system.function(user.offset, course.value),
        offsetUserFunction_t=system.function(user.offset_rate, course.slope),
    )
