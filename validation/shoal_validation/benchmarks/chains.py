"""A chain of rigid bodies in space beside MuJoCo and Exudyn, and the growth of the cost with the number of bodies.

Every figure is the median time of one step on one core in one process, over a run of many steps from the
same state: a chain that hangs in revolute joints about alternating axes, from a gently curved start at rest.

- ours: classical Runge-Kutta, four accelerations a step, with the energy balance of every step
- natural coordinates: the machine as scenes describe it, points and directions with constraints, the same method; the
  rest of a call is taken off by a shorter run
- MuJoCo: `mj_step` with its RK4 integrator, same step, contacts and constraints off, no geoms. It factors a mass
  matrix, whose cost grows with the cube of the depth of a tree; its users' machines are wider than deep
- Exudyn, tree: ObjectKinematicTree, also minimal coordinates and RK44, with the sparse solver
- Exudyn, bodies: six coordinates a body and five constraints a joint, generalized-alpha, modified Newton, Tait-Bryan
  angles and the sparse solver, the fastest of its ways at this step. An implicit step may be longer than an
  explicit one; how much longer depends on what is asked of the result

`gap` is how far the tip is from ours at the end of the run [m].
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from shoal.engines import get_engine
from shoal.engines.exudyn.build import library
from shoal.engines.prepared import Prepared
from shoal.engines.tree.articulated import accelerate
from shoal.engines.tree.march import march
from shoal.engines.tree.scene import SceneTree
from shoal.engines.tree.tableau import RK4
from shoal.engines.tree.tree import room
from shoal.scene import Scene

from shoal_validation.benchmarks.timing import median_time

Array = npt.NDArray[np.float64]

BODIES = (50, 100, 200, 400, 800)
STEP = 1e-3
GRAVITY = (0.0, -6.0, -7.8)
MOMENTS = (0.002, 0.084, 0.085)
"""About the centre [kg m^2], of a link of 1 m and 1 kg."""


@dataclass(frozen=True)
class ChainRow:
    """One engine on one chain: seconds a step, times ours, distance of its tip from ours [m]."""

    name: str
    bodies: int
    seconds: float
    ratio: float
    gap: float


def turns(bodies: int) -> list[Array]:
    """Axes of the links at the start, as columns, (3, 3) each."""
    found = [np.eye(3)]
    for k, angle in enumerate(_angles(bodies)):
        found.append(found[-1] @ Rotation.from_rotvec(angle * np.array(_axis(k))).as_matrix())
    return found[1:]


def chain(bodies: int) -> Scene:
    """Links of 1 m along x, joints about y and z in turn, at angles of 0.1 sin k."""
    before: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    parts: dict[str, Any] = {"bodies": {}, "joints": {}, "initial": {}}
    for k, turn in enumerate(turns(bodies)):
        name = f"B{k}"
        parts["bodies"][name] = {"kind": "rigid-body", "mass": 1.0, "inertia": MOMENTS, "centre_of_mass": [0.5, 0, 0],
                                 "named_points": {"end": [1.0, 0.0, 0.0]}}  # fmt: skip
        parts["joints"][f"J{k}"] = {"kind": "revolute", "first": before, "second": {"body": name},
                                    "axis": (turn @ _axis(k)).tolist()}  # fmt: skip
        parts["initial"][name] = {"rotation": Rotation.from_matrix(turn).as_rotvec().tolist(), "spin": [0, 0, 0]}
        before = {"body": name, "point": "end"}
    scene = {"name": f"chain-{bodies}", "dimensions": 3, "gravity": GRAVITY, "markers": {"tip": before},
             "solver": {"integrator": "rk4", "step": STEP, "duration": STEP}}  # fmt: skip
    return Scene.parse(scene | parts)


def measure(sizes: tuple[int, ...] = BODIES, repeats: int = 5) -> Iterator[ChainRow]:
    """All engines on chains of these sizes; a row as soon as it is known."""
    for bodies in sizes:
        steps = max(20, 20_000 // bodies)
        ours, tip = own_step(bodies, steps, repeats)
        yield ChainRow("ours, one acceleration", bodies, own_acceleration(bodies), float("nan"), 0.0)
        yield ChainRow("ours, one step", bodies, ours, 1.0, 0.0)
        few = min(200, max(10, 400_000 // bodies**2))
        for name, run, count in (
            ("natural coordinates, one step", natural_run, 40),
            ("MuJoCo, one step", mujoco_run, few),
            ("Exudyn, tree, one step", exudyn_tree_run, few),
            ("Exudyn, bodies, one step", exudyn_bodies_run, 20),
        ):
            seconds, there = run(bodies, count, repeats if bodies < 400 else min(3, repeats))
            yield ChainRow(name, bodies, seconds, seconds / ours, float(np.linalg.norm(there - tip(count * STEP))))


def own_acceleration(bodies: int) -> float:
    """Seconds of one call of the articulated-body recursion."""
    model = SceneTree(chain(bodies))
    work, out = room(model.tree), np.zeros(bodies)
    return median_time(lambda: accelerate(model.tree, work, model.q, model.v, out), 200)


def own_step(bodies: int, steps: int, repeats: int) -> tuple[float, Callable[[float], Array]]:
    """Seconds a step of the compiled loop; and where the tip is at a given time."""
    scene = chain(bodies)
    model = SceneTree(scene)
    work, end = room(model.tree), np.array([steps * STEP])

    def run() -> None:
        march(model.tree, work, RK4, np.concatenate([model.q, model.v, [0.0]]), end, STEP, 0.0)

    return median_time(run, repeats) / steps, lambda at: get_engine("tree").simulate(scene, [at]).marker("tip")[0]


def natural_run(bodies: int, steps: int, repeats: int) -> tuple[float, Array]:
    """Seconds a step of the same chain by the native solver, and the tip at the end."""
    scene = chain(bodies).with_values({"solver.duration": steps * STEP})
    run, few = Prepared(scene, threads=1), steps // 4
    longer, shorter = (median_time(partial(run, times=[n * STEP]), repeats) for n in (steps, few))
    found = run(times=[steps * STEP])
    if not found.ok:
        raise RuntimeError(found.message)
    return (longer - shorter) / (steps - few), found.marker("tip")[-1]


def mujoco_run(bodies: int, steps: int, repeats: int) -> tuple[float, Array]:
    """Seconds a step of mj_step, and the tip at the end."""
    import mujoco

    # Built by calls: its XML may not be nested as deeply as the longest chain.
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = STEP, GRAVITY
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    link = spec.worldbody
    for k in range(bodies):
        link = link.add_body(
            pos=[1.0 if k else 0.0, 0.0, 0.0], mass=1.0, ipos=[0.5, 0.0, 0.0], inertia=MOMENTS, explicitinertial=True
        )
        link.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=_axis(k))
    link.add_site(name="tip", pos=[1.0, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)

    def once() -> float:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = _angles(bodies)
        begin = time.perf_counter()
        mujoco.mj_step(model, data, steps)
        return time.perf_counter() - begin

    seconds = _median(once, repeats) / steps
    mujoco.mj_forward(model, data)
    return seconds, np.array(data.site("tip").xpos)


def exudyn_tree_run(bodies: int, steps: int, repeats: int) -> tuple[float, Array]:
    """Seconds a step of Exudyn's tree of minimal coordinates, and the tip at the end."""
    exu = library()
    from exudyn import itemInterface

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = mbs.AddNode(
        itemInterface.NodeGenericODE2(
            referenceCoordinates=[0.0] * bodies,
            initialCoordinates=_angles(bodies),
            initialCoordinates_t=[0.0] * bodies,
            numberOfODE2Coordinates=bodies,
        )
    )
    kinds = exu.JointType
    tree = mbs.AddObject(
        itemInterface.ObjectKinematicTree(
            nodeNumber=node,
            gravity=list(GRAVITY),
            jointTypes=[kinds.RevoluteZ if k % 2 else kinds.RevoluteY for k in range(bodies)],
            linkParents=list(range(-1, bodies - 1)),
            jointTransformations=exu.Matrix3DList([np.eye(3)] * bodies),
            jointOffsets=exu.Vector3DList([[1.0 if k else 0.0, 0.0, 0.0] for k in range(bodies)]),
            linkInertiasCOM=exu.Matrix3DList([np.diag(MOMENTS)] * bodies),
            linkCOMs=exu.Vector3DList([[0.5, 0.0, 0.0]] * bodies),
            linkMasses=[1.0] * bodies,
        )
    )
    tip = mbs.AddMarker(
        itemInterface.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=bodies - 1, localPosition=[1, 0, 0])
    )
    mbs.Assemble()
    settings = _settings(exu, steps, exu.DynamicSolverType.RK44)
    settings.timeIntegration.explicit.computeEndOfStepAccelerations = False
    seconds = _median(lambda: _solve(exu, mbs, settings), repeats) / steps
    return seconds, np.array(mbs.GetMarkerOutput(tip, exu.OutputVariableType.Position))


