"""A run is not believed before a second, more careful one agrees: its time error and its mesh error, measured.

Energy and drift cannot see everything: an energy-conserving step may be far too long, a chaotic motion loses every
digit in time, a coarse mesh of a thin rod locks. So the run is held against the native solver with half the step (or
another tolerance, if its integrator is adaptive), the usual treatment of constraints and singular positions, and then
against twice as many elements. A service of the native solver makes these runs too; those of other engines' are local.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import ShoalError
from shoal.mechanics.integrators import facts
from shoal.mechanics.simulate import STEP_MARGIN, stable_step
from shoal.scene import GROUND, Rod, Scene, Solver
from shoal.scene.joints import places
from shoal.trajectory import Array, Status, Trajectory, plain

WRONG = 0.1
"""A run whose estimated error is beyond this fraction of the machine's scale is rejected."""
SPAN = 100.0
"""Factor between the tolerances of two adaptive runs; the error falls at least tenfold with it."""
LOOSE = 1e-8
"""A tolerance above this is held against a tighter one, a tolerance below against a looser one, which costs less."""
TIGHTER, TIGHTEST = 0.1, 1e-14
"""Factor on the tolerance of the run that tells whether a chaotic motion is still known; the smallest tolerance."""
HALVING = 4.0 / 3.0
"""The error of a method of second order in terms of its distance from the run with half the step."""
COARSE = 0.03
"""A mesh error beyond this fraction of the scale is looked at with four times the elements, which locks less."""
UNTRUSTED = (Status.DIVERGED, Status.ENERGY, Status.DRIFTED, Status.OUT_OF_REACH)
PATIENCE = 10.0
"""No second run is made that would take longer than so many seconds."""
COST = 2e-8
"""Seconds per unknown and evaluation, roughly; a measured time would make the answer depend on the machine's load."""

Second = Callable[[str, Callable[[], Scene], int], tuple[Trajectory | None, str]]
"""Makes a second run of a scene; see `_second`."""


@dataclass(frozen=True)
class Verification:
    """Estimated errors of a run at its markers [m], None where they were not estimated and `note` says why.

    time_error: against a more careful run of the same mesh; mesh_error: against twice as many elements;
    scale: how far the markers get from the ground [m]; rejected: why the more careful run is itself not to be trusted
    """

    time_error: float | None
    mesh_error: float | None
    scale: float
    note: str = ""
    rejected: str = ""

    @property
    def complaint(self) -> str:
        """Why the run is not to be trusted; empty if nothing speaks against it."""
        if self.rejected:
            return f"a more careful run is rejected ({self.rejected}); use a smaller solver.step or tolerance"
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
    verification = verify(trajectory, scene, engine if trajectory.engine == GaussEngine().name else None)
    model = {**trajectory.model, "verification": dict(plain(asdict(verification)))}
    if verification.complaint:
        return replace(trajectory, model=model, status=(Status.FAILED,), message=verification.complaint)
    return replace(trajectory, model=model)


def verify(trajectory: Trajectory, scene: Scene, native: Engine | None = None) -> Verification:
    """Estimate the errors of a run of a scene by more careful ones. native: the native solver, else the one here."""
    scale = _scale(trajectory, scene)
    second = partial(_second, native or GaussEngine(), trajectory)
    careful, note = second("time", lambda: _careful(scene, trajectory), 1)
    if careful is None:
        notes, time_error, rejected = [note], None, ""
    elif careful.status[0] in UNTRUSTED:
        return Verification(None, None, scale, rejected=careful.message)
    else:
        notes, time_error, rejected = [], _time_error(trajectory, careful, scene, scale, second), ""
    if not any(_flexible(scene)):
        return Verification(time_error, None, scale, "; ".join(notes), rejected)
    finer, note = second("mesh", lambda: _finer(scene, 2), 2)
    if finer is None or not finer.ok:
        note = note or "mesh error not estimated: the run on twice as many elements is rejected"
        return Verification(time_error, None, scale, "; ".join([*notes, note]))
    mesh_error = trajectory.distance(finer)
    if COARSE * scale < mesh_error:
        finest, _ = second("mesh", lambda: _finer(scene, 4), 4)
        if finest is not None and finest.ok:
            mesh_error = max(mesh_error, trajectory.distance(finest))
    return Verification(time_error, mesh_error, scale, "; ".join(notes))


