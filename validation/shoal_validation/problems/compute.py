"""Continuum references of the flexible double pendulums by Exudyn's cables, their error by refinement.

Exudyn's ObjectANCFCable2D (in space ObjectANCFCable) with reduced quadrature and its trapezoidal rule on one very fine
mesh and step. The largest changes by the last refinement, from 64 to 96 elements (in space 48 to 64) and from twice the
step, are taken together as the error: at order two and above each is larger than what remains after it. Our own quintic
elements, which share no shape function with Exudyn's cables, only check the result: their distance is recorded as
`agreement`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.engines.contract import Engine
from shoal.engines.exudyn import ExudynEngine
from shoal.errors import ComputationError
from shoal.trajectory import Array

from shoal_validation.problems.contract import Problem

FINE = {2: (96, 192), 3: (64, 128)}
"""Elements of OA and AB, by dimensions; Exudyn 1.13.6 gives up at the first step of 128/256, and of 96/192 in space."""
COARSE = {2: (64, 128), 3: (48, 96)}
STEP = 2.5e-5
OWN = (16, 32)
OWN_STEP = 1e-5


def compute(problem: Problem) -> dict[str, Any]:
    """The reference of a flexible problem as `computed/NAME.json` holds it. Raises ComputationError."""
    exudyn = ExudynEngine(modified_newton=True)
    dimensions = problem.scene().dimensions
    finest, coarser = FINE[dimensions], COARSE[dimensions]
    fine = _path(exudyn, problem, "ancf-cable", finest, STEP)
    mesh = largest(fine - _path(exudyn, problem, "ancf-cable", coarser, STEP))
    time = largest(fine - _path(exudyn, problem, "ancf-cable", finest, 2 * STEP))
    own = _path(get_engine("gauss"), problem, "ancf-quintic", OWN, OWN_STEP)
    return {
        "times": problem.times.round(12).tolist(),
        "points": fine.round(10).tolist(),
        "source": f"Exudyn, ANCF cables {finest[0]}/{finest[1]}, reduced quadrature, trapezoidal rule, step {STEP:g} s",
        "error": mesh + time,
        "agreement": largest(fine - own),
        "settings": {
            "change_from_mesh": {"elements": list(coarser), "largest": mesh},
            "change_from_step": {"step": 2 * STEP, "largest": time},
            "agreement_with": f"our ancf-quintic {OWN[0]}/{OWN[1]}, leapfrog, step {OWN_STEP:g} s",
        },
    }


def largest(away: Array) -> float:
    """Largest distance [m] over all samples of differences (samples, d)."""
    return float(np.max(np.linalg.norm(away, axis=1)))


def _path(engine: Engine, problem: Problem, element: str, elements: tuple[int, int], step: float) -> Array:
    values: dict[str, object] = {"solver.step": step}
    for body, count in zip(("OA", "AB"), elements, strict=True):
        values |= {f"bodies.{body}.element": element, f"bodies.{body}.elements": count}
        if element == "ancf-cable":
            values[f"bodies.{body}.quadrature"] = "reduced"
    # One interval more than is wanted: of a thinned record Exudyn's engine interpolates the very end wrongly.
    beyond = 2 * problem.times[-1] - problem.times[-2]
    run = engine.simulate(problem.scene().with_values(values), np.append(problem.times, beyond))
    if not run.ok:
        raise ComputationError(f"{problem.name}, {engine.name}, {elements[0]}/{elements[1]} elements: {run.message}")
    return run.marker(problem.marker)[:-1]
