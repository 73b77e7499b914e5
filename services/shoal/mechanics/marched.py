"""What a march leaves behind, and the room of its loop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import constraints
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index, Tile


class Marched(NamedTuple):
    """What a march leaves behind. samples: (times * markers * sampled(d), lanes), see `sampled`; the rest: (lanes,).

    energy_error: largest |E + dissipated - E(0)| [J]; energy_scale: largest kinetic + elastic energy [J];
    drift: largest violation of a constraint by its power of a length, (POWERS * lanes,);
    begin: coordinates and rates at the start, made consistent, (2 * unknowns, lanes).
    Common to the lanes of a tile: steps taken, evaluations of the forces, the time reached [s].
    """

    samples: Array
    energy_error: Array
    energy_scale: Array
    drift: Array
    begin: Array
    steps: Array
    evaluations: Array
    reached: Array


class LoopRoom(NamedTuple):
    """What the loop keeps between steps.

    past: coordinates, rates and accelerations at the beginning of the step, (3 * unknowns, lanes). q, v: the motion
    inside it, (rows, lanes). turns [rad], above: whole turns of every marker's direction, and on which side of the x
    axis it was, (markers, lanes). energy, start, dissipated [J], power, last_power [W]: (lanes,). gap, elongation: by
    constraint and by force element.
    """

    past: Array
    q: Array
    v: Array
    turns: Array
    above: Array
    energy: Array
    start: Array
    dissipated: Array
    power: Array
    last_power: Array
    gap: Array
    elongation: Array


@njit(cache=True)
def sampled(dimensions: int) -> int:
    """Numbers in the sample of a marker.

    Its point, its direction, the continuous angle [rad] of that at the end of the step, its velocity [m/s] and the
    rate of its direction [rad/s].
    """
    return 3 * dimensions + 2


@njit(cache=True, error_model="numpy")
def rooms(tile: Tile, arrays: Arrays, times: int, marker_rows: Index) -> tuple[Marched, LoopRoom]:
    """An empty record, and the room of the loop."""
    width, dimensions = len(tile), len(arrays.space)
    end, rows = arrays.unknowns * width, arrays.rows * width
    markers = marker_rows.size // (2 * dimensions)
    record = Marched(
        np.full(times * sampled(dimensions) * markers * width, np.nan),
        np.zeros(width),
        np.zeros(width),
        np.zeros(constraints.POWERS * width),
        np.zeros(2 * end),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
    )
    room = LoopRoom(
        np.empty(3 * end),
        np.zeros(rows),
        np.zeros(rows),
        np.zeros(markers * width),
        np.zeros(markers * width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.empty(arrays.constraints.size * width),
        np.zeros(arrays.forces.size * width),
    )
    return record, room
