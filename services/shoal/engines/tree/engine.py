"""The recursive relative coordinates behind the engine contract: a second opinion for open rigid chains."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.one_by_one import OneByOne
from shoal.engines.tree.march import MAXIMAL_STEPS, TreeRun, march
from shoal.engines.tree.scene import SceneTree
from shoal.engines.tree.tableau import DOPRI853, RK4
from shoal.engines.tree.tree import Tree, room
from shoal.errors import InputError
from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import facts
from shoal.scene import Attachment, Scene
from shoal.trajectory import Array, Trajectory

LOOSEST, TIGHTEST = 1e-2, 1e-14
BETWEEN = 0.01
"""Longest time [s] between instants at which the turns of a direction are counted."""


@dataclass(frozen=True)
class TreeEngine(OneByOne):
    """Minimal coordinates of open chains of rigid bodies, in the plane and in space.

    Dormand and Prince's method of order 8 at the scene's tolerance, or the classical Runge-Kutta method at its step
    where the scene's integrator is `rk4`; other integrators are the native solver's.
    """

    name: str = "tree"

    @property
    def capabilities(self) -> Capabilities:
        """Rigid bodies hung on each other, with constant loads."""
        return Capabilities(
            elements=frozenset({"rigid"}),
            joints=frozenset({"revolute", "spherical", "slider", "weld"}),
            loads=frozenset({"force", "torque"}),
            features=frozenset({"machines in space"}),
            lanes=False,
        )

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; a run that failed or is not believed carries its status. Raises InputError."""
        started = time.perf_counter()
        wanted = sampling_times(scene, times)
        require(self, scene)
        machine, solver = SceneTree(scene), scene.solver
        if not machine.v.size:
            raise InputError(f"{scene.name}: joints: all are fixed, nothing can move")
        controlled = solver.integrator != "rk4"
        if not controlled and wanted[-1] / solver.step > MAXIMAL_STEPS:
            raise InputError(f"solver.step: {solver.step:g} s means more than {MAXIMAL_STEPS} steps; use a longer one")
        tolerance = float(np.clip(solver.relative_tolerance, TIGHTEST, LOOSEST)) if controlled else None
        step = None if controlled else solver.step
        instants = np.union1d(wanted, np.arange(0.0, wanted[-1], BETWEEN))
        state = np.concatenate([machine.q, machine.v, [0.0]])
        record = march(
            machine.tree, room(machine.tree), RK4 if step else DOPRI853, state, instants, step or 0.0, tolerance or 0.0
        )
        drift = _relative(machine.tree, record)
        findings = _findings(record, instants, drift, solver.energy_tolerance)
        rows = np.searchsorted(instants, wanted)
        points = np.stack([_point(machine, record, at) for at in scene.markers.values()], axis=1)
        angles = np.stack([_angle(machine, record, at.body) for at in scene.markers.values()], axis=1)
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=points[rows, :, : scene.dimensions, None],
            angles=angles[rows][..., None],
            energy_drift=np.array([drift]),
            constraint_drift=np.zeros(1),
            steps=int(record.facts[2]),
            wall_s=time.perf_counter() - started,
            lane_findings=[findings],
            model={"bodies": len(scene.bodies), "coordinates": len(machine.q), "rates": len(machine.v),
                   "integrator": "dop853" if controlled else "rk4", "step": step, "tolerance": tolerance,
                   "steps_refused": int(record.facts[3]), "unknowns": len(machine.v), "constraints": 0}
            | facts(scene, machine.initial, span(scene)),
        )  # fmt: skip


def _point(machine: SceneTree, record: TreeRun, at: Attachment) -> Array:
    """Path of an attachment [m], (times, 3)."""
    row = machine.rows[at.body]
    return np.asarray(record.position[:, row] + record.rotation[:, row].reshape(-1, 3, 3) @ machine.marker(at))


def _angle(machine: SceneTree, record: TreeRun, body: str) -> Array:
    """Continuous angle [rad] of a body's first axis about z, with the turns that the scene states."""
    axis = record.rotation[:, machine.rows[body]].reshape(-1, 3, 3) @ machine.first_axis(body)
    angle = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    return np.asarray(angle + 2 * np.pi * np.round((machine.scene.start(body).angle - angle[0]) / (2 * np.pi)))


def _relative(tree: Tree, record: TreeRun) -> float:
    """Energy error over the largest kinetic energy or change of potential energy; round-off sets the scale at rest."""
    reach = float(np.sum(np.linalg.norm(tree.offset, axis=1) + np.linalg.norm(tree.lever, axis=1)))
    floor = 1e-9 * float(np.sum(tree.mass) * np.linalg.norm(tree.gravity)) * reach + 1e-300
    return float(record.facts[0] / np.maximum(record.facts[1], floor))


def _findings(record: TreeRun, times: Array, drift: float, allowed: float) -> list[Finding]:
    error, _, steps, _, reached = record.facts
    if not np.isfinite(error):
        text = f"the motion is not finite after {reached:.6g} s"
        return [kinds.NOT_FINITE.found(text, "use a smaller step", time=reached)]
    if not np.all(np.isfinite(record.states)):
        if steps >= MAXIMAL_STEPS:
            text = f"{MAXIMAL_STEPS} steps reach only {reached:.6g} s of {times[-1]:.6g} s"
            return [kinds.STEPS_EXHAUSTED.found(text, steps=steps, time=reached)]
        text = f"no step is short enough after {reached:.6g} s"
        return [kinds.NOT_FINITE.found(text, "use a larger tolerance", time=reached)]
    if not drift <= allowed:
        text = f"energy is off by {drift:.2g}, allowed {allowed:g} (relative)"
        return [kinds.ENERGY.found(text, drift=drift, allowed=allowed)]
    return []
