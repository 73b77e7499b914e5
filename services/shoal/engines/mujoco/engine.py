"""MuJoCo behind the engine contract: open chains of rigid bodies; stops, ropes and contacts give way."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.mujoco.mjcf import Mjcf
from shoal.engines.one_by_one import OneByOne
from shoal.errors import InputError
from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.mechanics.reach import span
from shoal.mechanics.start.start import facts
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

STABLE = 1.4
"""Of rates times step: half of what RK4 bears, as machines are stiffer elsewhere."""


def library() -> Any:
    """The mujoco package. Raises InputError where it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise InputError(f"engine: mujoco cannot be imported ({error}); install shoal[mujoco]") from None
    return mujoco


@dataclass(frozen=True)
class MujocoEngine(OneByOne):
    """MuJoCo's classical Runge-Kutta method at the scene's step, shortened so that steps end on the requested times."""

    name: str = "mujoco"

    @property
    def capabilities(self) -> Capabilities:
        """Rigid bodies hung on each other. It closes loops by soft constraints, which open: they are refused."""
        return Capabilities(
            elements=frozenset({"rigid"}),
            joints=frozenset({"revolute", "spherical", "slider", "weld"}),
            loads=frozenset(),
            features=frozenset(
                {
                    "machines in space",
                    "free bodies",
                    "point masses",
                    "stops",
                    "armature",
                    "one-sided distances",
                    "contacts",
                }
            ),
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
        return self.run(Mjcf(scene, soft=True), wanted, started)

    def run(self, machine: Mjcf, wanted: Array, started: float | None = None) -> Trajectory:
        """Run what MJCF says, soft constraints and all: their energy and the work of loads are not followed."""
        started = time.perf_counter() if started is None else started
        mujoco, scene = library(), machine.scene
        model, data = loaded(mujoco, machine)
        followed = not (model.neq or model.nu or scene.loads or machine.springs or np.any(model.dof_frictionloss))
        with quiet(mujoco):
            points, angles, drift, steps = _march(mujoco, model, data, scene, wanted)
        found: list[Finding] = []
        if not np.all(np.isfinite(points)):
            found = [kinds.NOT_FINITE.found("the motion is not finite", "use a smaller solver.step")]
        elif followed and not drift <= scene.solver.energy_tolerance:
            found = [kinds.ENERGY.found(f"energy is off by {drift:.3g}", "reduce solver.step", drift=drift)]
        stiff = {name: one._asdict() for name, one in machine.springs.items()}
        started_as = facts(scene, machine.initial, span(scene)) | ({"contacts": stiff} if stiff else {})
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=points[..., : scene.dimensions, None],
            angles=angles[..., None],
            energy_drift=np.array([drift if followed else np.nan]),
            constraint_drift=np.zeros(1),
            steps=steps,
            wall_s=time.perf_counter() - started,
            lane_findings=[found],
            model={"mujoco": mujoco.__version__, "unknowns": int(model.nv), "constraints": int(model.neq),
                   "integrator": "rk4", "step": scene.solver.step} | started_as,
        )  # fmt: skip


@contextmanager
def quiet(mujoco: Any) -> Iterator[None]:
    """No warnings of steps that diverge, which MuJoCo otherwise also writes to a file where one is."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def loaded(mujoco: Any, machine: Mjcf) -> tuple[Any, Any]:
    """The model and its state at the start; one that diverges is not put back there, as MuJoCo would."""
    model = mujoco.MjModel.from_xml_string(machine.text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    data = mujoco.MjData(model)
    data.qvel[:] = machine.rates
    return model, data


def stepped(scene: Scene) -> Mjcf:
    """A scene as MJCF, with half its step, and again, until springs and dampers are not too stiff for it at the start.

    Raises InputError that names what MJCF has not.
    """
    mujoco, machine = library(), Mjcf(scene)
    model, data = loaded(mujoco, machine)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    start, rest = data.qpos.copy(), data.qfrc_passive.copy()
    stiff, damped = np.zeros_like(mass), np.zeros_like(mass)
    for column, unit in enumerate(np.eye(model.nv)):
        data.qvel[:] = machine.rates + unit
        mujoco.mj_forward(model, data)
        damped[:, column] = rest - data.qfrc_passive
        data.qvel[:] = machine.rates
        mujoco.mj_integratePos(model, data.qpos, unit, 1e-6)
        mujoco.mj_forward(model, data)
        stiff[:, column] = (rest - data.qfrc_passive) / 1e-6
        data.qpos[:] = start
    fastest = max(
        float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(mass, damped))), initial=0.0)),
        float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiff))), initial=0.0)) ** 0.5,
    )
    halvings = max(0, math.ceil(math.log2(max(fastest * scene.solver.step / STABLE, 1e-9))))
    return machine if halvings == 0 else Mjcf(scene.with_values({"solver.step": scene.solver.step / 2**halvings}))


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
