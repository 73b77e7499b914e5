"""IMU by Exudyn's own outputs of acceleration and rate, where Shoal's mechanics compute nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from shoal.engines.exudyn.bodies import RigidPart
from shoal.engines.exudyn.build import library, silence
from shoal.engines.exudyn.engine import ExudynEngine
from shoal.engines.exudyn.record import choose_steps
from shoal.errors import ComputationError
from shoal.scene import Scene
from shoal.trajectory import Array

_ENGINE = ExudynEngine(integrator="generalized-alpha")


def imu(scene: Scene, marker: str, tilt: float, times: Array) -> Array:
    """ax, ay [m/s^2] along axes turned by `tilt` [rad] from the body's, and rate [rad/s], (samples, 3).

    times [s]: multiples of the scene's step. Raises ComputationError.
    """
    exu, at = library(), scene.markers[marker]
    built = _ENGINE.machine(exu, scene, float(times[-1]))
    part = built.parts[at.body]
    assert isinstance(part, RigidPart)
    outputs, place = exu.OutputVariableType, [*scene.location(at), 0.0]
    rows = list[tuple[float, ...]]()

    def take(mbs: Any, time: float) -> bool:
        shown = (
            mbs.GetObjectOutputBody(part.body, what, place) for what in (outputs.Acceleration, outputs.AngularVelocity)
        )
        (ax, ay, _), turning = shown
        angle = built.reference[part.columns[2]] + mbs.GetNodeOutput(part.node, outputs.Coordinates)[2]
        rows.append((time, ax, ay, angle, np.ravel(turning)[-1]))
        return True

    built.mbs.SetPostStepUserFunction(take)
    steps = choose_steps(times, scene.solver.step, built.unknowns)
    settings = _ENGINE.simulation_settings(exu, built, steps)
    with silence(exu):
        done = built.mbs.SolveDynamic(settings, showHints=False, showCausingItems=False)
    table = np.array(rows)
    if not done:
        raise ComputationError(f"{scene.name}: exudyn gave up at {table[-1, 0]:g} s")
    found = table[np.searchsorted(table[:, 0], times - 1e-9)]
    felt = found[:, 1:3] - np.array(scene.gravity[:2])
    c, s = np.cos(found[:, 3] + tilt), np.sin(found[:, 3] + tilt)
    return np.stack([c * felt[:, 0] + s * felt[:, 1], c * felt[:, 1] - s * felt[:, 0], found[:, 4]], axis=1)