def _second(
    native: Engine, trajectory: Trajectory, what: str, make: Callable[[], Scene], times: int
) -> tuple[Trajectory | None, str]:
    """A second run on so many times the unknowns, or None and why it could not be had."""
    try:
        scene = make()
        fixed = scene.solver.integrator == "leapfrog"
        evaluations = trajectory.times[-1] / scene.solver.step if fixed else trajectory.model.get("evaluations", 0)
        expected = COST * times * trajectory.model["unknowns"] * evaluations
        if expected > PATIENCE:
            return None, f"{what} error not estimated: that would take about {expected:.0f} s"
        second = native.simulate(scene, trajectory.times)
    except ShoalError as error:
        return None, f"{what} error not estimated: {error}"
    if second.status[0] is Status.FAILED:
        return None, f"{what} error not estimated: {second.message}"
    return second, ""


def _time_error(trajectory: Trajectory, careful: Trajectory, scene: Scene, scale: float, second: Second) -> float:
    """The distance of the two runs as an error of the first."""
    away = trajectory.distance(careful)
    if not _adaptive(trajectory):
        return HALVING * away
    if scene.solver.relative_tolerance > LOOSE:
        return away
    if away <= WRONG * scale:
        return float(away / np.sqrt(SPAN))
    # A chaotic motion may be lost to the looser run and not yet to this one, which a tighter one tells.
    tighter, _ = second("time", lambda: _careful(scene, trajectory, TIGHTER), 1)
    return away if tighter is None else min(away, trajectory.distance(tighter))


def _adaptive(trajectory: Trajectory) -> bool:
    return trajectory.engine == "gauss" and facts(trajectory.model["integrator"]).adaptive


def _flexible(scene: Scene) -> dict[str, Rod]:
    """The flexible rods of a scene."""
    return {n: body for n, body in scene.bodies.items() if isinstance(body, Rod) and body.element != "rigid"}


def _careful(scene: Scene, trajectory: Trajectory, factor: float | None = None) -> Scene:
    """The same mesh, with the usual treatment of constraints. factor: on the tolerance of an adaptive integrator."""
    usual = {name: Solver.model_fields[name].default for name in ("acceleration", "project", "rank_tolerance")}
    settings = {f"solver.{name}": value for name, value in usual.items()}
    if _adaptive(trajectory):
        solver = scene.solver
        factor = factor or (1 / SPAN if solver.relative_tolerance > LOOSE else SPAN)
        settings["solver.relative_tolerance"] = max(solver.relative_tolerance * factor, TIGHTEST)
        settings["solver.absolute_tolerance"] = solver.absolute_tolerance * factor
        return scene.with_values(settings)
    if not any(_flexible(scene)):
        return scene.with_values({**settings, "solver.integrator": "auto"})
    return _leapfrog(scene.with_values(settings), 0.5 * scene.solver.step)


def _finer(scene: Scene, times: int) -> Scene:
    """So many times as many elements."""
    finer = {f"bodies.{name}.elements": times * rod.elements for name, rod in _flexible(scene).items()}
    return _leapfrog(scene.with_values(finer), scene.solver.step)


def _leapfrog(scene: Scene, step: float) -> Scene:
    step = min(step, STEP_MARGIN * stable_step(scene, "leapfrog"))
    return scene.with_values({"solver.integrator": "leapfrog", "solver.step": step})


def _scale(trajectory: Trajectory, scene: Scene) -> float:
    """How far the markers get from the nearest ground joint [m]; without one, the extent of their paths."""
    points = trajectory.points[..., 0]
    sides = (side for joint in scene.joints.values() for side in places(joint))
    anchors = [scene.location(side) for side in sides if side.body == GROUND]
    if not anchors:
        return float(np.max(np.ptp(points, axis=0)))
    away = np.min([np.linalg.norm(points - np.array(anchor), axis=2) for anchor in anchors], axis=0)
    return float(np.max(away))
