"""The explicit Runge-Kutta method of Dormand and Prince of order 8 with step control and its own dense output.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.10; the coefficients stand in
`dop853_tableau`. After each step the drift from the constraints is projected away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.compile.pointers import raw
from shoal.mechanics import kernels
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators import control
from shoal.mechanics.integrators.control import RESOLUTION, Control, control_room
from shoal.mechanics.integrators.dop853_tableau import DENSE, ERROR_3, ERROR_5, INSTANTS, STAGES, WEIGHTS
from shoal.mechanics.integrators.scheme import Facts, implement
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile
from shoal.scene import Solver

ORDER_OF_ERROR = 8


class Dop853(NamedTuple):
    """Settings and room.

    slope_q, slope_v: rates and accelerations of the stages, (16 * unknowns, lanes). stage_q, stage_v, stage_a: one
    state, (rows, lanes). begin, dense: when the last step began [s], and whether its dense stages are there, from which
    the highest coefficients of its polynomials follow, part_q, part_v, (4 * unknowns, lanes).
    """

    rank_tolerance: float
    control: Control
    slope_q: Array
    slope_v: Array
    stage_q: Array
    stage_v: Array
    stage_a: Array
    part_q: Array
    part_v: Array
    begin: Array
    dense: Array
    evaluations: Array


FACTS = Facts(
    order=8,
    explicit=True,
    adaptive=True,
    constraint_forces=True,
    sparse_constraints=True,
    warm_lanes=True,
    stages=12,
    good_for="rigid machines, and references: any accuracy for few evaluations where nothing is stiff",
)


def settings(solver: Solver, model: Model, tile: Tile, lanes: slice) -> Dop853:
    """Settings for one tile of lanes."""
    end, state = model.unknowns * len(tile), model.rows * len(tile)
    sizes = (16 * end, 16 * end, state, state, state, 4 * end, 4 * end, 1, 1, 1)
    return Dop853(solver.rank_tolerance, control_room(solver, tile), *(np.zeros(size) for size in sizes))


@njit(cache=True, error_model="numpy")
def _stage(tile: Tile, scheme: Dop853, m: Arrays, w: Work, h: float, number: int, q: Array, v: Array) -> None:
    """Coordinates and rates of a stage, from w.before and the slopes of the stages before it. Uses w.stage."""
    end = m.unknowns * len(tile)
    slope_q, slope_v = scheme.slope_q, scheme.slope_v
    for i in range(2 * end):
        w.stage[i] = 0.0
    for j in range(number):
        weight = WEIGHTS[number, j]
        if weight != 0.0:
            for i in range(end):
                w.stage[i] += weight * slope_q[j * end + i]
                w.stage[end + i] += weight * slope_v[j * end + i]
    for i in range(end):
        q[i] = w.before[i] + h * w.stage[i]
        v[i] = w.before[end + i] + h * w.stage[end + i]


@njit(cache=True, error_model="numpy")
def _keep(tile: Tile, scheme: Dop853, m: Arrays, number: int, v: Array, a: Array) -> None:
    """The slopes of a stage."""
    end = m.unknowns * len(tile)
    slope_q, slope_v = scheme.slope_q, scheme.slope_v
    for i in range(end):
        slope_q[number * end + i] = v[i]
        slope_v[number * end + i] = a[i]


@njit(cache=True, error_model="numpy")
def _errors(tile: Tile, scheme: Dop853, m: Arrays, h: float) -> None:
    """The error of every lane from the methods of order 3 and 5 inside (Hairer, Norsett, Wanner I, eq. II.10.17)."""
    width = len(tile)
    end = m.unknowns * width
    slope_q, slope_v = scheme.slope_q, scheme.slope_v
    c = scheme.control
    for lane in range(width):
        third, fifth = 0.0, 0.0
        for i in range(lane, end, width):
            q3, q5, v3, v5 = 0.0, 0.0, 0.0, 0.0
            for j in range(STAGES):
                q3, q5 = q3 + ERROR_3[j] * slope_q[j * end + i], q5 + ERROR_5[j] * slope_q[j * end + i]
                v3, v5 = v3 + ERROR_3[j] * slope_v[j * end + i], v5 + ERROR_5[j] * slope_v[j * end + i]
            third += (q3 * c.weight_q[lane]) ** 2 + (v3 * c.weight_v[lane]) ** 2
            fifth += (q5 * c.weight_q[lane]) ** 2 + (v5 * c.weight_v[lane]) ** 2
        both = fifth + 0.01 * third
        c.error[lane] = h * fifth / np.sqrt(both * 2 * m.unknowns) if both != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def step(tile: Tile, scheme: Dop853, m: Arrays, w: Work, t: float, h: float) -> float:
    """One step from the time t, of at most h [s]; returns its length. w.a holds the acceleration before and after."""
    rest, room = h, raw(scheme)
    c = room.control
    room.begin[0], room.dense[0] = t, 0.0
    if not control.begin(tile, m, w, c, t):
        return rest
    _keep(tile, room, m, 0, w.zdot, w.a)
    h = control.first_trial(c, rest)
    rejected = False
    while True:
        for number in range(1, STAGES):
            _stage(tile, room, m, w, h, number, w.z, w.zdot)
            kernels.acceleration(
                tile, m, w, t + INSTANTS[number] * h, w.z, w.zdot, room.rank_tolerance, w.a
            )  # fmt: skip
            _keep(tile, room, m, number, w.zdot, w.a)
        room.evaluations[0] += STAGES - 1
        _stage(tile, room, m, w, h, STAGES, w.z, w.zdot)
        control.weigh(tile, m, w, c)
        _errors(tile, room, m, h)
        error = control.worst(tile, c)
        if error <= 1.0:
            break
        rejected = True
        h = control.shorter(error, h, ORDER_OF_ERROR)
        if h < RESOLUTION * (t + rest):
            if not control.give_up(tile, m, w, c, t):
                return rest
            h = control.first_trial(c, rest)
    control.accept(c, error, h, ORDER_OF_ERROR, rejected)
    kernels.settle(tile, m, w, t + h, room.rank_tolerance, found=True)
    kernels.acceleration(tile, m, w, t + h, w.z, w.zdot, room.rank_tolerance, w.a)
    room.evaluations[0] += 1
    return h


@njit(cache=True, error_model="numpy")
def inside(tile: Tile, scheme: Dop853, m: Arrays, w: Work, past: Array, x: float, h: float, q: Array, v: Array) -> None:
    """The motion at the fraction x of the last step, of order 7; the three stages it needs are made on demand."""
    room = raw(scheme)
    end = m.unknowns * len(tile)
    slope_q, slope_v = room.slope_q, room.slope_v
    if room.dense[0] == 0.0:
        room.dense[0] = 1.0
        room.evaluations[0] += 3
        _keep(tile, room, m, STAGES, w.zdot, w.a)
        q_, v_, a_ = room.stage_q, room.stage_v, room.stage_a
        for number in range(STAGES + 1, 16):
            _stage(tile, room, m, w, h, number, q_, v_)
            instant = room.begin[0] + INSTANTS[number] * h
            kernels.acceleration(tile, m, w, instant, q_, v_, room.rank_tolerance, a_)
            _keep(tile, room, m, number, v_, a_)
        _sum(end, slope_q, room.part_q)
        _sum(end, slope_v, room.part_v)
    for i in range(end):
        q[i] = w.before[i] + _dense(end, i, slope_q, room.part_q, w.z[i] - w.before[i], x, h)
        v[i] = w.before[end + i] + _dense(end, i, slope_v, room.part_v, w.zdot[i] - w.before[end + i], x, h)


@njit(cache=True, error_model="numpy")
def _sum(end: int, slope: Array, part: Array) -> None:
    """Sum the slopes to the four highest coefficients of the dense output of every entry, over h."""
    for k in range(4):
        for i in range(end):
            total: float = 0.0
            for j in range(16):
                total += DENSE[k, j] * slope[j * end + i]
            part[k * end + i] = total


@njit(cache=True, error_model="numpy", forceinline=True)
def _dense(end: int, i: int, slope: Array, part: Array, change: float, x: float, h: float) -> float:
    """Change of one entry up to the fraction x of the step (Hairer, Norsett, Wanner I, section II.6)."""
    first, last = h * slope[i], h * slope[STAGES * end + i]
    value: float = 0.0
    for k in range(3, -1, -1):
        value = (value + h * part[k * end + i]) * (x if k % 2 == 1 else 1.0 - x)
    value = (value + 2.0 * change - first - last) * x
    value = (value + first - change) * (1.0 - x)
    return (value + change) * x


implement(Dop853, step, FACTS, inside)
