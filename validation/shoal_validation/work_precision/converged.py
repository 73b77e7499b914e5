"""The motion of one mesh, converged in time: what the integrator alone is measured against."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from shoal.engines.casadi import CasadiEngine
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import Beam
from shoal.trajectory import Array

from shoal_validation.problems import Problem, Reference
from shoal_validation.work_precision.mesh import with_mesh

CABLES = ("2C/4C", "2R/4R")
"""Meshes that CasADi, whose model shares no formula with ours, does in a moment."""
BEAMS = ("2G/4G",)
BEAM_STEPS = 25_000


@lru_cache(maxsize=32)
def converged(problem: Problem, mesh: str) -> Reference | None:
    """The time-converged motion of some meshes, with the change by the last refinement as its own error."""
    fine: Callable[[float], Array]
    step = float(problem.times[-1]) / BEAM_STEPS
    if problem.scene().dimensions == 3 and mesh == CABLES[0]:  # CasADi's model knows the plane only
        source, levels = "Exudyn, trapezoidal rule, step {:g} s", (step, 2 * step)
        fine = partial(_exudyn, problem, mesh, "ancf-cable")
    elif problem.scene().dimensions == 3:
        return None
    elif mesh in CABLES:
        source, levels = "CasADi, CVODES (Adams), tolerance {:g}", (1e-12, 1e-11)
        fine = partial(_casadi, problem, mesh)
    elif mesh in BEAMS:
        source, levels = "Exudyn, trapezoidal rule, step {:g} s", (step, 2 * step)
        fine = partial(_exudyn, problem, mesh, "geometrically-exact")
    else:
        return None
    path, before = (fine(level) for level in levels)
    change = float(np.max(np.linalg.norm(path - before, axis=1)))
    return Reference(path, source.format(levels[0]), change)


def _casadi(problem: Problem, mesh: str, tolerance: float) -> Array:
    scene = with_mesh(problem.scene(), mesh)
    return CasadiEngine(tolerance=tolerance).simulate(scene, problem.times).marker(problem.marker)


def _exudyn(problem: Problem, mesh: str, beam: Beam, step: float) -> Array:
    scene = with_mesh(problem.scene(), mesh).with_values({"solver.step": step})
    engine = ExudynEngine(beam=beam, modified_newton=True)
    return engine.simulate(scene, problem.times).marker(problem.marker)