def exudyn_bodies_run(bodies: int, steps: int, repeats: int) -> tuple[float, Array]:
    """Seconds a step of Exudyn's bodies with joints as constraints, and the tip at the end."""
    exu = library()
    from exudyn import rigidBodyUtilities

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    before, place = mbs.CreateGround(), np.zeros(3)
    for k, turn in enumerate(turns(bodies)):
        body = mbs.CreateRigidBody(
            inertia=rigidBodyUtilities.RigidBodyInertia(mass=1.0, inertiaTensor=np.diag(MOMENTS), com=[0.0, 0.0, 0.0]),
            referencePosition=place + 0.5 * turn[:, 0],
            referenceRotationMatrix=turn,
            gravity=list(GRAVITY),
            nodeType=exu.NodeType.RotationRxyz,
        )
        mbs.CreateRevoluteJoint(itemNumbers=[before, body], position=place, axis=turn @ _axis(k), useGlobalFrame=True)
        before, place = body, place + turn[:, 0]
    mbs.Assemble()
    settings = _settings(exu, steps, exu.DynamicSolverType.GeneralizedAlpha)
    settings.timeIntegration.newton.useModifiedNewton = True
    seconds = _median(lambda: _solve(exu, mbs, settings), repeats) / steps
    return seconds, np.array(mbs.GetObjectOutputBody(before, exu.OutputVariableType.Position, [0.5, 0.0, 0.0]))


