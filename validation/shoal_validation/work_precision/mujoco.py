"""MuJoCo on open chains of rigid bodies: relative angles, its own integrators."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from shoal.engines.capabilities import loops
from shoal.errors import InputError
from shoal.scene import GROUND, PointMass, Revolute, Scene
from shoal.trajectory import Status

from shoal_validation.problems import Problem
from shoal_validation.work_precision.contract import Method, Run, counted

FAMILY = "MuJoCo"
INTEGRATORS = {"RK4": "mjINT_RK4", "semi-implicit Euler": "mjINT_EULER", "implicitfast": "mjINT_IMPLICITFAST"}
STEPS = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000)
SMALLEST = 1e-12
"""Least moment of inertia [kg m^2] that is passed on: MuJoCo refuses bodies that have none."""


def methods(problem: Problem, brief: bool) -> list[Method]:
    """Three integrators. Raises InputError where the scene is no open chain of hinges, or MuJoCo is missing."""
    if problem.flexible:
        raise InputError("MuJoCo has no such beam")
    _library()
    _model(problem.scene().model_dump_json())
    return [_method(name, counted(problem, STEPS)) for name in INTEGRATORS]


def _method(name: str, steps: tuple[float, ...]) -> Method:
    def prepare(problem: Problem, step: float) -> Callable[[], Run]:
        scene = problem.scene()
        return lambda: _run(problem, scene, name, step)

    return Method(FAMILY, name, "", "step", steps, prepare)


def _run(problem: Problem, scene: Scene, name: str, step: float) -> Run:
    mujoco, model = _library(), _model(scene.model_dump_json())
    model.opt.integrator = getattr(mujoco.mjtIntegrator, INTEGRATORS[name])
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = _relative(scene, "angle"), _relative(scene, "rate")
    path = np.empty((len(problem.times), 2))
    for k, gap in enumerate(np.diff(problem.times, prepend=0.0)):
        count = max(1, round(gap / step))
        model.opt.timestep = gap / count
        mujoco.mj_step(model, data, count)
        mujoco.mj_kinematics(model, data)
        path[k] = data.site(problem.marker).xpos[:2]
    return Run(path, Status.OK if np.all(np.isfinite(path)) else Status.DIVERGED)


@cache
def _library() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise InputError(f"MuJoCo cannot be imported: {error}") from error
    return mujoco


def _hinges(scene: Scene) -> dict[str, tuple[str, Revolute]]:
    """Body -> the body it hangs on and the joint, in the scene's order. Raises InputError."""
    if scene.loads or scene.ground_points or list(loops(scene)):
        raise InputError("MuJoCo is given open chains without loads only")
    found: dict[str, tuple[str, Revolute]] = {}
    for joint in scene.joints.values():
        if not isinstance(joint, Revolute) or joint.friction or joint.coulomb:
            raise InputError("MuJoCo is given free hinges only")
        if joint.first.body not in (GROUND, *found):
            raise InputError("MuJoCo is given chains that are listed from the ground on")
        found[joint.second.body] = (joint.first.body, joint)
    return found


def _relative(scene: Scene, field: str) -> list[float]:
    """Angles [rad] or rates [rad/s] of every body from the one it hangs on."""
    own = {GROUND: 0.0, **{name: float(getattr(scene.start(name), field)) for name in scene.bodies}}
    return [own[name] - own[before] for name, (before, _) in _hinges(scene).items()]


@lru_cache(maxsize=8)
def _model(text: str) -> Any:
    """The compiled model; a user's second call has it ready, as ours has."""
    mujoco, scene = _library(), Scene.model_validate_json(text)
    spec = mujoco.MjSpec()
    spec.option.gravity = [*scene.gravity, 0.0]
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    placed, pivots = {GROUND: spec.worldbody}, {GROUND: np.zeros(2)}
    for name, (before, joint) in _hinges(scene).items():
        body = scene.bodies[name]
        if isinstance(body, PointMass):
            raise InputError("MuJoCo is given bodies with an extension only")
        # A body's frame lies at its joint here; in a scene, at its own origin.
        pivots[name] = np.array(scene.location(joint.second))
        inertia = max(body.inertia, SMALLEST)
        placed[name] = placed[before].add_body(
            pos=[*(np.array(scene.location(joint.first)) - pivots[before]), 0.0],
            mass=body.mass,
            ipos=[*(np.array(body.centre_of_mass) - pivots[name]), 0.0],
            inertia=[inertia, inertia, inertia],
            explicitinertial=True,
        )
        placed[name].add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
    for name, marker in scene.markers.items():
        at = np.array(scene.location(marker)) - pivots[marker.body]
        placed[marker.body].add_site(name=name, pos=[*at, 0.0])
    return spec.compile()
