"""The time loop: explicit Runge-Kutta steps of fixed or controlled size that end on every requested time.

The state is y = [q, v, work], where `work` is what dampers and loads have done [J], so that
kinetic + potential - work stays what it was.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.engines.tree.articulated import accelerate
from shoal.engines.tree.motion import coordinate_rates, energies, normalise, power
from shoal.engines.tree.tableau import Tableau
from shoal.engines.tree.tree import Array, Room, Tree
from shoal.engines.tree.vector3 import OPTIONS

MAXIMAL_STEPS = 50_000_000
SMALLEST_STEP = 1e-13
"""Smallest controlled step relative to the time of the run."""


class TreeRun(NamedTuple):
    """Record of a run.

    states: y at the times, (times, coordinates + rates + 1); rotation, position: of the bodies, (times, bodies, 9 or 3)
    energy: kinetic, potential [J], (times, 2)
    facts: largest |E - work - E(0)| [J]; largest kinetic or change of potential energy [J]; steps; steps refused;
        time reached [s], (5,)
    """

    states: Array
    rotation: Array
    position: Array
    energy: Array
    facts: Array


@njit(**OPTIONS)
def rate(tree: Tree, w: Room, y: Array, out: Array) -> None:
    """out = dy/dt."""
    split, end = y.size - 1 - tree.damping.size, y.size - 1
    q, v = y[:split], y[split:end]
    accelerate(tree, w, q, v, out[split:end])
    coordinate_rates(tree, q, v, out[:split])
    out[end] = power(tree, w, v)


@njit(**OPTIONS)
def advance(tree: Tree, w: Room, method: Tableau, y: Array, k: Array, h: float, stage: Array, new: Array) -> None:
    """One step of h [s] from y, whose rate is k[0], to `new`, whose rate becomes k[-1]."""
    stages = method.b.size
    for s in range(1, stages + 1):
        target = stage if s < stages else new
        for n in range(y.size):
            target[n] = y[n]
        for r in range(s):
            factor = h * (method.a[s, r] if s < stages else method.b[r])
            if factor != 0.0:
                slope = k[r]
                for n in range(y.size):
                    target[n] += factor * slope[n]
        if s == stages:
            normalise(tree, new)
        rate(tree, w, target, k[s])


@njit(**OPTIONS)
def error_norm(method: Tableau, y: Array, new: Array, k: Array, h: float, tolerance: float) -> float:
    """Estimated error of q and v over what is allowed, by Hairer, Norsett, Wanner, section II.10."""
    five, three = 0.0, 0.0
    for n in range(y.size - 1):
        scale = tolerance * (1.0 + max(abs(y[n]), abs(new[n])))
        e5, e3 = 0.0, 0.0
        for s in range(method.b.size + 1):
            e5 += method.error_5[s] * k[s, n]
            e3 += method.error_3[s] * k[s, n]
        five += (e5 / scale) ** 2
        three += (e3 / scale) ** 2
    if five == 0.0 and three == 0.0:
        return 0.0
    return abs(h) * five / math.sqrt((five + 0.01 * three) * (y.size - 1))


@njit(**OPTIONS)
def first_step(y: Array, slope: Array, tolerance: float) -> float:
    """A cautious first step: a hundredth of the time in which the state changes by its own size."""
    size, change = 0.0, 0.0
    for n in range(y.size - 1):
        scale = tolerance * (1.0 + abs(y[n]))
        size += (y[n] / scale) ** 2
        change += (slope[n] / scale) ** 2
    if size < 1e-10 or change < 1e-10 or not np.isfinite(change):
        return 1e-6
    return 0.01 * math.sqrt(size / change)


@njit(**OPTIONS)
def march(tree: Tree, w: Room, method: Tableau, y: Array, times: Array, step: float, tolerance: float) -> TreeRun:
    """March y from time zero over `times` [s], increasing, with steps of at most `step`, or to the tolerance."""
    samples = len(times)
    record = TreeRun(
        np.full((samples, y.size), np.nan),
        np.full((samples, *w.rotation.shape), np.nan),
        np.full((samples, *w.position.shape), np.nan),
        np.full((samples, 2), np.nan),
        np.zeros(5),
    )
    k = np.zeros((method.b.size + 1, y.size))
    stage, new = np.empty(y.size), np.empty(y.size)
    rate(tree, w, y, k[0])
    kinetic, ground = energies(tree, w)
    start = kinetic + ground
    potential = ground
    record.facts[1] = kinetic
    controlled = method.error_order > 0
    h = first_step(y, k[0], tolerance) if controlled else step
    now = 0.0
    for sample in range(samples):
        begin, span = now, times[sample] - now
        count = max(1, math.ceil(span / step - 1e-9)) if not controlled else 0
        taken = 0
        while span > 0.0 and now < times[sample]:
            remaining = times[sample] - now
            last = taken + 1 == count if not controlled else h >= remaining * (1.0 - 1e-10)
            size = span / count if not controlled else min(h, remaining)
            advance(tree, w, method, y, k, size, stage, new)
            if controlled:
                error = error_norm(method, y, new, k, size, tolerance)
                factor = 10.0 if error == 0.0 else min(10.0, max(0.2, 0.9 * error ** (-1.0 / (method.error_order + 1))))
                if not error < 1.0:
                    h = size * min(1.0, factor) if np.isfinite(error) else 0.2 * size
                    record.facts[3] += 1
                    if h < SMALLEST_STEP * times[-1]:
                        return record
                    continue
                # A step cut short by a requested time says nothing about the next but that it may be longer.
                h = max(h, size * factor) if last else size * factor
            taken += 1
            now = times[sample] if last else (begin + taken * size if not controlled else now + size)
            for n in range(y.size):
                y[n], k[0, n] = new[n], k[-1, n]
            record.facts[2] += 1
            kinetic, potential = energies(tree, w)
            error = abs(kinetic + potential - y[-1] - start)
            if not error <= record.facts[0]:
                record.facts[0] = error
            if not np.isfinite(error) or record.facts[2] >= MAXIMAL_STEPS:
                return record
            record.facts[1] = max(record.facts[1], kinetic, abs(potential - ground))
            record.facts[4] = now
        record.states[sample], record.rotation[sample], record.position[sample] = y, w.rotation, w.position
        record.energy[sample, 0], record.energy[sample, 1] = kinetic, potential
    return record
