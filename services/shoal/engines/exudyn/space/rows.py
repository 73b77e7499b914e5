"""Constraints that Exudyn has no joint for: products of directions, by user functions of the nodes' coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shoal.engines.exudyn import user
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.space.bodies import Side
from shoal.trajectory import Array


class Row(NamedTuple):
    """The product of a direction of the first node and one of the second, as their frames have them, (3,) each.

    wanted: its value and the rate of that at a time [s], else 0; of all rows of a constraint or of none.
    """

    first: Array
    second: Array
    wanted: Callable[[float], tuple[float, float]] | None = None


def add_rows(exu: Any, system: System, first: Side, second: Side, rows: list[Row]) -> None:
    """Enter constraints between two nodes."""
    sides = first.size, [row.first for row in rows], [row.second for row in rows]
    wanted = [row.wanted for row in rows if row.wanted is not None]
    markers = [system.add("MarkerNodeCoordinates", nodeNumber=side.node) for side in (first, second)]
    system.add(
        "ObjectConnectorCoordinateVector",
        markerNumbers=markers,
        scalingMarker0=np.zeros((len(rows), 1)),
        constraintUserFunction=system.function(user.products_gap, *sides, wanted),
        jacobianUserFunction=system.function(user.products_slope, exu, *sides),
    )


class Toothed(NamedTuple):
    """A node whose body turns about an axis at rest.

    factor: of its angle. image: a direction of its body across the axis, in its frame; axes: two of the ground's
    between which that turns, (2, 3).
    """

    node: Side
    factor: float
    image: Array
    axes: Array


def add_teeth(exu: Any, system: System, sides: tuple[Toothed, Toothed], period: float) -> None:
    """Keep the sum of angles at zero, but for multiples of a period [rad]."""
    size, parts = sides[0].node.size, [(one.factor, one.image, one.axes) for one in sides]
    system.add(
        "ObjectConnectorCoordinateVector",
        markerNumbers=[system.add("MarkerNodeCoordinates", nodeNumber=one.node.node) for one in sides],
        scalingMarker0=np.zeros((1, 1)),
        constraintUserFunction=system.function(user.teeth_gap, size, parts, period),
        jacobianUserFunction=system.function(user.teeth_slope, exu, size, parts, period),
    )


def hold_node(exu: Any, system: System, ground: Side, cable: Side, normals: Array, base: Array) -> None:
    """Keep a node of a cable in planes at rest through a place (3,) [m]; normals: (planes, 3)."""
    system.add(
        "ObjectConnectorCoordinateVector",
        markerNumbers=[system.add("MarkerNodeCoordinates", nodeNumber=side.node) for side in (ground, cable)],
        scalingMarker0=np.zeros((len(normals), 1)),
        constraintUserFunction=system.function(user.planes_gap, normals, base),
        jacobianUserFunction=system.function(user.planes_slope, exu, normals, cable.size),
    )
