"""Sources of error of a run: for each the more careful runs it is compared with, and what the difference is worth.

A source that a scene does not have is not looked at. What the stated model leaves out is looked at beside the time step
and the mesh, though it is no error of the run: shear and rotary inertia of slender rods, the sticking of dry friction
that is smoothed, and far bending of modal rods.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from shoal.engines import ways
from shoal.engines.capabilities import of_kind
from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation, turned
from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import theory_deviations, unstated
from shoal.engines.undecided import Undecided, undecided
from shoal.errors import ShoalError
from shoal.mechanics.gap_history import moved
from shoal.mechanics.integrators import facts
from shoal.mechanics.reach import span
from shoal.scene import Revolute, Rod, Scene, Slider
from shoal.scene.refined import unbent
from shoal.trajectory import Array, Status, Trajectory

WRONG = 0.1
"""A run whose estimated error is beyond this fraction of the machine's scale, or this angle [rad], is rejected."""
UNTRUSTED = (Status.DIVERGED, Status.ENERGY, Status.DRIFTED, Status.OUT_OF_REACH)
"""A more careful run that ends so speaks against the first one."""
PATIENCE = 10.0
"""No second run is made that would take longer than so many seconds,"""
GENEROUS = 5.0
"""or than so many times the run itself, if that is longer."""
TIGHTER = 0.1
"""Factor on the tolerance of the run that is asked where a looser one does not tell."""
FEWER = 0.65
"""A looser run that takes more than this part of the steps takes them for another reason than its tolerance: by that
alone it takes SPAN**(-1/8), 0.56, by dop853, and 0.4 to 0.5 by radau5."""
MAGNIFIED = 10.0
"""Times eps/d^2, which round-off makes of an acceleration at the distance d from a singular position: its part in the
places of a machine of unit size (3 for a slider-crank that passes ten times, d = 1.5e-3)."""
HALVING = 4.0 / 3.0
"""The error of a method of second order in terms of its distance from the run with half the step.

Friction and kinks leave methods of higher order no more where steps are long.
"""
LEFT = 0.25
"""Share of a mesh error that twice as many elements leave, where it falls with the square of their size or faster."""
LEFT_BY_IMPACTS = 2.0 / 3.0
"""The same after impacts, which stop the mass of a node and with it energy in proportion to the size of an element: 1/2
of fine meshes, 0.63 of 5 elements and 0.53 of 10 of a bar that flies against a wall."""
COARSE = 0.03
"""A mesh error beyond this fraction of the scale is looked at with four times the elements, which locks less."""
SHARPER, CREEP = 0.1, 0.01
"""Factor on the speed over which dry friction is smoothed, for the run that tells the creep, and how far that one may
creep itself: a fraction of the machine's size, or rad."""
MODES_A_CABLE = 2
"""A quintic element stands for so many modes of a rod, to tell how far small bending is off."""


class Rejected(Exception):  # noqa: N818 - a finding, no failure
    """The more careful run of a run is itself not to be trusted."""


class Careful(NamedTuple):
    """A more careful run, and the scene that it is of."""

    run: Trajectory
    scene: Scene


class Outcome(NamedTuple):
    """The other outcome of an open decision, and how far it is away.

    matters: whether that is more than the time error and what the limit moved the other way is worth, without it
    """

    decision: Undecided
    away: Deviation
    matters: bool


@dataclass(frozen=True)
class Examined:
    """A run whose errors are to be estimated.

    scale: how far its markers get [m]; native: the engine that makes the more careful runs; found: the errors so far,
    by source; outcomes: of decisions on contacts that the time error leaves open
    """

    run: Trajectory
    scene: Scene
    scale: float
    native: Engine
    found: dict[str, list[Deviation] | None] = field(default_factory=dict)
    outcomes: list[Outcome] = field(default_factory=list)

    def careful(self, what: str, make: Callable[[], Iterator[Scene]], times: int = 1) -> tuple[Careful | None, str]:
        """Return the first run of some scenes that can be made and believed. times: the unknowns of the examined run.

        If none can be believed, the last of them; if none can be had, None and why not the first.
        """
        model = {**self.run.model, "unknowns": times * self.run.model["unknowns"]}
        note, doubtful = "", None
        budget = PATIENCE
        if self.run.engine == GaussEngine().name:
            itself = ways.seconds(self.run.model, self.run.model["integrator"], self.run.steps)
            budget = max(budget, GENEROUS * itself)
        try:
            for scene in make():
                name = "dop853" if scene.solver.integrator == "auto" else scene.solver.integrator
                if facts(name).adaptive and any(scene.flexible_rods) and not ways.is_adaptive(self.run):
                    most = min(scene.solver.max_steps, ways.affordable(model, name, budget))
                    scene = scene.with_values({"solver.max_steps": most})
                else:
                    steps = self.run.steps if facts(name).adaptive else self.run.times[-1] / scene.solver.step
                    expected = ways.seconds(model, name, float(steps))
                    if expected > budget:
                        note = note or f"{what} error not estimated: that would take about {expected:.0f} s"
                        continue
                second = self.native.simulate(scene, self.run.times)
                if second.ok:
                    return Careful(second, scene), ""
                if second.status[0] is Status.FAILED:
                    note = note or f"{what} error not estimated: {second.explanation}"
                else:
                    doubtful = Careful(second, scene)
        except ShoalError as error:
            note = note or f"{what} error not estimated: {error}"
        return doubtful, note

    def deviation(self, source: str, other: Careful, factor: float = 1.0) -> Deviation:
        """The distance from a more careful run, times a factor, as an error."""
        return Deviation(source, self.run, other.run, (self.scene, other.scene), factor)


