"""Runs of a case by ours and by its peers: error, and CPU time of what counts: ours a whole call, peers a time loop."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from shoal.engines import get_engine
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import library as exudyn_library
from shoal.engines.exudyn.build import silence
from shoal.engines.exudyn.record import choose_steps
from shoal.engines.mujoco.engine import library as mujoco_library
from shoal.engines.mujoco.engine import loaded, quiet
from shoal.engines.mujoco.mjcf import Mjcf
from shoal.scene import Scene

from shoal_validation.contacts.cases import Case
from shoal_validation.contacts.moreau_jean import MoreauJean

Array = Any


class Run(NamedTuple):
    """Angles [rad] and places [m] of the bodies at the end, CPU time [s], and whether the program itself is content."""

    angles: Array
    places: Array
    seconds: float
    ok: bool


def ours(case: Case, **solver: Any) -> Run:
    """Run our solver, a whole call."""
    scene = Scene.parse({**case.data, "solver": {"duration": case.time, **solver}})
    engine, begin = get_engine("gauss"), time.process_time()
    run = engine.simulate(scene, [case.time])
    return Run(run.angles[-1, :, 0], run.points[-1, ..., 0], time.process_time() - begin, run.ok)


def exudyn(case: Case, count: int, stiff: float) -> Run:
    """Run Exudyn for a number of steps, with springs that a step of `stiff` times theirs would have."""
    exu, engine, step = exudyn_library(), ExudynEngine(), case.time / count
    scene = Scene.parse({**case.data, "solver": {"duration": case.time, "step": step * stiff}})
    machine = engine.machine(exu, scene)
    settings = engine.simulation_settings(exu, machine, choose_steps(np.array([case.time]), step, machine.unknowns))
    begin, ok = time.process_time(), True
    with silence(exu):
        try:
            machine.mbs.SolveDynamic(settings, showHints=False, showCausingItems=False)
        except exu.SolverError:
            ok = False
    seconds = time.process_time() - begin
    q = (machine.reference + machine.mbs.systemData.GetODE2Coordinates()).reshape(-1, 3)
    return Run(q[:, 2], q[:, :2], seconds, ok and bool(np.all(np.isfinite(q))))


def mujoco(case: Case, count: int, stiff: float) -> Run:
    """Run MuJoCo likewise, by its fourth-order Runge-Kutta method."""
    library, step = mujoco_library(), case.time / count
    scene = Scene.parse({**case.data, "solver": {"duration": case.time, "step": step * stiff}})
    model, data = loaded(library, Mjcf(scene, soft=True))
    model.opt.timestep = step
    bodies = [data.body(name) for name in case.data["bodies"]]
    library.mj_forward(model, data)
    begin = time.process_time()
    with quiet(library):
        library.mj_step(model, data, count)
    seconds = time.process_time() - begin
    library.mj_forward(model, data)
    turned = [body.xmat.reshape(3, 3)[:, 0] for body in bodies]
    angles, places = np.array([np.arctan2(axis[1], axis[0]) for axis in turned]), np.array([b.xpos[:2] for b in bodies])
    return Run(angles, places, seconds, bool(np.all(np.isfinite(places))))


def moreau_jean(case: Case, count: int) -> Run:
    """Run time stepping, in Python."""
    machine, begin = MoreauJean(case.as_contacts), time.process_time()
    q = machine.run([case.time], case.time / count)[-1]
    return Run(q[:, 2], q[:, :2], time.process_time() - begin, bool(np.all(np.isfinite(q))))


PEERS: dict[str, Callable[..., Run]] = {"Exudyn": exudyn, "MuJoCo": mujoco, "Moreau-Jean": moreau_jean}
