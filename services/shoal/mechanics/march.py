"""The time loop of one tile: step, sample by dense output, watch energy and drift."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import dynamics, model
from shoal.mechanics.dynamics import Work
from shoal.mechanics.halts import RESOLUTION, Halts, elongations, leapt
from shoal.mechanics.integrators.scheme import adaptive, advance, averages, interpolate, restart
from shoal.mechanics.least import constraints, gauss
from shoal.mechanics.model import Arrays
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.numerics.vector import pointer

ASSEMBLY = 30
"""Iterations that may assemble a mechanism whose stated start is only roughly consistent."""
CHECKS = 64
"""Energy and drift are looked at about so many times in a run of fixed steps."""
CHECK_EVERY = 4
"""An adaptive run is looked at every so many steps, each of which is worth a dozen looks."""
SAMPLED = 8
"""Numbers in the sample of a marker."""
LOBATTO = 0.5 - 0.5 / np.sqrt(5.0)
"""Inner node of the four-point Lobatto rule on the unit interval, of order 6; its weights are 1/12 and 5/12."""


class Record(NamedTuple):
    """What a march leaves behind. samples: (times * markers * SAMPLED, lanes), of each marker its point, its
    direction, the continuous angle [rad] at the end of the step, its velocity [m/s] and the rate of its direction
    [rad/s]; the rest: (lanes,).

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


