"""A run is not believed before a second, more careful one agrees: its time error and its mesh error, measured.

Energy and drift cannot see everything: an energy-conserving step may be far too long, a chaotic motion loses every
digit in time, a coarse mesh of a thin rod locks. So the run is held against the native solver with half the step (or
another tolerance, if its integrator is adaptive), the usual treatment of constraints and singular positions, and then
against twice as many elements. A second run that fails says nothing about the first: others are made until one can be
believed. What the stated model leaves out is told beside, as it is no error of the run: shear and rotary inertia of
slender rods, and the sticking of dry friction that is smoothed. A service of the native solver makes these runs too;
those of other engines' are local.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np

from shoal.engines.capabilities import of_kind
from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation, turned
from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import theory_deviations
from shoal.error_budget import ErrorBudget
from shoal.errors import ShoalError
from shoal.mechanics import expense
from shoal.mechanics.integrators import facts
from shoal.mechanics.persist import DAMPED, as_run
from shoal.mechanics.reach import span
from shoal.mechanics.simulate import STEP_MARGIN, stable_step
from shoal.scene import GROUND, Revolute, Rod, Scene, Slider, Solver
from shoal.scene.joints import places
from shoal.scene.refined import refined, unbent
from shoal.trajectory import Array, Status, Trajectory, plain

WRONG = 0.1
"""A run whose estimated error is beyond this fraction of the machine's scale, or this angle [rad], is rejected."""
_NO_PATH = 1e-9
"""Of the machine's size: markers that stay nearer to a pin go nowhere."""
MODES_A_CABLE = 2
"""A quintic element stands for so many modes of a rod, to tell how far small bending is off."""
WORTH = 0.01
"""What the model leaves out is worth a warning beyond this fraction of the scale."""
SPAN = 100.0
"""Factor between the tolerances of two adaptive runs; the error falls at least tenfold with it."""
LOOSE = 1e-8
"""A tolerance above this is held against a tighter one, a tolerance below against a looser one, which costs less."""
TIGHTER, TIGHTEST = 0.1, 1e-14
"""Factor on the tolerance of the run that is asked where a looser one does not tell; the smallest tolerance."""
FEWER = 0.65
"""A looser run that takes more than this part of the steps takes them for another reason than its tolerance: by that
alone it takes SPAN**(-1/8), 0.56, by dop853, and 0.4 to 0.5 by radau5."""
SHORTER, MORE = 0.5, 4
"""Part of the mean step that those of a tighter run may reach, and how many times as many it may take at most."""
FARTHER = 3.0
"""Factor on the distance from singular positions at which they count, for a tighter run; a looser one takes as many
times as its error is expected to be larger."""
MAGNIFIED = 10.0
"""Times eps/d^2, which round-off makes of an acceleration at the distance d from a singular position: its part in the
places of a machine of unit size (3 for a slider-crank that passes ten times, d = 1.5e-3)."""
HALVING = 4.0 / 3.0
"""The error of a method of second order in terms of its distance from the run with half the step.

Friction and kinks leave methods of higher order no more where steps are long.
"""
SHARPER, CREEP = 0.1, 0.01
"""Factor on the speed over which dry friction is smoothed, for the run that tells the creep, and how far that one may
creep itself: a fraction of the machine's size, or rad."""
LEFT = 0.25
"""Share of a mesh error that twice as many elements leave, where it falls with the square of their size or faster."""
COARSE = 0.03
"""A mesh error beyond this fraction of the scale is looked at with four times the elements, which locks less."""
UNTRUSTED = (Status.DIVERGED, Status.ENERGY, Status.DRIFTED, Status.OUT_OF_REACH)
PATIENCE = 10.0
"""No second run is made that would take longer than so many seconds,"""
GENEROUS = 5.0
"""or than so many times the run itself, if that is longer."""
HALVINGS = 3
"""So often the step of a second run that is unstable is halved, before an implicit method is asked."""
SMALLER = "a smaller solver.step, or solver.relative_tolerance and solver.absolute_tolerance"
"""What cures a time error; the absolute tolerance is that of a motion of nanometres."""
CLOSE = {"solver.relative_tolerance": 1e-8, "solver.absolute_tolerance": 1e-9}
"""Tolerances of second runs by integrators that choose their steps."""

