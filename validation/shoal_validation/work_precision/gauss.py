"""Our own solver: elements, meshes, integrators, steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from shoal.engines.gauss import GaussEngine

from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import MANY, OURS, Method, Run, counted
from shoal_validation.work_precision.mesh import twisted, with_mesh

SCENE_MESH = "2C/4C"
"""The mesh of the paper and of the scenes, on which integrators are compared."""
MESHES = (
    *("1C/3R", "1C/5R", "2C/4C", "2R/4R", "2C/7R", "1Q/7R", "1Q/8R", "2R/10R", "1Q/7Q", "2Q/4Q", "4R/8R", "2Q/14R"),
    *("2Q/8Q", "2Q/12Q", "3Q/12Q", "3Q/14Q", "4Q/16Q", "4Q/24Q", "6Q/20Q", "8Q/24Q", "8C/16C", "8R/16R"),
)
"""Unequal meshes put the elements where the curvature is, and let the stiff short rod have few."""
FEW_MESHES = ("1C/5R", "2C/4C", "1Q/7R", "2R/10R", "1Q/7Q", "2Q/14R", "2Q/12Q", "3Q/12Q", "3Q/14Q", "4Q/24Q", "6Q/20Q")
CAPPED_MESHES = ("1Q/7Q", "2Q/6Q", "2Q/7Q")
"""With inertia caps, for which few unknowns are needed."""
MANY_MESHES = ("1C/5R", "2R/10R", "2Q/14R", "2Q/12Q", "3Q/12Q", "4Q/24Q", "6Q/20Q")
IMPLICIT_MESHES = ("2R/4R", "4R/8R", "2Q/6Q", "2Q/8Q", "6Q/20Q", "8E/16E")
EXPLICIT = (500, 600, 700, 800, 900, 1000, 1250, 1500, 1750, 2000, 2500, 3000, 3750, 5000, 7500, 10_000, 20_000)
IMPLICIT = (50, 100, 150, 250, 500, 1000, 2500)
TWISTED_MESHES = ("2D", "4D", "8D", "16D")
RIGID = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
ADAPTIVE = ("dop853", "radau5")
INTEGRATORS = ("leapfrog", "rk4", "semi-implicit-euler", "generalized-alpha", "energy-momentum", "implicit-gauss")
TWISTED = ("generalized-alpha", "energy-momentum")
"""Director rods are stiff: explicit steps as short as they need are beyond what a curve may cost."""
LANES = 64


def methods(problem: Problem, brief: bool) -> list[Method]:
    """All of ours; brief: on few meshes."""
    if not problem.flexible:
        return [
            *(method(name, "", counted(problem, RIGID)) for name in INTEGRATORS),
            *(method(name, "", TOLERANCES) for name in ADAPTIVE),
        ]
    if twisted(problem.scene()):
        return [method(name, mesh, counted(problem, IMPLICIT)) for mesh in TWISTED_MESHES for name in TWISTED]
    meshes = FEW_MESHES if brief else MESHES
    explicit, implicit = counted(problem, EXPLICIT), counted(problem, IMPLICIT)
    found = [method("leapfrog", mesh, explicit) for mesh in meshes]
    found += [method("rk4", mesh, explicit) for mesh in (SCENE_MESH, "4Q/24Q")]
    found += [method("semi-implicit-euler", SCENE_MESH, explicit)]
    found += [method(name, SCENE_MESH, implicit) for name in INTEGRATORS[3:]]
    found += [method(name, SCENE_MESH, TOLERANCES[1:8]) for name in ADAPTIVE]
    found += [method("leapfrog", mesh, explicit, capped=True) for mesh in CAPPED_MESHES]
    found += [method("leapfrog", mesh, explicit, lanes=LANES) for mesh in MANY_MESHES]
    found += [method("leapfrog", mesh, explicit, lanes=LANES, capped=True) for mesh in CAPPED_MESHES]
    if not brief:
        found += [method("generalized-alpha", mesh, implicit) for mesh in IMPLICIT_MESHES]
        found += [method("energy-momentum", mesh, implicit) for mesh in ("2Q/6Q", "6Q/20Q")]
    return found


def method(integrator: str, mesh: str, settings: tuple[float, ...], lanes: int = 1, capped: bool = False) -> Method:
    """An integrator on a mesh (empty: the scene's own); settings: steps [s], or tolerances of an adaptive one."""
    adaptive = integrator in ADAPTIVE

    def prepare(problem: Problem, setting: float) -> Callable[[], Run]:
        values: dict[str, object] = {"solver.integrator": integrator, "solver.inertia_cap": capped}
        # An adaptive integrator takes the scene's step as its first.
        values["solver.relative_tolerance" if adaptive else "solver.step"] = setting
        if adaptive:
            values["solver.absolute_tolerance"] = 0.1 * setting
        scene = with_mesh(problem.scene(), mesh).with_values(values)
        engine = GaussEngine(threads=1)
        if lanes == 1:
            return lambda: Run.of(problem, engine.simulate(scene, problem.times))
        first = next(iter(scene.bodies))
        same = {f"initial.{first}.angle": np.full(lanes, scene.start(first).angle)}
        return lambda: Run.of(problem, engine.simulate_many(scene, same, problem.times))

    family = OURS if lanes == 1 else MANY
    name = f"{integrator}, inertia capped" if capped else integrator
    return Method(family, name, mesh, "tolerance" if adaptive else "step", settings, prepare, lanes=lanes)