@njit(cache=True, nogil=True, error_model="numpy")
def march(
    tile: Tile,
    scheme: Any,
    arrays: Arrays,
    room: Work,
    step: float,
    steps: int,
    times: Array,
    marker_rows: Index,
    tolerance: float,
    halts: Halts,
) -> Record:
    """March from the state in `room` and sample the marker rows at `times` [s] (increasing).

    Schemes of fixed step take `steps` steps of `step` [s]; adaptive ones end at the last of the times and
    take at most `steps`. Steps are cut short to end at the halts; there forces may jump, and driven constraints their
    rates. What was not reached stays nan.
    """
    width = len(tile)
    m, w = model.raw(arrays), dynamics.raw(room)
    dynamics.enter(m, w)
    halt, halting = 0, halts.times.size
    w.until[0] = np.nextafter(halts.times[0], 0.0) if halting > 0 else np.inf
    watched = halts.marks.size > 0
    elongation = np.zeros(m.forces.size * width)
    end = m.unknowns * width
    markers = marker_rows.size // 4
    per_sample = SAMPLED * markers * width
    record = Record(
        np.full(len(times) * per_sample, np.nan),
        np.zeros(width),
        np.zeros(width),
        np.zeros(constraints.POWERS * width),
        np.zeros(2 * end),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
    )
    past = np.empty(3 * end)
    inside_q, inside_v = np.zeros(m.rows * width), np.zeros(m.rows * width)
    dynamics.settle(tile, m, w, 0.0, tolerance, ASSEMBLY)
    for i in range(end):
        record.begin[i], record.begin[end + i] = w.z[i], w.zdot[i]
    dynamics.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)

    energy, start, dissipated = np.zeros(width), np.zeros(width), np.zeros(width)
    last_power, power = room.power.copy(), np.zeros(width)
    gap = np.empty(m.constraints.size * width)
    _energy(tile, m, w, start, record.energy_scale)
    free = adaptive(scheme)
    loaded = dynamics.loaded(m)
    ending = times[-1] if free or (halting > 0 and halts.times[-1] == times[-1]) else steps * step
    snap = RESOLUTION * ending
    check_every = CHECK_EVERY if free else max(1, steps // CHECKS)
    turns, above = np.zeros(markers * width), np.zeros(markers * width)
    _count_turns(tile, m, w, marker_rows, turns, above)
    turns[:] = 0.0
    now, taken, number, sample, cuts = 0.0, step, 0, 0, 0
    whole = True
    while True:
        slack = 1e-9 * (taken if free else step)
        while sample < len(times) and times[sample] <= now + slack:
            if abs(times[sample] - now) <= slack:
                for i in range(end):
                    inside_q[i], inside_v[i] = w.z[i], w.zdot[i]
            else:
                x = 1.0 - (now - times[sample]) / taken
                interpolate(tile, scheme, m, w, pointer(past), x, taken, pointer(inside_q), pointer(inside_v))
            dynamics.derive(tile, m, pointer(inside_q), m.rows, False)
            dynamics.derive(tile, m, pointer(inside_v), m.rows, True)
            for k in range(markers):
                first = sample * per_sample + SAMPLED * k * width
                for row in range(4):
                    to, source = first + row * width, marker_rows[4 * k + row] * width
                    for lane in range(width):
                        record.samples[to + lane] = inside_q[source + lane]
                        if row < 2:
                            record.samples[to + 5 * width + lane] = inside_v[source + lane]
                for lane in range(width):
                    x_row, y_row = marker_rows[4 * k + 2] * width + lane, marker_rows[4 * k + 3] * width + lane
                    angle = np.arctan2(w.z[y_row], w.z[x_row]) + turns[k * width + lane]
                    x, y = inside_q[x_row], inside_q[y_row]
                    record.samples[first + 4 * width + lane] = angle
                    turning = x * inside_v[y_row] - y * inside_v[x_row]
                    record.samples[first + 7 * width + lane] = turning / (x * x + y * y)
            sample += 1
        if number == steps or now >= ending:
            break
        if halt < halting and now == halts.times[halt]:
            halt += 1
            w.until[0] = np.nextafter(halts.times[halt], 0.0) if halt < halting else np.inf
            restart(scheme)
            if m.driven:
                _energy(tile, m, w, energy, record.energy_scale)
                dynamics.meet(tile, m, w, now, tolerance)
                for lane in range(width):
                    dissipated[lane] += energy[lane]
                _energy(tile, m, w, energy, record.energy_scale)
                for lane in range(width):
                    dissipated[lane] -= energy[lane]
            dynamics.acceleration(tile, m, w, now, w.z, w.zdot, tolerance, w.a)
            for lane in range(width):
                last_power[lane] = w.power[lane]
        target = ending if free else min((number + 1) * step, ending)
        halted = halt < halting and halts.times[halt] <= target + snap
        if halted:
            target = halts.times[halt]
        if watched or (free and loaded) or (sample < len(times) and (free or times[sample] < now + step * (1 - 1e-9))):
            for i in range(end):
                past[i], past[end + i], past[2 * end + i] = w.z[i], w.zdot[i], w.a[i]
        rest = step if whole and not (free or halted) else target - now
        begin = now
        if watched:
            dynamics.derive(tile, m, w.z, m.force_rows, False)
            elongations(tile, m.forces, w.z, w.memory, w.element, elongation)
        taken = advance(tile, scheme, m, w, now, rest)
        while watched and taken > snap:
            dynamics.derive(tile, m, w.z, m.force_rows, False)
            if not leapt(tile, m.forces, halts, elongation, w.z, w.memory, w.element):
                break
            for i in range(end):
                w.z[i], w.zdot[i], w.a[i] = past[i], past[end + i], past[2 * end + i]
            restart(scheme)
            taken = advance(tile, scheme, m, w, now, 0.5 * taken)
        arrived = taken >= rest
        if free:
            number += 1
            now = target if arrived else now + taken
        else:
            # Fixed steps are counted, not summed, so that requested times fall on steps exactly.
            grid = (number + 1) * step
            whole = arrived and (not halted or abs(grid - target) <= snap)
            now = (target if halted else grid) if arrived else now + taken
            number += 1 if whole else 0
            cuts += 0 if whole else 1
        dynamics.remember(tile, m, w)
        _count_turns(tile, m, w, marker_rows, turns, above)
        if loaded:
            for lane in range(width):
                power[lane] = w.power[lane]
            if free:
                for x in (LOBATTO, 1.0 - LOBATTO):
                    interpolate(tile, scheme, m, w, pointer(past), x, taken, pointer(inside_q), pointer(inside_v))
                    inside = pointer(inside_q), pointer(inside_v)
                    if m.driven:
                        dynamics.acceleration(tile, m, w, begin + x * taken, *inside, tolerance, w.stage)
                    else:
                        dynamics.force(tile, m, w, begin + x * taken, *inside, w.stage)
                    for lane in range(width):
                        dissipated[lane] += taken * 5.0 / 12.0 * w.power[lane]
            weight = 1.0 / 12.0 if free else 0.5
            for lane in range(width):
                other = power[lane] if averages(scheme) else last_power[lane]
                dissipated[lane] += weight * taken * (other + power[lane])
                last_power[lane] = power[lane]
        if (number + cuts) % check_every == 0 or number == steps or now >= ending:
            _energy(tile, m, w, energy, record.energy_scale)
            dynamics.derive(tile, m, w.z, m.held_rows, False)
            constraints.drift(tile, m.constraints, m.functions, now, w.z, gap, record.drift)
            alive = False
            for lane in range(width):
                error = abs(energy[lane] + dissipated[lane] - start[lane])
                if not error <= record.energy_error[lane]:
                    record.energy_error[lane] = error
                alive = alive or np.isfinite(error)
            if not alive:
                break
    for lane in range(width):
        record.steps[lane] = number + cuts
        record.evaluations[lane] = scheme.evaluations[0]
        record.reached[lane] = now
    return record


@njit(cache=True, error_model="numpy", forceinline=True)
def _count_turns(tile: Tile, m: Arrays, w: Work, marker_rows: Index, turns: Array, above: Array) -> None:
    """Add 2 pi to `turns` (markers, lanes) where a marker's direction has passed the negative x axis."""
    width = len(tile)
    gauss.derive(tile, m, w.z, m.held_rows, m.rows, False)
    for k in range(marker_rows.size // 4):
        x, y = marker_rows[4 * k + 2] * width, marker_rows[4 * k + 3] * width
        for lane in range(width):
            now = 1.0 if w.z[y + lane] >= 0.0 else 0.0
            if w.z[x + lane] < 0.0:
                turns[k * width + lane] += 2.0 * np.pi * (above[k * width + lane] - now)
            above[k * width + lane] = now


@njit(cache=True, error_model="numpy")
def _energy(tile: Tile, m: Arrays, w: Work, total: Array, scale: Array) -> None:
    width = len(tile)
    dynamics.energies(tile, m, w)
    for lane in range(width):
        moving = w.energy[lane] + w.energy[width + lane]
        total[lane] = moving + w.energy[2 * width + lane]
        if not moving <= scale[lane]:
            scale[lane] = moving
