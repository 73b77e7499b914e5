"""The main path: description -> numbers -> march -> checked motion."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.tree.description import SpatialChain
from shoal.engines.tree.march import MAXIMAL_STEPS, TreeRun, march
from shoal.engines.tree.tableau import DOPRI853, RK4
from shoal.engines.tree.tree import Array, ChainModel, build, room
from shoal.errors import InputError
from shoal.trajectory import Status

ENERGY_TOLERANCE = 1e-3


@dataclass(frozen=True)
class SpatialMotion:
    """Motion of a spatial tree, sampled at `times`, and the evidence for believing it.

    times: [s], (samples,)
    points: positions of the named points [m], (samples, points, 3)
    q: coordinates [rad, m], of spherical joints unit quaternions (scalar first), (samples, coordinates)
    v: rates [rad/s, m/s], (samples, rates)
    rotations: axes of the bodies as described, as columns, (samples, bodies, 3, 3)
    kinetic, potential: energies [J]; work: done by loads, applied torques and dampers [J], (samples,)
    energy_drift: largest |E - work - E(0)| relative to the largest kinetic energy or change of potential energy
    chain: numbers and names of the tree; model: what was computed, for the record
    """

    chain: ChainModel
    times: Array
    points: Array
    q: Array
    v: Array
    rotations: Array
    kinetic: Array
    potential: Array
    work: Array
    energy_drift: float
    status: Status
    message: str
    steps: int
    wall_s: float
    model: dict[str, Any]

    @property
    def ok(self) -> bool:
        """Return whether the motion may be believed."""
        return self.status is Status.OK

    def point(self, name: str) -> Array:
        """Path of a named point [m], (samples, 3)."""
        return self.points[:, self.chain.points.index(name)]

    def coordinate(self, joint: str) -> Array:
        """Coordinates of a joint, (samples, 1), or (samples, 4) of a spherical one, (samples, 0) of a fixed one."""
        return self.q[:, self.chain.coordinates(joint)]

    def rate(self, joint: str) -> Array:
        """Rates of a joint, (samples, 1), or (samples, 3) of a spherical one, (samples, 0) of a fixed one."""
        return self.v[:, self.chain.rates(joint)]

    def rotation(self, body: str) -> Array:
        """Axes of a body's frame as columns, (samples, 3, 3)."""
        return self.rotations[:, self.chain.bodies.index(body)]


def simulate(
    chain: SpatialChain,
    times: Sequence[float] | Array,
    *,
    step: float | None = None,
    tolerance: float | None = None,
    energy_tolerance: float = ENERGY_TOLERANCE,
) -> SpatialMotion:
    """Motion of a tree at `times` [s], from time zero.

    Either `step` [s] for the classical Runge-Kutta method, shortened so that steps end on the requested times,
    or `tolerance` (relative and absolute, of coordinates and rates) for Dormand and Prince of order 8.
    A run whose energy balance is off by more than `energy_tolerance` is not ok. Raises InputError.
    """
    begin = time.perf_counter()
    wanted = np.ascontiguousarray(times, dtype=float)
    if step is not None and wanted[-1] / step > MAXIMAL_STEPS:
        raise InputError(f"step: {step:g} s means more than {MAXIMAL_STEPS} steps; use a longer one")
    model = build(chain)
    if len(model.v0) == 0:
        raise InputError(f"{chain.name}: joints: all are fixed, nothing can move")
    tree, work = model.tree, room(model.tree)
    state = np.concatenate([model.q0, model.v0, [0.0]])
    method = DOPRI853 if step is None else RK4
    record = march(tree, work, method, state, wanted, step or 0.0, tolerance or 0.0)
    drift = _relative(model, record)
    status, message = _verdict(record, wanted, drift, energy_tolerance)
    coordinates = len(model.q0)
    turns = record.rotation[:, 1:].reshape(len(wanted), -1, 3, 3)
    return SpatialMotion(
        chain=model,
        times=wanted,
        points=_points(model, record),
        q=record.states[:, :coordinates],
        v=record.states[:, coordinates:-1],
        rotations=turns @ model.body_turns[1:],
        kinetic=record.energy[:, 0],
        potential=record.energy[:, 1],
        work=record.states[:, -1],
        energy_drift=drift,
        status=status,
        message=message,
        steps=int(record.facts[2]),
        wall_s=time.perf_counter() - begin,
        model={
            "bodies": len(model.bodies),
            "coordinates": coordinates,
            "rates": len(model.v0),
            "integrator": "dop853" if step is None else "rk4",
            "step": step,
            "tolerance": tolerance,
            "steps_refused": int(record.facts[3]),
        },
    )


def _points(model: ChainModel, record: TreeRun) -> Array:
    turns = record.rotation[:, model.point_bodies].reshape(-1, len(model.points), 3, 3)
    points: Array = record.position[:, model.point_bodies] + np.einsum("snij,nj->sni", turns, model.point_places)
    return points


def _relative(model: ChainModel, record: TreeRun) -> float:
    """Energy error over the largest kinetic energy or change of potential energy; round-off sets the scale at rest."""
    tree = model.tree
    reach = float(np.sum(np.linalg.norm(tree.offset, axis=1) + np.linalg.norm(tree.lever, axis=1)))
    floor = 1e-9 * float(np.sum(tree.mass) * np.linalg.norm(tree.gravity)) * reach + 1e-300
    return float(record.facts[0] / np.maximum(record.facts[1], floor))


def _verdict(record: TreeRun, times: Array, drift: float, allowed: float) -> tuple[Status, str]:
    error, _, steps, _, reached = record.facts
    if not np.isfinite(error):
        return Status.DIVERGED, f"the motion is not finite after {reached:.6g} s; use a smaller step"
    if not np.all(np.isfinite(record.states)):
        if steps >= MAXIMAL_STEPS:
            return Status.FAILED, f"{MAXIMAL_STEPS} steps reach only {reached:.6g} s of {times[-1]:.6g} s"
        return Status.DIVERGED, f"no step is short enough after {reached:.6g} s; use a larger tolerance"
    if not drift <= allowed:
        return Status.ENERGY, f"energy is off by {drift:.2g}, allowed {allowed:g} (relative)"
    return Status.OK, ""
