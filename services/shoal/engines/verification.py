"""A run is not believed before a second, more careful one agrees: its time error and its mesh error, measured.

Energy and drift cannot see everything: an energy-conserving step may be far too long, a chaotic motion loses every
digit in time, a coarse mesh of a thin rod locks. So the run is held against the native solver with half the step (or
a hundred times the tolerance, if its integrator is adaptive), the usual treatment of constraints and singular
positions, and then against twice as many elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.mechanics.integrators import facts
from shoal.mechanics.simulate import stable_step
from shoal.scene import GROUND, Rod, Scene, Solver
from shoal.scene.joints import places
from shoal.trajectory import Array, Status, Trajectory, plain

WRONG = 0.1
"""A run whose estimated error is beyond this fraction of the machine's scale is rejected."""
MARGIN = 0.95
"""Of the stable step, which is that of the start."""
LOOSER = 100.0
"""Factor on the tolerance of an adaptive integrator; its error falls at least tenfold with it."""
PATIENCE = 10.0
"""No second run is made that would take longer than so many seconds."""
COST = 2e-8
"""Seconds per unknown and evaluation, roughly."""
MESH_COST = 4.0
"""Twice the elements with the step they need take about so many times longer than the run with half the step."""


@dataclass(frozen=True)
class Verification:
    """Estimated errors of a run at its markers [m], None where they were not estimated and `note` says why.

    time_error: against a more careful run of the same mesh; mesh_error: against twice as many elements;
    scale: how far the markers get from the ground [m]
    """

    time_error: float | None
    mesh_error: float | None
    scale: float
    note: str = ""

    @property
    def complaint(self) -> str:
        """Why the run is not to be trusted; empty if nothing speaks against it."""
        if self.time_error is not None and self.time_error > WRONG * self.scale:
            return (
                f"the time error is about {self.time_error:.2g} m: use a smaller solver.step or tolerance, "
                "or a shorter solver.duration if the motion is chaotic"
            )
        if self.mesh_error is not None and self.mesh_error > WRONG * self.scale:
            return f"the mesh error is about {self.mesh_error:.2g} m: use more elements, or --tolerance to find them"
        return ""


def verified(engine: Engine, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
    """Run a scene and verify it; `model["verification"]` holds the estimates. Raises InputError."""
    trajectory = engine.simulate(scene, times)
    if not trajectory.ok:
        return trajectory
    verification = verify(trajectory, scene)
    model = {**trajectory.model, "verification": dict(plain(asdict(verification)))}
    if verification.complaint:
        return replace(trajectory, model=model, status=(Status.FAILED,), message=verification.complaint)
    return replace(trajectory, model=model)


def verify(trajectory: Trajectory, scene: Scene) -> Verification:
    """Estimate the errors of a run of a scene by more careful ones."""
    notes: list[str] = []
    expected = 2 * COST * trajectory.model["unknowns"] * trajectory.model.get("evaluations", trajectory.steps)
    careful = _run("time error", lambda: _careful(scene, trajectory), expected, trajectory, notes)
    time_error = None if careful is None else _distance(trajectory, careful)
    scale = _scale(trajectory, scene)
    if time_error is not None and _adaptive(trajectory) and time_error < WRONG * scale:
        time_error /= np.sqrt(LOOSER)
    finer, mesh_error = None, None
    if any(isinstance(body, Rod) and body.element != "rigid" for body in scene.bodies.values()):
        expected = MESH_COST * (expected if careful is None else careful.wall_s)
        finer = _run("mesh error", lambda: _finer(scene), expected, trajectory, notes)
    if finer is not None:
        mesh_error = _distance(trajectory, finer)
    return Verification(time_error, mesh_error, scale, "; ".join(notes))


def _run(
    what: str, make: Callable[[], Scene], expected: float, trajectory: Trajectory, notes: list[str]
) -> Trajectory | None:
    """The second run, or None and a note why it could not be had."""
    if expected > PATIENCE:
        notes.append(f"{what} not estimated: that would take about {expected:.0f} s")
        return None
    try:
        second = GaussEngine().simulate(make(), trajectory.times)
    except InputError as error:
        notes.append(f"{what} not estimated: {error}")
        return None
    if not second.ok:
        notes.append(f"{what} not estimated: the second run ended {second.status[0]}, {second.message}")
        return None
    return second


def _adaptive(trajectory: Trajectory) -> bool:
    return trajectory.engine == "gauss" and facts(trajectory.model["integrator"]).adaptive


def _careful(scene: Scene, trajectory: Trajectory) -> Scene:
    """The same mesh, with the usual treatment of constraints."""
    usual = {name: Solver.model_fields[name].default for name in ("acceleration", "project", "rank_tolerance")}
    settings = {f"solver.{name}": value for name, value in usual.items()}
    if _adaptive(trajectory):
        solver = scene.solver
        tolerances = (min(LOOSER * t, 0.1) for t in (solver.relative_tolerance, solver.absolute_tolerance))
        relative, absolute = tolerances
        return scene.with_values(
            {**settings, "solver.relative_tolerance": relative, "solver.absolute_tolerance": absolute}
        )
    if not any(isinstance(body, Rod) and body.element != "rigid" for body in scene.bodies.values()):
        return scene.with_values({**settings, "solver.integrator": "auto"})
    return _leapfrog(scene.with_values(settings), 0.5 * scene.solver.step)


def _finer(scene: Scene) -> Scene:
    """Twice as many elements."""
    flexible = {n: b for n, b in scene.bodies.items() if isinstance(b, Rod) and b.element != "rigid"}
    finer = scene.with_values({f"bodies.{name}.elements": 2 * rod.elements for name, rod in flexible.items()})
    return _leapfrog(finer, scene.solver.step)


def _leapfrog(scene: Scene, step: float) -> Scene:
    step = min(step, MARGIN * stable_step(scene, "leapfrog"))
    return scene.with_values({"solver.integrator": "leapfrog", "solver.step": step})


def _distance(one: Trajectory, other: Trajectory) -> float:
    away = np.linalg.norm(one.points - other.points, axis=2)
    return float(np.max(away))


def _scale(trajectory: Trajectory, scene: Scene) -> float:
    """How far the markers get from the nearest ground joint, or along their own paths [m]."""
    points = trajectory.points[..., 0]
    extent = float(np.max(np.ptp(points, axis=0)))
    sides = (side for joint in scene.joints.values() for side in places(joint))
    anchors = [scene.location(side) for side in sides if side.body == GROUND]
    if not anchors:
        return extent
    away = np.min([np.linalg.norm(points - np.array(anchor), axis=2) for anchor in anchors], axis=0)
    return max(extent, float(np.max(away)))
