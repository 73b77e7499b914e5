"""MuJoCo behind the engine contract: open chains of rigid bodies, without contacts and limits."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.one_by_one import one_by_one
from shoal.engines.tree.description import SpatialChain
from shoal.engines.tree.scene import SceneTree
from shoal.errors import InputError
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import facts
from shoal.scene import Scene
from shoal.trajectory import Array, Status, Trajectory

JOINTS = {"revolute": "mjJNT_HINGE", "prismatic": "mjJNT_SLIDE", "spherical": "mjJNT_BALL"}
"""What MuJoCo calls them."""


def library() -> Any:
    """The mujoco package. Raises InputError where it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise InputError(f"engine: mujoco cannot be imported ({error}); install shoal[mujoco]") from None
    return mujoco


@dataclass(frozen=True)
class MujocoEngine:
    """MuJoCo's classical Runge-Kutta method at the scene's step, shortened so that steps end on the requested times."""

    name: str = "mujoco"

    @property
    def capabilities(self) -> Capabilities:
        """Rigid bodies hung on each other. It closes loops by soft constraints, which open: they are refused."""
        return Capabilities(
            elements=frozenset({"rigid"}),
            joints=frozenset({"revolute", "spherical", "slider", "weld"}),
            loads=frozenset(),
            features=frozenset({"machines in space"}),
            lanes=False,
        )

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; a run that failed or is not believed carries its status. Raises InputError."""
        started = time.perf_counter()
        wanted = sampling_times(scene, times)
        try:
            require(self, scene)
        except InputError as error:
            soft = "; MuJoCo's are soft and open" if "closed loops" in str(error) else ""
            raise InputError(f"{error}{soft}") from None
        mujoco, tree = library(), SceneTree(scene)
        model = _model(mujoco, tree.chain)
        data = mujoco.MjData(model)
        data.qvel[:] = _rates(tree.chain)
        points, angles, drift, steps = _march(mujoco, model, data, scene, wanted)
        status, message = Status.OK, ""
        if not np.all(np.isfinite(points)):
            status, message = Status.DIVERGED, "the motion is not finite; use a smaller solver.step"
        elif not drift <= scene.solver.energy_tolerance:
            status, message = Status.ENERGY, f"energy is off by {drift:.3g}; reduce solver.step"
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=points[..., : scene.dimensions, None],
            angles=angles[..., None],
            status=(status,),
            energy_drift=np.array([drift]),
            constraint_drift=np.zeros(1),
            steps=steps,
            wall_s=time.perf_counter() - started,
            message=message,
            model={"mujoco": mujoco.__version__, "unknowns": int(model.nv), "constraints": 0, "integrator": "rk4",
                   "step": scene.solver.step} | facts(scene, tree.initial, span(scene)),
        )  # fmt: skip

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane, one after the other; a lane that failed is not a number and has its status."""
        return one_by_one(self, scene, values, times)


def _model(mujoco: Any, chain: SpatialChain) -> Any:
    """The chain in MuJoCo's terms; its joints' coordinates are zero at the start."""
    spec = mujoco.MjSpec()
    spec.option.gravity = chain.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    spec.option.enableflags = mujoco.mjtEnableBit.mjENBL_ENERGY
    made = {"ground": spec.worldbody}
    for name in chain.order:
        joint = chain.joints[name]
        on, own = joint.on_parent, joint.on_body
        turn = Rotation.from_rotvec(on.rotation) * Rotation.from_rotvec(own.rotation).inv()
        body = chain.bodies[joint.body]
        moments, axes = np.linalg.eigh(np.array(body.inertia))
        axes[:, 2] *= np.linalg.det(axes)
        made[joint.body] = link = made[joint.parent].add_body(
            name=joint.body,
            pos=np.array(on.position) - turn.apply(own.position),
            quat=turn.as_quat(scalar_first=True),
            mass=body.mass,
            ipos=body.centre_of_mass,
            iquat=Rotation.from_matrix(axes).as_quat(scalar_first=True),
            inertia=moments,
            explicitinertial=True,
        )
        if joint.kind in JOINTS:
            axis = (0.0, 0.0, 1.0) if joint.axis is None else Rotation.from_rotvec(own.rotation).apply(joint.axis)
            kind = getattr(mujoco.mjtJoint, JOINTS[joint.kind])
            link.add_joint(name=name, type=kind, pos=own.position, axis=axis, damping=[joint.damping, 0.0, 0.0])
    for name, place in chain.points.items():
        made[place.body].add_site(name=name, pos=place.position)
    return spec.compile()


def _rates(chain: SpatialChain) -> Array:
    """Rates of the joints at the start, in MuJoCo's order: of ball joints in the frame of the body."""
    rates: list[float] = []
    for name in chain.order:
        joint, state = chain.joints[name], chain.initial[name]
        rate = np.array(state.rate or ())
        rates += (
            Rotation.from_rotvec(joint.on_body.rotation).apply(rate) if joint.kind == "spherical" else rate
        ).tolist()
    return np.array(rates)


def _march(mujoco: Any, model: Any, data: Any, scene: Scene, wanted: Array) -> tuple[Array, Array, float, int]:
    """Points and angles of the markers at the wanted times, the energy error, and the steps taken."""
    markers = list(scene.markers)
    bodies = [at.body for at in scene.markers.values()]
    points, angles = np.empty((len(wanted), len(markers), 3)), np.empty((len(wanted), len(markers)))
    mujoco.mj_forward(model, data)
    angle = _directions(data, bodies)
    angle += 2 * np.pi * np.round((np.array([scene.start(name).angle for name in bodies]) - angle) / (2 * np.pi))
    begin, lost, off, largest, steps = float(sum(data.energy)), 0.0, 0.0, float(data.energy[1]), 0
    power = float(data.qvel @ (model.dof_damping * data.qvel))
    now = 0.0
    for row, end in enumerate(wanted):
        count = max(1, math.ceil((end - now) / scene.solver.step - 1e-9)) if end > now else 0
        for _ in range(count):
            model.opt.timestep = (end - now) / count
            mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
            before, power = power, float(data.qvel @ (model.dof_damping * data.qvel))
            lost += model.opt.timestep * (before + power) / 2
            off, largest = max(off, abs(float(sum(data.energy)) + lost - begin)), max(largest, float(data.energy[1]))
            there = _directions(data, bodies)
            angle += (there - angle + np.pi) % (2 * np.pi) - np.pi
            steps += 1
        now = float(end)
        points[row], angles[row] = [data.site(name).xpos for name in markers], angle
    scale = max(largest, 1e-9 * abs(begin), np.finfo(float).tiny)
    return points, angles, off / scale, steps


def _directions(data: Any, bodies: list[str]) -> Array:
    """Angles [rad] of the bodies' first axes about z."""
    axes = np.array([data.body(name).xmat.reshape(3, 3)[:, 0] for name in bodies])
    return np.asarray(np.arctan2(axes[:, 1], axes[:, 0]))
