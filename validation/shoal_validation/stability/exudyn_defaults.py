"""Exudyn with the default settings of its integrator, adaptive step included, and no second run."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import ExudynSystem, build, library
from shoal.mechanics import findings as kinds
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory


@dataclass(frozen=True)
class ExudynDefaults:
    """SolveDynamic with the scene's step as its longest, and every other setting as `SimulationSettings()` has it.

    That is generalized-alpha with spectral radius 0.9 and a step that is cut where Newton does not converge.
    """

    @property
    def name(self) -> str:
        """Name of the engine."""
        return "exudyn"

    @property
    def capabilities(self) -> Capabilities:
        """Return the capabilities of Exudyn."""
        return ExudynEngine().capabilities

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run and believe what Exudyn says; not a number from where it gave up. Raises InputError."""
        began = time.perf_counter()
        wanted = sampling_times(scene, times)
        require(self, scene)
        exu = library()
        machine = build(exu, scene, "ancf-cable")
        path, failure = _solve(exu, machine, float(wanted[-1]), scene.solver.step)
        t, q, v = (np.array(column) for column in zip(*path, strict=True))
        motion = CubicHermiteSpline(t, q, v, extrapolate=False)
        samples = motion(np.minimum(wanted, t[-1])) if not failure else motion(wanted)
        rates = motion.derivative()(np.minimum(wanted, t[-1]))
        points = [
            machine.parts[marker.body].motion(samples, rates, scene.location(marker)).position
            for marker in scene.markers.values()
        ]
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=np.stack(points, axis=1)[..., None],
            angles=np.full((len(wanted), len(points), 1), np.nan),
            energy_drift=np.full(1, np.nan),
            constraint_drift=np.full(1, np.nan),
            steps=len(path) - 1,
            wall_s=time.perf_counter() - began,
            lane_findings=[[kinds.ENGINE_STOPPED.found(failure)] if failure else []],
        )

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """It has no lanes."""
        raise NotImplementedError


def _solve(exu: Any, machine: ExudynSystem, end: float, step: float) -> tuple[list[tuple[float, Array, Array]], str]:
    """Times [s], coordinates and rates after every step, and why the run ended early (empty if it did not)."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    settings.timeIntegration.endTime = end
    settings.timeIntegration.numberOfSteps = max(1, int(np.ceil(end / step - 1e-9)))
    settings.timeIntegration.verboseMode = 0
    path: list[tuple[float, Array, Array]] = []

    def keep(mbs: Any, now: float) -> bool:
        data = mbs.systemData
        if not path or now > path[-1][0]:
            path.append((now, machine.reference + data.GetODE2Coordinates(), np.array(data.GetODE2Coordinates_t())))
        return True

    machine.mbs.SetPostStepUserFunction(keep)
    spoke, exu.config.printToConsole = exu.config.printToConsole, False
    try:
        done = machine.mbs.SolveDynamic(settings, showHints=False, showCausingItems=False)
    except Exception as error:
        # Whatever the library raises is a failed run.
        return path, str(error).strip().partition("\n")[0] or type(error).__name__
    finally:
        exu.config.printToConsole = spoke
    return path, "" if done else "the solver gave up"
