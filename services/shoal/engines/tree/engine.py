"""The recursive relative coordinates behind the engine contract: a second opinion for open rigid chains."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.one_by_one import OneByOne
from shoal.engines.tree.scene import SceneTree
from shoal.engines.tree.simulate import SpatialMotion, simulate
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import facts
from shoal.scene import Scene
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
        tree = SceneTree(scene)
        instants = np.union1d(wanted, np.arange(0.0, wanted[-1], BETWEEN))
        solver = scene.solver
        step = solver.step if solver.integrator == "rk4" else None
        tolerance = None if step else float(np.clip(solver.relative_tolerance, TIGHTEST, LOOSEST))
        motion = simulate(
            tree.chain, instants, step=step, tolerance=tolerance, energy_tolerance=solver.energy_tolerance
        )
        rows = np.searchsorted(instants, wanted)
        points = np.stack([motion.point(name) for name in scene.markers], axis=1)[..., : scene.dimensions]
        angles = np.stack([_angle(motion, scene, at.body) for at in scene.markers.values()], axis=1)
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=points[rows][..., None],
            angles=angles[rows][..., None],
            status=(motion.status,),
            energy_drift=np.array([motion.energy_drift]),
            constraint_drift=np.zeros(1),
            steps=motion.steps,
            wall_s=time.perf_counter() - started,
            message=motion.message,
            model={**motion.model, "unknowns": motion.model["rates"], "constraints": 0}
            | facts(scene, tree.initial, span(scene)),
        )


def _angle(motion: SpatialMotion, scene: Scene, body: str) -> Array:
    """Continuous angle [rad] of a body's first axis about z, with the turns that the scene states."""
    axis = motion.rotation(body)[:, :, 0]
    angle = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    return np.asarray(angle + 2 * np.pi * np.round((scene.start(body).angle - angle[0]) / (2 * np.pi)))
