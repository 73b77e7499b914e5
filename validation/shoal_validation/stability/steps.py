"""Maps on the flexible double pendulum with one field of it on the second axis, judged against its own mesh.

The reference is CasADi's model of the same mesh (cubic cables, full quadrature), derived from the energy, by CVODES
with a relative tolerance of 1e-11 or, for the stiffest machines, 1e-9: what is left is the error of the time step.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from shoal.engines.casadi import CasadiEngine
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.stability.contract import Axis, StabilityMap, Watched
from shoal_validation.stability.methods import (
    ADAPTIVE,
    AUTO,
    CAPPED,
    CASADI_RK4,
    EXUDYN,
    EXUDYN_DEFAULTS,
    FIXED_STEP,
    both,
)

SIZE = 3.0
"""m, both rods stretched out."""
TIMES = np.linspace(0.05, 0.5, 10)
STEPS = Axis("step", "s", (1e-4, 3e-4, 5e-4, 1e-3, 3e-3, 1e-2, 5e-2))
TOLERANCES = Axis("relative tolerance", "", (1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1))

Change = Callable[[Any], dict[str, object]]


def step_map(name: str, question: str, teaches: str, y: Axis, change: Change) -> StabilityMap:
    """Methods of fixed step and `auto`: step against the field that `change` sets."""
    return StabilityMap(
        name,
        question,
        teaches,
        STEPS,
        y,
        (*FIXED_STEP, CAPPED, AUTO, *both(*EXUDYN), EXUDYN_DEFAULTS, *both(CASADI_RK4)),
        watched(change),
        lambda step, _: {"solver.step": step},
    )


def tolerance_map(name: str, question: str, teaches: str, y: Axis, change: Change) -> StabilityMap:
    """Methods that choose their steps: relative tolerance against the field that `change` sets."""
    return StabilityMap(
        name, question, teaches, TOLERANCES, y, ADAPTIVE, watched(change), lambda relative, _: tolerances(relative)
    )


def tolerances(relative: float) -> dict[str, object]:
    """Fields of the solver for a relative tolerance, and a tenth of it as the absolute one."""
    return {"solver.relative_tolerance": relative, "solver.absolute_tolerance": relative / 10}


def watched(change: Change) -> Callable[[Any, Any], Watched]:
    """The pendulum of a cell; the reference depends on the second axis only."""

    def machine(_x: Any, value: Any) -> Watched:
        scene, fields = load_scene("flexible-double-pendulum"), change(value)
        return Watched(
            scene, fields, "B", TIMES, reference(scene.with_values(fields).model_dump_json(), tuple(TIMES)), SIZE
        )

    return machine


@lru_cache(maxsize=64)
def reference(scene_json: str, times: tuple[float, ...]) -> Array:
    """Path of B [m], (times, 2), by CasADi on the same mesh."""
    scene = Scene.model_validate_json(scene_json)
    rods = [body for body in scene.bodies.values() if body.kind == "rod" and body.youngs_modulus is not None]
    stiff = max(rod.youngs_modulus or 0.0 for rod in rods) > STIFF
    run = CasadiEngine(tolerance=1e-9 if stiff else 1e-11).simulate(scene, times)
    if not run.ok:
        raise RuntimeError(f"no reference for {scene.name}: {run.message}")
    return run.marker("B")


STIFF = 1e11
"""Pa; CVODES at its tightest takes half a minute beyond."""
