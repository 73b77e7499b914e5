"""The CasADi engine: Lagrange's equations from the energies, integrated by CVODES to tight tolerances."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from shoal.engines.capabilities import require
from shoal.engines.contract import Capabilities, check_lanes, sampling_times
from shoal.engines.interrupts import interruptible
from shoal.errors import InputError
from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.mechanics.reach import MARGIN, stretch
from shoal.mechanics.start.start import started
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

if TYPE_CHECKING:
    from shoal.engines.casadi.model import CasadiModel

_CHECK_INTERVAL = 0.01
"""Longest time [s] between two instants at which energy, reach and directions are looked at."""


@dataclass(frozen=True)
class CasadiEngine:
    """Simulates open chains of rigid bodies and cables under springs, and loads that depend on no time.

    CVODES does not use the scene's own integrator and step.

    integrator: `cvodes` (variable step; Adams, whose functional iteration needs no Jacobian and suits motion
        without damping) or `rk4` (the scene's step)
    tolerance: of CVODES, absolute (SI units) and relative
    max_steps: of CVODES between two of the instants at which the run is checked
    """

    integrator: Literal["cvodes", "rk4"] = "cvodes"
    tolerance: float = 1e-11
    max_steps: int = 1_000_000
    name: str = "casadi"

    @property
    def capabilities(self) -> Capabilities:
        """Return the kinds in the tables of `tree` and `loads`; no library is imported."""
        return Capabilities(
            elements=frozenset({"rigid", "ancf-cable"}),
            joints=frozenset({"revolute"}),
            loads=frozenset({"spring", "torsion-spring", "force", "torque", "distributed-force"}),
            features=frozenset({"point masses", "dry friction", "quadratic drag", "tapered flexible rods", "signals"}),
            lanes=False,
        )

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; `times` [s] are the sampling instants, else the scene's own. Raises InputError."""
        return self._trajectory([scene], sampling_times(scene, times))

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane, one after the other; a failed lane holds NaN. Raises InputError."""
        lanes = check_lanes(scene, values)
        columns = {path: np.asarray(column, dtype=float).reshape(lanes) for path, column in values.items()}
        scenes = [scene.with_values({path: float(column[i]) for path, column in columns.items()}) for i in range(lanes)]
        return self._trajectory(scenes, sampling_times(scene, times))

    def _trajectory(self, scenes: list[Scene], times: Array) -> Trajectory:
        from shoal.engines.casadi.model import casadi_model

        began = time.perf_counter()
        for scene in scenes:
            require(self, scene)
        runs = [self._run(casadi_model(scene), scene, times) for scene in scenes]
        model = casadi_model(scenes[0])
        return Trajectory(
            engine=self.name,
            times=times,
            markers=model.markers,
            points=np.stack([run.points for run in runs], axis=-1),
            angles=np.stack([run.angles for run in runs], axis=-1),
            energy_drift=np.array([run.energy_drift for run in runs]),
            constraint_drift=np.zeros(len(runs)),
            steps=max(run.steps for run in runs),
            wall_s=time.perf_counter() - began,
            lane_findings=[run.findings for run in runs],
            model={
                "formulation": "Lagrange, minimal coordinates",
                "unknowns": model.unknowns,
                "elements": {name: getattr(body, "elements", 1) for name, body in scenes[0].bodies.items()},
                "integrator": self.integrator,
                **({"tolerance": self.tolerance} if self.integrator == "cvodes" else {"step": scenes[0].solver.step}),
            },
        )

    def _run(self, model: CasadiModel, scene: Scene, times: Array) -> _Run:
        scene = started(scene).scene
        starts = [scene.start(name) for name in model.bodies]
        x0 = model.start([start.angle for start in starts], [start.rate for start in starts])
        grid, wanted = _check_grid(times)
        try:
            with interruptible():
                states, steps = self._integrate(model, scene, x0, grid[1:])
        except RuntimeError as error:
            text = f"the integrator stopped: {_reason(error)}"
            return _failed(model, times.size, kinds.ENGINE_STOPPED.found(text))
        return _check(model, scene, np.hstack([x0.full(), states]), wanted, steps)

    def _integrate(self, model: CasadiModel, scene: Scene, x0: Any, grid: Array) -> tuple[Array, int]:
        """States at the instants of `grid`, (2 unknowns + 1, samples), and the number of steps."""
        if grid.size == 0:
            return np.empty((x0.numel(), 0)), 0
        if self.integrator == "rk4":
            run, substeps, steps = _runge_kutta(model, grid.tobytes(), scene.solver.step)
            return run(x0, substeps).full(), steps
        if self.integrator != "cvodes":
            raise InputError(f"integrator: engine casadi has cvodes and rk4, found {self.integrator}")
        integrator = _cvodes(model, grid.tobytes(), self.tolerance, self.max_steps)
        states = integrator(x0=x0)["xf"].full()
        return states, int(integrator.stats()["nsteps"])


@dataclass(frozen=True)
class _Run:
    points: Array
    angles: Array
    findings: list[Finding]
    energy_drift: float
    steps: int


@lru_cache(maxsize=64)
def _cvodes(model: CasadiModel, grid: bytes, tolerance: float, max_steps: int) -> Any:
    import casadi as ca

    symbol = ca.SX.sym("x", 2 * model.unknowns + 1)
    # Adams never asks for the Jacobian, and deriving it would cost more than all the rest.
    rate = ca.Function("rate", [symbol], [model.rate(symbol)], {"is_diff_in": [False], "is_diff_out": [False]})
    x = ca.MX.sym("x", symbol.numel())
    options: dict[str, Any] = {
        "abstol": tolerance,
        "reltol": tolerance,
        "max_num_steps": max_steps,
        "linear_multistep_method": "adams",
        "nonlinear_solver_iteration": "functional",
    }
    problem: Any = {"x": x, "ode": rate(x)}
    return ca.integrator("motion", "cvodes", problem, 0.0, np.frombuffer(grid).tolist(), options)


@lru_cache(maxsize=64)
def _runge_kutta(model: CasadiModel, grid: bytes, step: float) -> tuple[Any, Array, int]:
    from shoal.engines.casadi.fixed_step import runge_kutta

    return runge_kutta(model, np.frombuffer(grid), step)


def _check_grid(times: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """Instants from 0 s that hold `times` [s] exactly and lie close together, and where `times` are in them."""
    knots = np.unique(np.concatenate([[0.0], times]))
    counts = np.maximum(1, np.ceil(np.diff(knots) / _CHECK_INTERVAL * (1 - 1e-9))).astype(int)
    pieces = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(knots[:-1], knots[1:], counts, strict=True)]
    grid = np.concatenate([knots[:1], *pieces])
    return grid, np.searchsorted(grid, times)


def _check(model: CasadiModel, scene: Scene, states: Array, wanted: npt.NDArray[np.intp], steps: int) -> _Run:
    """Judge a run by its states at the instants of the check grid, (2 unknowns + 1, instants)."""
    if not np.all(np.isfinite(states)):
        return _failed(model, wanted.size, kinds.NOT_FINITE.found("the motion is not finite"), steps)
    instants = states.shape[1]
    points, angles = (value.full() for value in model.places(states))
    points = points.reshape(2, instants, len(model.markers)).transpose(1, 2, 0)
    angles = np.unwrap(angles.reshape(len(model.markers), instants, order="F").T, axis=0)
    angles += [scene.start(marker.body).angle for marker in scene.markers.values()] - angles[0]
    # An unstable run may overflow on its way to being rejected.
    with np.errstate(all="ignore"):
        drift = _energy_drift(model, states)
        longer = stretch(scene, np.max(np.sum(model.energies(states).full()[:2], axis=0)))
        distance = np.linalg.norm(points - model.root.T, axis=2).max(axis=0)
    reach = model.reach + longer
    excess = distance - MARGIN * reach
    found: list[Finding] = []
    if not np.all(excess <= 1e-9):
        worst = int(np.argmax(excess))
        away, chain = distance[worst], reach[worst]
        text = f"marker {model.markers[worst]} goes {away:.4g} m away, its chain is {chain:.4g} m long"
        found = [kinds.OUT_OF_REACH.found(text, distance=float(away), reach=float(chain))]
    elif not drift <= scene.solver.energy_tolerance:
        text = f"energy drifts by {drift:.2g}, allowed is {scene.solver.energy_tolerance:.2g}"
        found = [kinds.ENERGY.found(text, drift=drift, allowed=scene.solver.energy_tolerance)]
    return _Run(points[wanted], angles[wanted], found, drift, steps)


def _energy_drift(model: CasadiModel, states: Array) -> float:
    """Largest |E + dissipated - E(0)| relative to the largest kinetic plus |elastic| energy."""
    energies = model.energies(states).full()
    balance = energies.sum(axis=0) + states[-1]
    # A machine at rest has no such energy; round-off of the potential energy must not look like drift.
    scale = max(np.abs(energies[:2]).sum(axis=0).max(), 1e-9 * model.weight * float(model.reach.max()))
    return float(np.max(np.abs(balance - balance[0])) / scale) if scale > 0 else 0.0


def _failed(model: CasadiModel, samples: int, finding: Finding, steps: int = 0) -> _Run:
    nothing = np.full((samples, len(model.markers), 2), np.nan)
    return _Run(nothing, nothing[..., 0], [finding], float("nan"), steps)


def _reason(error: RuntimeError) -> str:
    """The last line of CasADi's report, which says what happened, without the place in CasADi's sources."""
    return re.sub(r"^\S+\.cpp:\d+: ", "", str(error).strip().splitlines()[-1].strip())
