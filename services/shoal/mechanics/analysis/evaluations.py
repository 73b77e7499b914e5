"""The compiled kernels behind `evaluate`: what of a state is asked for, one call each, by the address of the kernel.

A kernel that Python hands the structures themselves unpacks some three hundred arrays at every call, by code that takes
longer to compile than what it calls. Here they are written where kernels read them, once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers, structures
from shoal.compile.pointers import pointer, raw_type, shift
from shoal.compile.structures import Reference
from shoal.mechanics import constraints, contact_events, dynamics, functions, kernels
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work
from shoal.mechanics.model import Arrays, seen
from shoal.mechanics.numerics.tile import Array, Tile

_NOTHING = np.zeros(1)
_ADDRESSES: dict[tuple[Any, ...], int] = {}


def enter(arrays: Arrays, room: Work) -> None:
    """Write both structures where kernels read them; at first, and whenever one of their arrays is another."""
    structures.write(arrays.storage, seen(arrays))
    structures.write(room.storage, room)


def look(tile: Tile, arrays: Arrays, room: Work, t: float) -> tuple[Array, Array, Array, Array]:
    """Force (into room.a) and energies (room.energy) of the state in `room`, and its constraints.

    Returns residual, C_t, C_qq v v + C_tt, each (constraints, lanes), and the entries of C_q, flat.
    """
    width, count = len(tile), arrays.constraints.size
    ends = np.cumsum([count * width] * 3)
    out = np.zeros((3 * count + len(arrays.constraints.column)) * width)
    _run(_look, tile, arrays, room, t, 0.0, out)
    residual, rates, bias, jacobian = np.split(out, ends)
    return residual, rates, bias, jacobian


def elastic(tile: Tile, arrays: Arrays, room: Work) -> None:
    """The elastic part of the force, into room.a."""
    _run(_elastic, tile, arrays, room)


def accelerate(tile: Tile, arrays: Arrays, room: Work, t: float, tolerance: float) -> None:
    """The acceleration by Gauss's principle, into room.a."""
    _run(_accelerate, tile, arrays, room, t, tolerance)


def find_energies(tile: Tile, arrays: Arrays, room: Work) -> None:
    """The energies [J], into room.energy."""
    _run(_stored, tile, arrays, room)


def count_turns(tile: Tile, arrays: Arrays, room: Work) -> None:
    """Count the turns of angle forces."""
    _run(_remember, tile, arrays, room)


def follow_gaps(tile: Tile, arrays: Arrays, room: Work, q: Array, v: Array) -> tuple[Array, Array]:
    """Values and rates of the gaps along a motion of one lane, (samples, gaps); q, v: (samples, unknowns).

    Samples are less than half a turn apart, from the state of the room on.
    """
    samples, size = len(q), arrays.gaps.size
    out = np.concatenate([np.stack([q, v], axis=1).ravel(), np.zeros(2 * samples * size)])
    _run(_follow, tile, arrays, room, float(samples), 0.0, out)
    value, rate = out[-2 * samples * size :].reshape(2, samples, size)
    return value, rate


def rest(tile: Tile, arrays: Arrays, room: Work, t: float, tolerance: float) -> None:
    """The acceleration at rest, into room.a, with the contacts that touch closed, and sticking where they can."""
    _run(_rest, tile, arrays, room, t, tolerance)


def signatures(tile: Tile, arrays: Arrays, room: Work) -> list[kernels.Kernel]:
    """Return the kernels of all evaluations of a model, with the types of their arguments."""
    number, memory = types.float64, typeof(arrays.storage)
    called = _call, (types.int64, typeof(tile), memory, memory, number, number, typeof(_NOTHING))
    function = functions.evaluate, (typeof(arrays.functions), types.int64, number, types.int64)
    return [
        called,
        function,
        *((one, _kinds(tile, arrays, room)) for one in (_look, _elastic, _accelerate, _stored, _remember)),
    ]


def _run(
    kernel: Any,
    tile: Tile,
    arrays: Arrays,
    room: Work,
    t: float = 0.0,
    tolerance: float = 0.0,
    out: Array = _NOTHING,
) -> None:
    key = kernel.__name__, len(tile)
    if key not in _ADDRESSES:
        _ADDRESSES[key] = function_pointers.address(kernel, _kinds(tile, arrays, room))
    _call(_ADDRESSES[key], tile, arrays.storage, room.storage, float(t), tolerance, out)


def _kinds(tile: Tile, arrays: Arrays, room: Work) -> tuple[Any, ...]:
    number = types.float64
    structure = (Reference(raw_type(typeof(part))) for part in (seen(arrays), room))
    return typeof(tile), *structure, number, number, types.CPointer(number)


@njit(cache=True)
def _call(address: int, tile: Tile, arrays: Array, room: Array, t: float, tolerance: float, out: Array) -> None:
    function_pointers.call(address, (tile, pointer(arrays), pointer(room), t, tolerance, pointer(out)))


@njit(cache=True, error_model="numpy")
def _look(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    size = m.constraints.size * len(tile)
    derive(tile, m.derived, w.z, m.unknowns, m.rows, False)
    derive(tile, m.derived, w.zdot, m.unknowns, m.rows, True)
    kernels.force(tile, m, w, t, w.z, w.zdot, w.a)
    kernels.energies(tile, m, w)
    constraints.residual(tile, m.constraints, m.functions, t, w.z, out)
    constraints.rates(tile, m.constraints, m.functions, t, shift(out, size))
    constraints.bias(tile, m.constraints, m.functions, t, w.zdot, shift(out, 2 * size))
    constraints.jacobian(tile, m.constraints, w.z, 1.0, shift(out, 3 * size))


@njit(cache=True, error_model="numpy")
def _elastic(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    kernels.elastic_force(tile, m, w, w.z, w.a, False)


@njit(cache=True, error_model="numpy")
def _accelerate(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    kernels.acceleration(tile, m, w, t, w.z, w.zdot, tolerance, w.a)
    if m.gaps.size > 0:  # which touch without a force as well
        kernels.look(tile, m, w, w.z, w.zdot, True, True)


@njit(cache=True, error_model="numpy")
def _stored(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    kernels.energies(tile, m, w)


@njit(cache=True, error_model="numpy")
def _remember(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    dynamics.remember(tile, m, w)


@njit(cache=True, error_model="numpy")
def _rest(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    kernels.acceleration(tile, m, w, t, w.z, w.zdot, tolerance, w.a)
    if contact_events.touching(tile, m, w) > 0.0:
        kernels.decide(tile, m, w, t, tolerance)


@njit(cache=True, error_model="numpy")
def _follow(tile, m, w, t, tolerance, out):  # type: ignore[no-untyped-def]
    samples, n, size = int(t), m.unknowns, m.gaps.size
    for k in range(samples):
        for i in range(n):
            w.z[i], w.zdot[i] = out[2 * n * k + i], out[2 * n * k + n + i]
        dynamics.remember(tile, m, w)
        kernels.look(tile, m, w, w.z, w.zdot)
        for number in range(size):
            at = 2 * n * samples + size * k + number
            out[at], out[at + samples * size] = w.gaps.value[number], w.gaps.rate[number]
