"""CasADi: Lagrange's equations from its own derivation, by CVODES and by its compiled Runge-Kutta step."""

from __future__ import annotations

from collections.abc import Callable

from shoal.engines.capabilities import require
from shoal.engines.casadi import CasadiEngine

from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import Method, Run, counted
from shoal_validation.work_precision.mesh import with_mesh

FAMILY = "CasADi"
MESHES = ("2C/4C", "2R/4R", "4R/8R")
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
STEPS = (100, 500, 1000, 1500, 2500, 5000)


def methods(problem: Problem, brief: bool) -> list[Method]:
    """CVODES (Adams) and RK4; brief: the scene's own mesh. Raises InputError."""
    require(CasadiEngine(), problem.scene())
    meshes = (MESHES[:1] if brief else MESHES) if problem.flexible else ("",)
    return [
        *(_cvodes(mesh) for mesh in meshes),
        *(_runge_kutta(mesh, counted(problem, STEPS)) for mesh in meshes[:1]),
    ]


def _cvodes(mesh: str) -> Method:
    def prepare(problem: Problem, tolerance: float) -> Callable[[], Run]:
        scene = with_mesh(problem.scene(), mesh)
        return lambda: Run.of(problem, CasadiEngine(tolerance=tolerance).simulate(scene, problem.times))

    return Method(FAMILY, "CVODES", mesh, "tolerance", TOLERANCES, prepare)


def _runge_kutta(mesh: str, steps: tuple[float, ...]) -> Method:
    def prepare(problem: Problem, step: float) -> Callable[[], Run]:
        scene = with_mesh(problem.scene(), mesh).with_values({"solver.step": step})
        return lambda: Run.of(problem, CasadiEngine(integrator="rk4").simulate(scene, problem.times))

    return Method(FAMILY, "RK4", mesh, "step", steps, prepare)
