"""A run of Exudyn is not believed before its numbers, its reach, its joints and its energy were looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.engines.exudyn.build import ExudynSystem
from shoal.engines.exudyn.record import Indices, KeptStates
from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.mechanics.reach import MARGIN, distance_to_ground, reach
from shoal.mechanics.start.rigid_bodies import lead
from shoal.trajectory import Array

LARGEST_GAP = 1e-4
"""Joint gap per metre of machine beyond which a run has drifted."""
REDUCE = "reduce solver.step"
INSTANTS = 400
"""Kept steps at which energy and joints are examined."""


@dataclass(frozen=True)
class RunCheck:
    """Marker motion of one run and what to think of it.

    points [m], (samples, markers, d); angles [rad], (samples, markers); velocities [m/s] and rates [rad/s] likewise,
    in the plane; gap: largest joint gap [m].
    """

    points: Array
    angles: Array
    velocities: Array | None
    rates: Array | None
    findings: list[Finding]
    energy_drift: float
    gap: float


def judge(machine: ExudynSystem, record: KeptStates, failure: str) -> RunCheck:
    """Read the markers and check the run; `failure` is what the solver said, empty where it was content."""
    points, angles, velocities, rates = _markers(machine, record)
    rows = np.unique(np.linspace(0, len(record.q) - 1, INSTANTS).astype(int))
    gap = machine.gap(record.q[rows], record.v[rows])
    energy, moving = machine.energy(record.times, record.q, record.v, rows)
    drift = float("nan") if machine.unfollowed else _energy_drift(machine, record, rows, energy, moving)
    found: list[Finding] = []
    furthest = float(reach(machine.scene, np.asarray(np.max(moving))))
    far = float(np.max(distance_to_ground(machine.scene, points[..., None])))
    tolerance = machine.scene.solver.energy_tolerance
    if failure:
        found = [kinds.ENGINE_STOPPED.found(failure)]
    elif not (np.all(np.isfinite(record.q)) and np.all(np.isfinite(record.v))):
        found = [kinds.NOT_FINITE.found("the coordinates stopped being finite")]
    elif far > MARGIN * furthest:
        text = f"a marker is {far:.3g} m from the ground, the bodies reach {furthest:.3g} m"
        found = [kinds.OUT_OF_REACH.found(text, distance=far, reach=furthest)]
    elif gap > LARGEST_GAP * machine.span:
        found = [kinds.NOT_CLOSED.found(f"a joint opened by {gap:.3g} m", REDUCE, gap=float(gap))]
    elif fallen := [name for name, one in machine.penalties.items() if one.fallen(record.q, record.v)]:
        found = [kinds.ENGINE_STOPPED.found(f"{fallen[0]}: a body fell through the surface; {REDUCE}")]
    elif drift > tolerance:
        text = f"energy is off by {drift:.3g}, allowed is {tolerance:.3g}"
        found = [kinds.ENERGY.found(text, REDUCE, drift=drift, allowed=tolerance)]
    return RunCheck(points, angles, velocities, rates, found, drift, gap)


def _markers(machine: ExudynSystem, record: KeptStates) -> tuple[Array, Array, Array | None, Array | None]:
    """Points, angles, velocities and rates; the last two in the plane."""
    scene, samples = machine.scene, record.at_wanted()
    angles, motions = [], []
    for marker in scene.markers.values():
        part, place = machine.parts[marker.body], scene.location(marker)
        path = np.unwrap(part.motion(record.q, record.v, place).direction)
        path += _turns(scene.start(marker.body).angle + lead(scene, marker) - path[0])
        here = part.motion(*samples, place)
        about = np.interp(record.steps.wanted, record.times, path)
        motions.append(here)
        angles.append(here.direction + _turns(about - here.direction))
    points, directions = np.stack([one.position for one in motions], axis=1), np.stack(angles, axis=1)
    if scene.dimensions != 2:
        return points, directions, None, None
    velocities = np.stack([one.velocity for one in motions], axis=1)
    return points, directions, velocities, np.stack([one.rate for one in motions], axis=1)


def _turns(angle: Array) -> Array:
    return 2 * np.pi * np.round(angle / (2 * np.pi))


def _energy_drift(machine: ExudynSystem, record: KeptStates, rows: Indices, energy: Array, moving: Array) -> float:
    # Where a load jumps, steps begin on its right side and end on its left.
    sides = (record.times, np.nextafter(record.times, 0.0))
    right, left = (machine.lost_power(side, record.q, record.v) for side in sides)
    lost = np.concatenate([[0.0], np.cumsum(np.diff(record.times) * (left[1:] + right[:-1]) / 2)])
    energy = energy + lost[rows]
    # A machine at rest has no energy to compare with; round-off of its potential must not count as drift.
    scale = max(float(np.max(moving)), 1e-9 * float(np.max(np.abs(energy))), np.finfo(float).tiny)
    return float(np.max(np.abs(energy - energy[0]))) / scale
