"""Exudyn at its fastest settings: modified Newton, files off, steps as long as the sampling allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from shoal.engines.capabilities import require
from shoal.engines.exudyn import ExudynEngine
from shoal.scene import Scene

from shoal_validation.benchmarks.forward import exudyn_loop
from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import Method, Run, counted
from shoal_validation.work_precision.mesh import twisted, with_mesh

FAMILY = "Exudyn"
RADIUS = 0.8
"""Of generalized-alpha; with a radius of 1 it is the trapezoidal rule."""
MESHES = (
    *("2R/4R", "2R/8R", "3R/6R", "4R/8R", "4R/12R", "6R/12R", "8R/16R", "12R/24R", "16R/32R", "24R/48R"),
    *("2C/4C", "4C/8C", "8C/16C", "16C/32C"),
)
FEW_MESHES = ("2C/4C", "2R/8R", "3R/6R", "4R/12R", "6R/12R", "12R/24R", "24R/48R")
DAMPED_MESHES = ("2C/4C", "3R/10R", "6R/12R", "24R/48R")
BEAM_MESHES = ("2G/4G", "4G/8G", "8G/16G")
TWISTED_MESHES = ("2D", "4D", "8D", "16D")
FLEXIBLE = (50, 100, 150, 250, 500, 1000, 1500, 2500)
RIGID = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000)


def methods(problem: Problem, brief: bool) -> list[Method]:
    """Both beams, both quadratures, both integrators; brief: on few meshes. Raises InputError."""
    cable, damped = (
        ExudynEngine(modified_newton=True),
        ExudynEngine(modified_newton=True, integrator="generalized-alpha"),
    )
    beam = ExudynEngine(modified_newton=True, beam="geometrically-exact")
    steps = counted(problem, FLEXIBLE)
    if twisted(problem.scene()):
        soft = replace(beam, integrator="generalized-alpha")
        named = (*((beam, mesh) for mesh in TWISTED_MESHES), (soft, TWISTED_MESHES[-1]))
        return [_method(engine, mesh, steps) for engine, mesh in named]
    require(cable, problem.scene())
    if not problem.flexible:
        return [_method(engine, "", counted(problem, RIGID)) for engine in (cable, damped)]
    return [
        *(_method(cable, mesh, steps) for mesh in (FEW_MESHES if brief else MESHES)),
        *(_method(damped, mesh, steps) for mesh in (DAMPED_MESHES[:2] if brief else DAMPED_MESHES)),
        *(_method(beam, mesh, steps) for mesh in (BEAM_MESHES[:1] if brief else BEAM_MESHES)),
    ]


def _method(engine: ExudynEngine, mesh: str, steps: tuple[float, ...]) -> Method:
    damped = engine.integrator == "generalized-alpha"

    def scene(problem: Problem, step: float) -> Scene:
        values: dict[str, object] = {"solver.step": step, "solver.spectral_radius": RADIUS}
        return with_mesh(problem.scene(), mesh).with_values(values)

    def prepare(problem: Problem, step: float) -> Callable[[], Run]:
        what = scene(problem, step)
        return lambda: Run.of(problem, engine.simulate(what, problem.times))

    def loop(problem: Problem, step: float) -> float:
        return exudyn_loop(engine, scene(problem, step))

    name = f"generalized-alpha ({RADIUS:g})" if damped else "trapezoidal"
    return Method(FAMILY, name, mesh, "step", steps, prepare, loop)
