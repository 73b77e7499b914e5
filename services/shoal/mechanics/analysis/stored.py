"""The compiled kernel behind `Evaluator.stored`: what springs hold along a motion, in one call."""

from __future__ import annotations

from numba import njit

from shoal.compile.pointers import raw
from shoal.mechanics import kernels
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Tile


@njit(cache=True, error_model="numpy")
def stored(tile: Tile, arrays: Arrays, room: Work, way: Array, turns: Array, energy: Array) -> None:
    """Strain energies [J] of poses, whose angle forces have counted some turns."""
    m, w = raw(arrays), raw(room)
    kernels.enter(m, w)
    for k in range(len(way)):
        room.z[: m.unknowns] = way[k]
        room.memory[:] = turns[k]
        derive(tile, m.derived, w.z, m.unknowns, m.rows, False)
        kernels.energies(tile, m, w)
        energy[k] = room.energy[1]