def _settings(exu: Any, steps: int, solver: Any) -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = steps, steps * STEP
    integration.adaptiveStep = integration.automaticStepSize = False
    integration.verboseMode = 0
    integration.solverType = solver
    return settings


def _solve(exu: Any, mbs: Any, settings: Any) -> float:
    # The solver keeps its result apart from the initial values, so that every call starts anew.
    begin = time.perf_counter()
    if not mbs.SolveDynamic(settings, showHints=False):
        raise RuntimeError("exudyn: the solver gave up")
    return time.perf_counter() - begin


def _median(once: Callable[[], float], repeats: int) -> float:
    once()
    return statistics.median(once() for _ in range(repeats))


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    for row in measure():
        print(  # noqa: T201 - a command
            f"{row.bodies:4d} bodies  {row.name:26s} {row.seconds * 1e6:10.1f} us {row.ratio:7.1f} times ours, "
            f"gap {row.gap:.1e} m",
            flush=True,
        )


def _axis(k: int) -> tuple[float, float, float]:
    return (0.0, 0.0, 1.0) if k % 2 else (0.0, 1.0, 0.0)


def _angles(bodies: int) -> list[float]:
    return [0.1 * float(np.sin(k)) for k in range(bodies)]


if __name__ == "__main__":
    main()
