"""The compiled kernels behind `evaluate`: what of a state is asked for, one call each."""

from __future__ import annotations

from numba import njit

from shoal.compile.pointers import pointer, raw
from shoal.mechanics import constraints, kernels
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.dynamics import remember as count
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index, Tile


@njit(cache=True, error_model="numpy")
def look(
    tile: Tile, arrays: Arrays, room: Work, t: float, gap: Array, rate: Array, bias: Array, jacobian: Array
) -> None:
    """Force (into room.a), energies (room.energy) and constraints of the state in `room`."""
    m, w = raw(arrays), raw(room)
    kernels.enter(m, w)
    derive(tile, m.derived, w.z, m.unknowns, m.rows, False)
    derive(tile, m.derived, w.zdot, m.unknowns, m.rows, True)
    kernels.force(tile, m, w, t, w.z, w.zdot, w.a)
    kernels.energies(tile, m, w)
    constraints.residual(tile, m.constraints, m.functions, t, w.z, pointer(gap))
    constraints.rates(tile, m.constraints, m.functions, t, pointer(rate))
    constraints.bias(tile, m.constraints, m.functions, t, w.zdot, pointer(bias))
    constraints.jacobian(tile, m.constraints, w.z, 1.0, pointer(jacobian))


@njit(cache=True, error_model="numpy")
def elastic(tile: Tile, arrays: Arrays, room: Work) -> None:
    """The elastic part of the force, into room.a."""
    m, w = raw(arrays), raw(room)
    kernels.enter(m, w)
    kernels.elastic_force(tile, m, w, w.z, w.a, False)


@njit(cache=True, error_model="numpy")
def accelerate(tile: Tile, arrays: Arrays, room: Work, t: float, tolerance: float) -> None:
    """The acceleration by Gauss's principle, into room.a."""
    m, w = raw(arrays), raw(room)
    kernels.enter(m, w)
    kernels.acceleration(tile, m, w, t, w.z, w.zdot, tolerance, w.a)


@njit(cache=True, error_model="numpy")
def remember(tile: Tile, arrays: Arrays, room: Work) -> None:
    """Count the turns of angle forces."""
    m, w = raw(arrays), raw(room)
    count(tile, m, w)


@njit(cache=True, error_model="numpy")
def along(
    tile: Tile,
    arrays: Arrays,
    room: Work,
    way: Array,
    sample: Index,
    v: Array,
    times: Array,
    tolerance: float,
    a: Array,
    turns: Array,
) -> None:
    """Accelerations and the turns of angle forces at the poses of a way whose `sample` is one, not -1."""
    m, w = raw(arrays), raw(room)
    kernels.enter(m, w)
    for k in range(len(way)):
        room.z[: m.unknowns] = way[k]
        if k > 0:
            count(tile, m, w)
        n = sample[k]
        if n >= 0:
            room.zdot[: m.unknowns] = v[n]
            turns[n] = room.memory
            kernels.acceleration(tile, m, w, times[n], w.z, w.zdot, tolerance, w.a)
            a[n] = room.a[: m.unknowns]