@dataclass(frozen=True)
class ErrorSource:
    """A source of error. concerns: whether a scene has it.

    look: estimates it by differences of runs, which add up; None, and the note says why, where it cannot
    """

    name: str
    concerns: Callable[[Scene], bool]
    look: Callable[[Examined], tuple[list[Deviation] | None, str]]


def in_time(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate the error of the time step by half the step, or another tolerance, on the same mesh.

    With the usual treatment of constraints and singular positions. Raises Rejected.
    """
    careful, note = seen.careful("time", lambda: ways.careful(seen.scene, seen.run))
    if careful is None:
        return None, note
    if careful.run.status[0] in UNTRUSTED:
        raise Rejected(careful.run.message)
    found = seen.deviation("time", careful)
    if not ways.is_adaptive(seen.run):
        # One that chooses its steps is as good as exact beside one that does not.
        exact = facts(careful.run.model["integrator"]).adaptive
        return [found if exact else replace(found, factor=HALVING)], ""
    if seen.scene.solver.relative_tolerance > ways.LOOSE:
        return [replace(found, factor=HALVING)], ""
    # Beyond the first event that one run does not have their distance says nothing about the order of the error.
    apart = _apart(seen.run, careful.run) > WRONG * np.array([seen.scale, 1.0])
    chaotic = bool(np.any(apart) or found.events.differs)
    if not chaotic and careful.run.steps <= FEWER * seen.run.steps:
        round_off = _round_off(seen.scale, seen.run, careful.run)
        share = min(1.0, round_off / found.distance) if found.distance else 0.0
        return [replace(found, factor=max(share, 1.0 / (math.sqrt(ways.SPAN) - 1.0)))], ""
    # A chaotic motion may be lost to the looser run and not yet to this one, and one whose steps end for other
    # reasons than its tolerance has the same ones in both: a tighter one with shorter steps tells.
    tighter, note = seen.careful("time", lambda: ways.careful(seen.scene, seen.run, TIGHTER))
    if tighter is not None and tighter.run.ok:
        # The error falls at least in proportion to the tolerance, of which this part is gone.
        return [seen.deviation("time", tighter, 1.0 / (1.0 - TIGHTER))], ""
    if chaotic:
        return [found], ""
    return None, note or "time error not estimated: the run with shorter steps is rejected"


def of_contacts(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate what decisions on contacts are worth that the time error leaves open, by the other outcome of each."""
    in_time = seen.found.get("time")
    if not in_time or "events" not in seen.run.model:
        return [], ""
    one = in_time[0]
    open_ = undecided(one)
    if open_ is None:
        return None, "open decisions on contacts not looked for: the run is too large to be followed"
    for each in open_:
        back = {gap: -shift for gap, shift in each.shift.items()}
        other, same = (moved(one.scenes[0], seen.run.times, shift) for shift in (each.shift, back))
        if not (other.ok and same.ok):
            return None, f"effect of an open decision on a contact not estimated: {other.message or same.message}"
        away = Deviation("contacts", one.one, other, (seen.scene, seen.scene))
        matters = away.distance > one.one.distance(same) + one.distance
        seen.outcomes.append(Outcome(each, away, matters))
    return [each.away for each in seen.outcomes], ""


def of_mesh(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate the error of the mesh by twice the elements, and by four times where that is large."""
    finer, note = seen.careful("mesh", lambda: ways.on_finer_mesh(seen.scene, 2), 2)
    if finer is None or not finer.run.ok:
        return None, note or "mesh error not estimated: the run on twice as many elements is rejected"
    struck = any(event["kind"] == "impact" for event in seen.run.model.get("events", ()))
    left = LEFT_BY_IMPACTS if struck else LEFT
    found = seen.deviation("mesh", finer, 1.0 / (1.0 - left))
    if COARSE * seen.scale < seen.run.distance(finer.run):
        finest, _ = seen.careful("mesh", lambda: ways.on_finer_mesh(seen.scene, 4), 4)
        if finest is not None and finest.run.ok:
            other = seen.deviation("mesh", finest, 1.0 / (1.0 - left**2))
            found = max(found, other, key=lambda one: one.distance)
    return [found], ""


def of_theory(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate what slender rods leave out; see `theory`."""
    found = theory_deviations(seen.run, seen.scene, seen.native)
    if found is not None:
        return found, ""
    missing = ", ".join(unstated(seen.scene))
    why = f"state {missing} for it" if missing else "no run with shear can be believed"
    return None, f"theory error not estimated: {why}"


def of_friction(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate the creep of smoothed dry friction by one that sticks ten times better.

    It holds better still where even so it would creep far in the time of the run.
    """
    scene, rubbing = seen.scene, _rubbing(seen.scene)
    sharp, sizes = SHARPER, {"revolute": 1.0, "slider": span(scene)}
    for name, joint in rubbing.items():
        far = CREEP * of_kind(sizes, joint.kind, f"joints.{name}.coulomb")
        sharp = min(sharp, far / (joint.coulomb_speed * max(float(seen.run.times[-1]), scene.solver.step)))
    sharper = {f"joints.{name}.coulomb_speed": sharp * joint.coulomb_speed for name, joint in rubbing.items()}
    held, note = seen.careful("friction", lambda: ways.able(scene.with_values(sharper), scene.solver.step))
    if held is None or not held.run.ok:
        return None, note or "effect of the smoothed friction not estimated: the run with a sharper one is rejected"
    # Creep is proportional to the speed, of which this part is gone.
    return [seen.deviation("friction", held, 1.0 / (1.0 - sharp))], ""


def of_bending(seen: Examined) -> tuple[list[Deviation] | None, str]:
    """Estimate the error of small bending by cables in place of modal rods, which may bend far."""
    scene, modal = seen.scene, _modal(seen.scene)
    if any(np.any(scene.start(name).modes) or np.any(scene.start(name).mode_rates) for name in modal):
        return None, "error of small bending not estimated: cables start unstrained"
    values: dict[str, object] = {}
    for name, rod in modal.items():
        fields = rod.by_elements("ancf-quintic", max(MODES_A_CABLE, rod.modes) // MODES_A_CABLE)
        values |= {f"bodies.{name}.{field}": value for field, value in fields.items()} | unbent(scene, name)
    far, note = seen.careful("bending", lambda: ways.able(scene.with_values(values), scene.solver.step), 4)
    if far is None or not far.run.ok:
        return None, note or "error of small bending not estimated: the run with cables is rejected"
    return [seen.deviation("bending", far)], ""


def _rubbing(scene: Scene) -> dict[str, Revolute | Slider]:
    """Return the joints whose dry friction is smoothed."""
    joints = {name: joint for name, joint in scene.joints.items() if isinstance(joint, Revolute | Slider)}
    return {name: joint for name, joint in joints.items() if joint.dry and joint.stick == "smooth"}


def _modal(scene: Scene) -> dict[str, Rod]:
    return {name: rod for name, rod in scene.flexible_rods.items() if rod.element == "modal"}


def _round_off(scale: float, *runs: Trajectory) -> float:
    """Return the error [m] that round-off may make near singular positions; it does not fall with a tolerance."""
    distance = min(run.model.get("distance_from_singular", 1.0) for run in runs)
    return float(MAGNIFIED * np.finfo(float).eps / distance**2 * scale)


def _apart(one: Trajectory, other: Trajectory) -> Array:
    """Return the distance of the markers of two runs [m], and in the plane of their angles [rad], (2,)."""
    angles = turned(one.angles - other.angles) if len(one.axes) == 2 else np.zeros(1)
    return np.array([one.distance(other), np.max(np.abs(angles), initial=0.0)])


SOURCES = (
    ErrorSource("time", lambda scene: True, in_time),
    ErrorSource("contacts", lambda scene: True, of_contacts),
    ErrorSource("mesh", lambda scene: any(scene.flexible_rods), of_mesh),
    ErrorSource("theory", lambda scene: True, of_theory),
    ErrorSource("friction", lambda scene: bool(_rubbing(scene)), of_friction),
    ErrorSource("bending", lambda scene: bool(_modal(scene)), of_bending),
)
"""Of errors at the markers. The time step comes first: a run that it rejects is not looked at further."""
