"""Continuum reference of a rod that bends about two axes and twists, by Exudyn's geometrically exact beams.

Both Exudyn's beams and our director rods converge with the square of their length: each is extrapolated from two
meshes. The changes by the last refinements of mesh and step are taken as the error, or how far our rods, which do not
shear, are away, if that is more (recorded as `agreement`): the slender rod is meant.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.engines.contract import Engine
from shoal.engines.exudyn import ExudynEngine
from shoal.errors import ComputationError
from shoal.trajectory import Array

from shoal_validation.problems.compute import largest
from shoal_validation.problems.contract import Problem

MESHES = 32, 64
"""Elements of the scene; Exudyn has two beams in each."""
STEP = 2.5e-4


def compute(problem: Problem) -> dict[str, Any]:
    """The reference as `computed/NAME.json` holds it. Raises ComputationError."""
    exudyn = ExudynEngine(beam="geometrically-exact", modified_newton=True)
    coarse, fine = (_path(exudyn, problem, count, STEP) for count in MESHES)
    slow = _path(exudyn, problem, MESHES[0], 2 * STEP)
    points = _extrapolated(coarse, fine)
    before = _extrapolated(_path(exudyn, problem, MESHES[0] // 2, STEP), coarse)
    mesh, time = largest(points - before), largest(coarse - slow)
    own = _extrapolated(*(_path(get_engine("gauss"), problem, count, STEP) for count in MESHES))
    away = largest(points - own)
    beams = [2 * count for count in MESHES]
    return {
        "times": problem.times.round(12).tolist(),
        "points": points.round(10).tolist(),
        "source": f"Exudyn, {beams[0]} and {beams[1]} geometrically exact beams, extrapolated, step {STEP:g} s",
        "error": max(mesh + time, away),
        "agreement": away,
        "settings": {
            "change_from_mesh": {"elements": MESHES[0] // 2, "largest": mesh},
            "change_from_step": {"step": 2 * STEP, "largest": time},
            "agreement_with": f"our director rods, extrapolated from {MESHES[0]} and {MESHES[1]}, step {STEP:g} s",
        },
    }


def _extrapolated(coarse: Array, fine: Array) -> Array:
    """The limit of a method of second order on meshes of which one is twice as fine."""
    return np.asarray((4 * fine - coarse) / 3)


def _path(engine: Engine, problem: Problem, count: int, step: float) -> Array:
    rods: dict[str, object] = {f"bodies.{name}.elements": count for name in problem.scene().bodies}
    run = engine.simulate(problem.scene().with_values(rods | {"solver.step": step}), problem.times)
    if not run.ok:
        raise ComputationError(f"{problem.name}, {engine.name}, {count} elements: {run.message}")
    return run.marker(problem.marker)