SOURCES = "time", "mesh", "theory", "friction", "bending"
"""Of errors at the markers: the time step, the mesh, neglected shear and rotary inertia, smoothed dry friction, and
modal rods that bend far."""

Second = Callable[[str, Callable[[], Iterator[Scene]], int], tuple[tuple[Trajectory, Scene] | None, str]]
"""Makes a second run of a scene; see `_second`."""


@dataclass(frozen=True)
class Verification:
    """Estimated errors of a run at its markers [m], None where they were not estimated and `note` says why.

    time_error: against a more careful run of the same mesh; mesh_error: against twice as many elements, a third more
    than the two differ by, as the finer mesh has an error too (`LEFT`);
    theory_error: what the rods' theory leaves out, friction_error: how far what should stick creeps, as dry friction is
    smoothed, bending_error: of modal rods, against cables that may bend far, each None where there is nothing of the
    kind; scale: how far the markers get from the ground [m];
    rejected: why the more careful run is itself not to be trusted; engine: that made the run, if it is not the native
    one, from which that of time is then how far it is off, whichever of them is wrong; not_estimated: sources whose
    error is of interest and not known; deviations: the second runs, which tell the error of any other quantity too
    """

    time_error: float | None
    mesh_error: float | None
    scale: float
    note: str = ""
    rejected: str = ""
    theory_error: float | None = None
    friction_error: float | None = None
    bending_error: float | None = None
    angle_error: float | None = None
    engine: str = ""
    not_estimated: tuple[str, ...] = ()
    deviations: tuple[Deviation, ...] = field(default=(), repr=False, compare=False)

    @property
    def errors(self) -> ErrorBudget:
        """All that is known of how far the markers are off [m]: numerical errors, and what the model leaves out."""
        known = {source: getattr(self, f"{source}_error") for source in SOURCES}
        return ErrorBudget(
            {source: error for source, error in known.items() if error is not None or source in self.not_estimated}
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain data, for `model["verification"]`."""
        return dict(plain({one.name: getattr(self, one.name) for one in fields(self) if one.compare}))

    @property
    def complaint(self) -> str:
        """Why the run is not to be trusted; empty if nothing speaks against it."""
        if self.rejected:
            return f"a more careful run is rejected ({self.rejected}); use {SMALLER}"
        found = (self.time_error or 0.0, WRONG * self.scale, "m"), (self.angle_error or 0.0, WRONG, "rad")
        for error, allowed, unit in found:
            if error > allowed and self.engine:
                return (
                    f"{self.engine} differs from the native solver by about {error:.2g} {unit}: its model or its steps "
                    "are others; see that it means the same by this scene, and use a smaller solver.step if it heeds "
                    "that, or a shorter solver.duration if the motion is chaotic"
                )
            if error > allowed:
                return (
                    f"the time error is about {error:.2g} {unit}: use {SMALLER}, "
                    "or a shorter solver.duration if the motion is chaotic"
                )
        if self.mesh_error is not None and self.mesh_error > WRONG * self.scale:
            return f"the mesh error is about {self.mesh_error:.2g} m: use more elements, or --tolerance to find them"
        if (self.bending_error or 0.0) > WRONG * self.scale:
            return (
                f"modal rods bend too far: cables, which may, end about {self.bending_error:.2g} m away; "
                "use element: ancf-cable"
            )
        return ""

    @property
    def warning(self) -> str:
        """What a user must know of a run that is not rejected; empty if there is nothing."""
        found = [self.note] if self.time_error is None and self.note else []
        if (self.theory_error or 0.0) > WORTH * self.scale:
            found.append(f"shear and rotary inertia that slender rods leave out are worth {self.theory_error:.2g} m")
        if (self.bending_error or 0.0) > WORTH * self.scale:
            found.append(f"that modal rods bend more than a little is worth {self.bending_error:.2g} m")
        if (self.friction_error or 0.0) > WORTH * self.scale:
            found.append(f"what dry friction should hold creeps by {self.friction_error:.2g} m; lower coulomb_speed")
        return "; ".join(found)


def verified(engine: Engine, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
    """Run a scene and verify it; `errors` and `model["verification"]` hold the estimates. Raises InputError."""
    return run_verified(engine, scene, times)[0]


def run_verified(
    engine: Engine, scene: Scene, times: Sequence[float] | Array | None = None
) -> tuple[Trajectory, Verification | None]:
    """Run a scene and verify it, with the second runs; None of a run that failed. Raises InputError."""
    trajectory = engine.simulate(scene, times)
    if not trajectory.ok:
        return trajectory, None
    verification = verify(trajectory, scene, engine if trajectory.engine == GaussEngine().name else None)
    return with_errors(trajectory, verification), verification


def with_errors(trajectory: Trajectory, verification: Verification) -> Trajectory:
    """Return a run with the errors that were estimated of it, failed where they are too large."""
    found = {"errors": verification.errors.to_json(), "verification": verification.to_json()}
    model = {**trajectory.model, **found}
    if verification.complaint:
        return replace(trajectory, model=model, status=(Status.FAILED,), message=verification.complaint)
    return replace(trajectory, model=model, message=verification.warning)


def verify(trajectory: Trajectory, scene: Scene, native: Engine | None = None) -> Verification:
    """Estimate the errors of a run of a scene by more careful ones. native: the native solver, else the one here."""
    scene = as_run(scene, trajectory)
    scale = _scale(trajectory, scene)
    flexible = any(scene.flexible_rods)
    if "unknowns" not in trajectory.model:
        note = f"errors not estimated: {trajectory.engine} does not tell its unknowns"
        return Verification(None, None, scale, note, not_estimated=("time", "mesh") if flexible else ("time",))
    native = native or GaussEngine()
    second = partial(_second, native, trajectory, scene)
    careful, note = second("time", lambda: _careful(scene, trajectory), 1)
    found, notes, missing = list[Deviation](), [note], list[str]()
    if careful is not None:
        if careful[0].status[0] in UNTRUSTED:
            return Verification(None, None, scale, rejected=careful[0].message, not_estimated=("time",))
        in_time, notes[0] = _time_deviation(trajectory, careful, scene, scale, second)
        found += [] if in_time is None else [in_time]
    missing += [] if found else ["time"]
    looked_at = [("mesh", flexible, partial(_mesh_deviation, trajectory, scene, scale, second))]
    looked_at += [("friction", bool(_rubbing(scene)), partial(_friction_deviation, trajectory, scene, second))]
    looked_at += [("bending", bool(_modal(scene)), partial(_bending_deviation, trajectory, scene, second))]
    for source, concerned, look in looked_at:
        if concerned:
            one, note = look()
            notes.append(note)
            found += [] if one is None else [one]
            missing += [] if one is not None else [source]
    found += theory_deviations(trajectory, scene, native) or []
    errors = {
        source: sum(one.distance for one in found if one.source == source)
        if any(one.source == source for one in found)
        else None
        for source in SOURCES
    }
    angle = next((one.angle for one in found if one.source == "time"), None)
    return Verification(
        errors["time"],
        errors["mesh"],
        scale,
        "; ".join(filter(None, notes)),
        "",
        errors["theory"],
        errors["friction"],
        errors["bending"],
        angle,
        "" if trajectory.engine == GaussEngine().name else trajectory.engine,
        tuple(missing),
        tuple(found),
    )


def _mesh_deviation(trajectory: Trajectory, scene: Scene, scale: float, second: Second) -> tuple[Deviation | None, str]:
    """From runs on more elements; None and why where there are none."""
    finer, note = second("mesh", lambda: on_finer_mesh(scene, 2), 2)
    if finer is None or not finer[0].ok:
        return None, note or "mesh error not estimated: the run on twice as many elements is rejected"
    found = Deviation("mesh", trajectory, finer[0], (scene, finer[1]), 1.0 / (1.0 - LEFT))
    if COARSE * scale < trajectory.distance(finer[0]):
        finest, _ = second("mesh", lambda: on_finer_mesh(scene, 4), 4)
        if finest is not None and finest[0].ok:
            other = Deviation("mesh", trajectory, finest[0], (scene, finest[1]), 1.0 / (1.0 - LEFT**2))
            found = max(found, other, key=lambda one: one.distance)
    return found, ""


def _modal(scene: Scene) -> dict[str, Rod]:
    return {name: rod for name, rod in scene.flexible_rods.items() if rod.element == "modal"}


def _bending_deviation(trajectory: Trajectory, scene: Scene, second: Second) -> tuple[Deviation | None, str]:
    """From cables in place of modal rods, which may bend far."""
    modal = _modal(scene)
    if any(np.any(scene.start(name).modes) or np.any(scene.start(name).mode_rates) for name in modal):
        return None, "error of small bending not estimated: cables start unstrained"
    values: dict[str, object] = {}
    for name, rod in modal.items():
        fields = rod.by_elements("ancf-quintic", max(MODES_A_CABLE, rod.modes) // MODES_A_CABLE)
        values |= {f"bodies.{name}.{field}": value for field, value in fields.items()} | unbent(scene, name)
    far, note = second("bending", lambda: _able(scene.with_values(values), scene.solver.step), 4)
    if far is None or not far[0].ok:
        return None, note or "error of small bending not estimated: the run with cables is rejected"
    return Deviation("bending", trajectory, far[0], (scene, far[1])), ""


def _rubbing(scene: Scene) -> dict[str, Revolute | Slider]:
    return {name: joint for name, joint in scene.joints.items() if isinstance(joint, Revolute | Slider) and joint.dry}


def _friction_deviation(trajectory: Trajectory, scene: Scene, second: Second) -> tuple[Deviation | None, str]:
    """From dry friction that holds ten times better: blocks creep.

    It holds better still where even so it would creep far in the time of the run.
    """
    rubbing = _rubbing(scene)
    sharp, sizes = SHARPER, {"revolute": 1.0, "slider": span(scene)}
    for name, joint in rubbing.items():
        far = CREEP * of_kind(sizes, joint.kind, f"joints.{name}.coulomb")
        sharp = min(sharp, far / (joint.coulomb_speed * max(float(trajectory.times[-1]), scene.solver.step)))
    sharper = {f"joints.{name}.coulomb_speed": sharp * joint.coulomb_speed for name, joint in rubbing.items()}
    held, note = second("friction", lambda: _able(scene.with_values(sharper), scene.solver.step), 1)
    if held is None or not held[0].ok:
        return None, note or "effect of the smoothed friction not estimated: the run with a sharper one is rejected"
    # Creep is proportional to the speed, of which this part is gone.
    return Deviation("friction", trajectory, held[0], (scene, held[1]), 1.0 / (1.0 - sharp)), ""


def _second(
    native: Engine, trajectory: Trajectory, run: Scene, what: str, make: Callable[[], Iterator[Scene]], times: int
) -> tuple[tuple[Trajectory, Scene] | None, str]:
    """The first of some second runs with its scene, on so many times the unknowns, that can be had and believed.

    If none can be believed, the last of them; if none can be had, None and why not the first.
    """
    model = {**trajectory.model, "unknowns": times * trajectory.model["unknowns"]}
    note, doubtful = "", None
    budget = PATIENCE
    if trajectory.engine == GaussEngine().name:
        first = expense.seconds(trajectory.model, trajectory.model["integrator"], trajectory.steps)
        budget = max(budget, GENEROUS * first)
    try:
        for scene in make():
            name = "dop853" if scene.solver.integrator == "auto" else scene.solver.integrator
            if facts(name).adaptive and any(scene.flexible_rods) and not _adaptive(trajectory):
                most = min(scene.solver.max_steps, expense.affordable(model, name, budget))
                scene = scene.with_values({"solver.max_steps": most})
            else:
                steps = trajectory.steps if facts(name).adaptive else trajectory.times[-1] / scene.solver.step
                expected = expense.seconds(model, name, float(steps))
                if expected > budget:
                    note = note or f"{what} error not estimated: that would take about {expected:.0f} s"
                    continue
            second = native.simulate(scene, trajectory.times)
            if second.ok:
                return (second, scene), ""
            if second.status[0] is Status.FAILED:
                note = note or f"{what} error not estimated: {second.message}"
            else:
                doubtful = second, scene
    except ShoalError as error:
        note = note or f"{what} error not estimated: {error}"
    return doubtful, note


def _time_deviation(
    trajectory: Trajectory, careful: tuple[Trajectory, Scene], scene: Scene, scale: float, second: Second
) -> tuple[Deviation | None, str]:
    """From a more careful run; None, and the note says why, where the two are no measure of the error."""
    run, where = careful
    found = Deviation("time", trajectory, run, (scene, where))
    if not _adaptive(trajectory):
        # One that chooses its steps is as good as exact beside one that does not.
        return found if facts(run.model["integrator"]).adaptive else replace(found, factor=HALVING), ""
    if scene.solver.relative_tolerance > LOOSE:
        return replace(found, factor=HALVING), ""
    away = _apart(trajectory, run)
    chaotic = bool(np.any(away > WRONG * np.array([scale, 1.0])))
    if not chaotic and run.steps <= FEWER * trajectory.steps:
        share = min(1.0, _round_off(scale, trajectory, run) / found.distance) if found.distance else 0.0
        return replace(found, factor=max(share, 1.0 / (math.sqrt(SPAN) - 1.0))), ""
    # A chaotic motion may be lost to the looser run and not yet to this one, and one whose steps end for other
    # reasons than its tolerance has the same ones in both: a tighter one with shorter steps tells.
    tighter, note = second("time", lambda: _careful(scene, trajectory, TIGHTER), 1)
    if tighter is not None and tighter[0].ok:
        return replace(found, other=tighter[0], scenes=(scene, tighter[1])), ""
    if not chaotic:
        return None, note or "time error not estimated: the run with shorter steps is rejected"
    return found, ""


def _round_off(scale: float, *runs: Trajectory) -> float:
    """Return the error [m] that round-off may make near singular positions; it does not fall with a tolerance."""
    distance = min(run.model.get("distance_from_singular", 1.0) for run in runs)
    return float(MAGNIFIED * np.finfo(float).eps / distance**2 * scale)


def _apart(one: Trajectory, other: Trajectory) -> Array:
    """How far the markers of two runs are apart [m], and in the plane how far they are turned [rad], (2,)."""
    angles = turned(one.angles - other.angles) if len(one.axes) == 2 else np.zeros(1)
    return np.array([one.distance(other), np.max(np.abs(angles), initial=0.0)])


def _adaptive(trajectory: Trajectory) -> bool:
    return trajectory.engine == "gauss" and facts(trajectory.model["integrator"]).adaptive


def _cut(trajectory: Trajectory, scene: Scene) -> bool:
    """Return whether a run of fixed steps had to cut some."""
    return trajectory.engine == "gauss" and (trajectory.steps - 1) * scene.solver.step > trajectory.times[-1]


def _careful(scene: Scene, trajectory: Trajectory, factor: float | None = None) -> Iterator[Scene]:
    """The same mesh, with the usual treatment of constraints. factor: on the tolerance of an adaptive integrator.

    Steps of these may end at a longest one or where forces have kinks, whatever the tolerance. So those of a tighter
    run are shorter in any case: two runs of the same steps would agree, however wrong both are.
    """
    named = ("acceleration", "project", "rank_tolerance", "inertia_cap")
    usual = {name: Solver.model_fields[name].default for name in named}
    settings = {f"solver.{name}": value for name, value in usual.items()}
    if _adaptive(trajectory):
        solver = scene.solver
        factor = factor or (1 / SPAN if solver.relative_tolerance > LOOSE else SPAN)
        settings["solver.relative_tolerance"] = max(solver.relative_tolerance * factor, TIGHTEST)
        settings["solver.absolute_tolerance"] = solver.absolute_tolerance * factor
        if trajectory.model.get("distance_from_singular", 1.0) <= solver.rank_tolerance:
            # What third derivatives leave there is proportional to it, and no matter of steps.
            settings["solver.rank_tolerance"] = usual["rank_tolerance"] * (np.sqrt(SPAN) if factor > 1 else FARTHER)
        if factor < 1 and trajectory.steps:
            settings["solver.max_step"] = SHORTER * float(trajectory.times[-1]) / trajectory.steps
            settings["solver.max_steps"] = max(solver.max_steps, MORE * trajectory.steps)
        yield scene.with_values(settings)
    elif not any(scene.flexible_rods):
        # Tolerances that the run itself had no use for may be any.
        close = {path: min(scene.value(path), most) for path, most in CLOSE.items()}
        yield scene.with_values({**settings, **close, "solver.integrator": "auto"})
    else:
        scene = scene.with_values(settings)
        if _cut(trajectory, scene):
            # Steps that were cut at what is narrow are cut alike at half the step, and their error stays.
            yield scene.with_values({"solver.integrator": "dop853", **CLOSE})
        yield from _able(scene, 0.5 * scene.solver.step)


def on_finer_mesh(scene: Scene, times: int) -> Iterator[Scene]:
    """So many times as many elements, or modes."""
    yield from _able(scene.with_values({**refined(scene, times), "solver.inertia_cap": False}), scene.solver.step)


def _able(scene: Scene, step: float) -> Iterator[Scene]:
    """Ways to run a scene with steps of at most `step` [s], from the cheapest and best on.

    The stable step of leapfrog is that of the start; loops and stretched rods have shorter ones, which none tells
    beforehand. Damping may leave it none that is of use.
    """
    if not any(rod.element != "modal" for rod in scene.flexible_rods.values()):
        yield scene.with_values({"solver.integrator": "auto"})
        return
    longest = min(step, STEP_MARGIN * stable_step(scene, "leapfrog"))
    for halvings in range(HALVINGS):
        yield scene.with_values({"solver.integrator": "leapfrog", "solver.step": 0.5**halvings * longest})
    implicit = {"solver.integrator": "generalized-alpha", "solver.spectral_radius": DAMPED, "solver.step": step}
    yield scene.with_values(implicit)
    yield scene.with_values({"solver.integrator": "radau5", **CLOSE})


def _scale(trajectory: Trajectory, scene: Scene) -> float:
    """How far the markers get from the nearest ground joint [m]; without one, the extent of their paths, and of the
    machine where a single instant is looked at.
    """
    points = trajectory.points[..., 0]
    sides = (side for joint in scene.joints.values() for side in places(joint))
    anchors = [scene.location(side) for side in sides if side.body == GROUND]
    least = _NO_PATH * span(scene)
    if not anchors:
        # One instant is no path.
        return max(float(np.max(np.ptp(points, axis=0))), least) if len(points) > 1 else span(scene)
    away = np.min([np.linalg.norm(points - np.array(anchor), axis=2) for anchor in anchors], axis=0)
    return max(float(np.max(away)), least)
