"""The time loop of one tile: step, sample by dense output, watch energy and drift."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import constraints, dynamics, model
from shoal.mechanics.dynamics import Work
from shoal.mechanics.integrators.scheme import advance
from shoal.mechanics.model import Arrays
from shoal.mechanics.tile import Array, Index, Tile
from shoal.mechanics.vector import copy

ASSEMBLY = 30
"""Iterations that may assemble a mechanism whose stated start is only roughly consistent."""
CHECKS = 64
"""Energy and drift are looked at about so many times in a run."""


class Record(NamedTuple):
    """What a march leaves behind. samples: (times * marker rows, lanes); the rest: (lanes,).

    energy_error: largest |E + dissipated - E(0)| [J]; energy_scale: largest kinetic + elastic energy [J];
    drift: largest violation of a constraint; correction: largest change that made the start consistent.
    """

    samples: Array
    energy_error: Array
    energy_scale: Array
    drift: Array
    correction: Array


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
) -> Record:
    """March `steps` steps from the state in `room` and sample the marker rows at `times` [s] (increasing)."""
    width = len(tile)
    m, w = model.raw(arrays), dynamics.raw(room)
    per_sample = marker_rows.size * width
    record = Record(
        np.full(len(times) * per_sample, np.nan), np.zeros(width), np.zeros(width), np.zeros(width), np.zeros(width)
    )
    for row in range(m.unknowns):
        copy(tile, w.before, row, w.z, row)
    dynamics.settle(tile, m, w, 0.0, tolerance, ASSEMBLY)
    for i in range(m.unknowns * width):
        record.correction[i % width] = max(record.correction[i % width], abs(w.z[i] - w.before[i]))
    dynamics.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)

    energy, start, dissipated = np.zeros(width), np.zeros(width), np.zeros(width)
    last_power = room.power.copy()
    gap = np.empty(m.constraints.size * width)
    _energy(tile, m, w, start, record.energy_scale)
    check_every = max(1, steps // CHECKS)
    sample = 0
    for number in range(steps + 1):
        # The instant is counted, not summed, so that requested times fall on steps exactly.
        now = number * step
        while sample < len(times) and times[sample] <= now + 1e-9 * step:
            x = 1.0 if abs(times[sample] - now) <= 1e-9 * step else 1.0 - (now - times[sample]) / step
            _interpolate(tile, m, w, x, step)
            dynamics.derive(tile, m, w.stage, m.rows, False)
            first = sample * per_sample
            for k in range(marker_rows.size):
                for lane in range(width):
                    record.samples[first + k * width + lane] = w.stage[marker_rows[k] * width + lane]
            sample += 1
        if number == steps:
            break
        if sample < len(times) and times[sample] < now + step * (1 - 1e-9):
            for row in range(m.unknowns):
                copy(tile, w.before, row, w.z, row)
                copy(tile, w.before, m.unknowns + row, w.zdot, row)
        advance(tile, scheme, m, w, now, step)
        if m.frictions.size > 0:
            for lane in range(width):
                dissipated[lane] += 0.5 * step * (last_power[lane] + w.power[lane])
                last_power[lane] = w.power[lane]
        if (number + 1) % check_every == 0 or number + 1 == steps:
            _energy(tile, m, w, energy, record.energy_scale)
            constraints.drift(tile, m.constraints, w.z, gap, record.drift)
            alive = False
            for lane in range(width):
                error = abs(energy[lane] + dissipated[lane] - start[lane])
                if not error <= record.energy_error[lane]:
                    record.energy_error[lane] = error
                alive = alive or np.isfinite(error)
            if not alive:
                break
    return record


@njit(cache=True, error_model="numpy")
def _energy(tile: Tile, m: Arrays, w: Work, total: Array, scale: Array) -> None:
    width = len(tile)
    dynamics.energies(tile, m, w)
    for lane in range(width):
        moving = w.energy[lane] + w.energy[width + lane]
        total[lane] = moving + w.energy[2 * width + lane]
        if not moving <= scale[lane]:
            scale[lane] = moving


@njit(cache=True, error_model="numpy")
def _interpolate(tile: Tile, m: Arrays, w: Work, x: float, step: float) -> None:
    """Coordinates at the fraction x of the last step, by cubic Hermite interpolation, into w.stage."""
    end = m.unknowns * len(tile)
    if x == 1.0:
        for i in range(end):
            w.stage[i] = w.z[i]
        return
    h00, h10 = (1 + 2 * x) * (1 - x) ** 2, x * (1 - x) ** 2 * step
    h01, h11 = x * x * (3 - 2 * x), x * x * (x - 1) * step
    for i in range(end):
        w.stage[i] = h00 * w.before[i] + h10 * w.before[end + i] + h01 * w.z[i] + h11 * w.zdot[i]
