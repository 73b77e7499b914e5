"""scipy's integrators on our accelerations, asked for one at a time from Python and without drift removed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp
from shoal.errors import ComputationError, InputError
from shoal.mechanics.affine import points
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.assembly.placement import place
from shoal.scene import Scene
from shoal.trajectory import Array

from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import Method, Run
from shoal_validation.work_precision.mesh import twisted, with_mesh

FAMILY = "scipy"
Name = Literal["DOP853", "Radau"]
NAMES: tuple[Name, ...] = ("DOP853", "Radau")
MESHES = ("2C/4C", "2R/4R")
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
MOST = 3.0
"""CPU time [s] after which a run is given up: past a singular position a drifted machine may ask for ever more."""


def methods(problem: Problem, brief: bool) -> list[Method]:
    """DOP853 and Radau; brief: the scene's own mesh. Raises InputError."""
    if twisted(problem.scene()):
        raise InputError("director rods are too stiff for what a step costs in Python")
    meshes = (MESHES[:1] if brief else MESHES) if problem.flexible else ("",)
    return [_method(name, mesh) for name in NAMES for mesh in meshes]


def integrate(scene: Scene, problem: Problem, name: Name, tolerance: float) -> Run:
    """Path of the problem's marker by a method of `solve_ivp`. Raises ComputationError."""
    evaluator = Evaluator.of(scene)
    q, v = evaluator.model.q0[:, 0], evaluator.model.v0[:, 0]
    evaluator.acceleration(q, v, 0.0)  # compiled or loaded before the clock begins
    n, began = len(q), time.process_time()

    def rate(t: float, y: Array) -> Array:
        if time.process_time() - began > MOST:
            raise ComputationError(f"given up after {MOST:g} s at {t:.4g} s of motion")
        return np.concatenate([y[n:], evaluator.acceleration(y[:n], y[n:], t)])

    run = solve_ivp(
        rate,
        (0.0, problem.times[-1]),
        np.concatenate([q, v]),
        name,
        t_eval=problem.times,
        rtol=tolerance,
        atol=0.1 * tolerance,
    )
    if not run.success:
        raise ComputationError(run.message)
    at = points([place(scene).point(scene, scene.markers[problem.marker])], n)
    path: Array = (at.matrix[0] @ run.y[:n]).T + at.constant[0]
    return Run(path, evaluations=int(run.nfev))


def _method(name: Name, mesh: str) -> Method:
    def prepare(problem: Problem, tolerance: float) -> Callable[[], Run]:
        scene = with_mesh(problem.scene(), mesh)
        return lambda: integrate(scene, problem, name, tolerance)

    return Method(FAMILY, name, mesh, "tolerance", TOLERANCES, prepare)
