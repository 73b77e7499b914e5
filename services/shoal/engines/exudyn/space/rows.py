"""Constraints that Exudyn has no joint for: products of directions, by user functions of the nodes' coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.space.bodies import Side
from shoal.trajectory import Array


class Row(NamedTuple):
    """The product of a direction of the first node and one of the second, as their frames have them, (3,) each.

    wanted: its value and the rate of that at a time [s].
    """

    first: Array
    second: Array
    wanted: Callable[[float], tuple[float, float]] = lambda _: (0.0, 0.0)


def add_rows(exu: Any, system: System, first: Side, second: Side, rows: list[Row]) -> None:
    """Enter constraints between two nodes."""

    def parts(q: Any) -> tuple[list[tuple[Array, Array, Row]], Array]:
        q = np.array(q)
        found, slope = [], np.zeros((len(rows), first.size + second.size))
        for number, row in enumerate(rows):
            (u, by_u), (w, by_w) = first.vector(q[: first.size], row.first), second.vector(q[first.size :], row.second)
            slope[number] = np.concatenate([w @ by_u, u @ by_w])
            found.append((u, w, row))
        return found, slope

    def gap(_mbs: Any, t: float, _item: int, q: Any, v: Any, of_rates: bool) -> Any:
        found, slope = parts(q)
        if of_rates:
            return slope @ np.array(v) - [row.wanted(t)[1] for _, _, row in found]
        return np.array([u @ w - row.wanted(t)[0] for u, w, row in found])

    def derivative(_mbs: Any, _t: float, _item: int, q: Any, _v: Any, _of_rates: bool) -> Any:
        return exu.MatrixContainer(parts(q)[1])

    markers = [system.add("MarkerNodeCoordinates", nodeNumber=side.node) for side in (first, second)]
    system.add(
        "ObjectConnectorCoordinateVector",
        markerNumbers=markers,
        scalingMarker0=np.zeros((len(rows), 1)),
        constraintUserFunction=gap,
        jacobianUserFunction=derivative,
    )


def hold_node(exu: Any, system: System, ground: Side, cable: Side, normals: Array, base: Array) -> None:
    """Keep a node of a cable in planes at rest through a place (3,) [m]; normals: (planes, 3)."""

    def gap(_mbs: Any, _t: float, _item: int, q: Any, v: Any, of_rates: bool) -> Any:
        return normals @ (np.array(v)[:3] if of_rates else np.array(q)[:3] - base)

    def derivative(_mbs: Any, _t: float, _item: int, _q: Any, _v: Any, _of_rates: bool) -> Any:
        return exu.MatrixContainer(np.hstack([normals, np.zeros((len(normals), cable.size - 3))]))

    system.add(
        "ObjectConnectorCoordinateVector",
        markerNumbers=[system.add("MarkerNodeCoordinates", nodeNumber=side.node) for side in (ground, cable)],
        scalingMarker0=np.zeros((len(normals), 1)),
        constraintUserFunction=gap,
        jacobianUserFunction=derivative,
    )
