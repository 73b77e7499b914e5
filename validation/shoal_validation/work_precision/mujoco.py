"""MuJoCo on machines of rigid bodies, by the file that `shoal export` writes: its own integrators, soft loops."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from shoal.engines.mujoco.engine import library, loaded, quiet
from shoal.engines.mujoco.mjcf import Mjcf
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Status

from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import Method, Run, counted

FAMILY = "MuJoCo"
INTEGRATORS = {"RK4": "mjINT_RK4", "semi-implicit Euler": "mjINT_EULER", "implicitfast": "mjINT_IMPLICITFAST"}
STEPS = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000)


def methods(problem: Problem, brief: bool) -> list[Method]:
    """Three integrators. Raises InputError where MJCF has not what the scene has, or MuJoCo is missing."""
    if problem.flexible:
        raise InputError("MuJoCo has no such beam")
    library()
    model, _ = _model(problem.scene().model_dump_json())
    soft = ", soft loops" if model.neq else ""
    return [_method(name, soft, counted(problem, STEPS)) for name in INTEGRATORS]


def _method(name: str, soft: str, steps: tuple[float, ...]) -> Method:
    def prepare(problem: Problem, step: float) -> Callable[[], Run]:
        text = problem.scene().with_values({"solver.step": step}).model_dump_json()
        return lambda: _run(problem, text, name, step)

    return Method(FAMILY, f"{name}{soft}", "", "step", steps, prepare)


def _run(problem: Problem, text: str, name: str, step: float) -> Run:
    mujoco, (model, rates) = library(), _model(text)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, INTEGRATORS[name])
    data = mujoco.MjData(model)
    data.qvel[:] = rates
    dimensions = problem.scene().dimensions
    path = np.empty((len(problem.times), dimensions))
    with quiet(mujoco):
        for k, gap in enumerate(np.diff(problem.times, prepend=0.0)):
            count = max(1, round(gap / step))
            model.opt.timestep = gap / count
            mujoco.mj_step(model, data, count)
            mujoco.mj_kinematics(model, data)
            path[k] = data.site(problem.marker).xpos[:dimensions]
    return Run(path, Status.OK if np.all(np.isfinite(path)) else Status.DIVERGED)


@lru_cache(maxsize=16)
def _model(text: str) -> tuple[Any, list[float]]:
    """The compiled model, whose soft constraints give way within two of its steps, and the rates of the start.

    A user's second call has it ready, as ours has.
    """
    machine = Mjcf(Scene.model_validate_json(text))
    return loaded(library(), machine)[0], machine.rates
