"""The main path: scene, tolerance -> what rigid rods leave out -> up the ladder -> down again -> the cheapest model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shoal.arguments import check
from shoal.compile import clock
from shoal.engines.contract import sampling_times
from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import left_out, softer
from shoal.error_budget import ErrorBudget
from shoal.errors import ComputationError, InputError
from shoal.scene import Rod, Scene
from shoal.selection.beyond import folded
from shoal.selection.climb import PATIENCE, YARDSTICK, Progress, Runs, climb, settled
from shoal.selection.levels import SHEARS, SLENDER, Levels, open_rods
from shoal.selection.prior import Prior, estimate
from shoal.selection.run import Rung, distance, fewest, rigid_scene, run
from shoal.selection.trim import WITHIN, trim
from shoal.trajectory import Array, Status, Trajectory, plain

GRID = 50
"""The tolerance holds at so many instants spread over the run, beside those that were asked for."""
SURELY_RIGID = 100.0
"""A rod whose a priori error is below the tolerance by this factor is not modelled any further."""
COUNTS_FROM = 0.1
"""What slender rods leave out counts from this fraction of the tolerance on: it is known by order of magnitude.

It is told for the first bending mode; in higher ones shear and rotary inertia are worth up to five times as much.
"""
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
"""Of the adaptive integrator for rigid machines, from coarse to fine."""
MORE_STEPS = 1.25
"""A run of fewer steps than so many times those of a coarser tolerance does not tell how far that one is off."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The chosen model and how it was found.

    chosen: its scene reproduces the run; trajectory: at the times asked for; met: whether its estimated error is
    within the tolerance [m]; rungs: every run, in order; priors: what was known before; rigid: rods that stay rigid
    and why; limits: the element whose limit is the truth of each rod; shear: what the theory of the beam leaves out, by
    order of magnitude [m]; wall_s: of all runs
    """

    tolerance: float
    met: bool
    reason: str
    chosen: Rung
    trajectory: Trajectory
    rungs: list[Rung]
    priors: dict[str, Prior]
    rigid: dict[str, str]
    limits: dict[str, str]
    shear: float
    wall_s: float = 0.0

    @property
    def errors(self) -> ErrorBudget:
        """Of the chosen model at the markers [m]: its steps and its mesh, and what its theory leaves out."""
        model = self.chosen.error if np.isfinite(self.chosen.error) else None
        return ErrorBudget({"model": model, **({"theory": self.shear} if self.shear else {})})

    def to_json(self) -> dict[str, Any]:
        """The ladder, which `shoal simulate --tolerance --json` prints below `selection`."""
        data = {
            "tolerance": self.tolerance,
            "status": "met" if self.met else "not met",
            "reason": self.reason,
            "estimated_error": self.chosen.error,
            "errors": self.errors.to_json(),
            "neglected_shear": self.shear,
            "truth": self.limits,
            "levels": {rod: vars(level) for rod, level in self.chosen.levels.items()},
            "rigid": self.rigid,
            "priors": {rod: vars(prior) for rod, prior in self.priors.items()},
            "rungs": [_rung_json(rung, rung is self.chosen) for rung in self.rungs],
            "wall_s": self.wall_s,
        }
        return dict(plain(data))


def _rung_json(rung: Rung, chosen: bool) -> dict[str, Any]:
    facts = rung.trajectory.model
    return {
        "model": rung.name,
        "role": rung.role,
        "chosen": chosen,
        "status": str(rung.trajectory.status[0]),
        "unknowns": facts["unknowns"],
        "integrator": facts["integrator"],
        "steps": rung.trajectory.steps,
        "estimated_error": rung.error,
        "wall_s": rung.trajectory.wall_s,
    }


def select(
    scene: Scene,
    tolerance: float,
    times: Sequence[float] | Array | None = None,
    progress: Progress = lambda _: None,
    patience: float = PATIENCE,
    meshed: Collection[str] = (),
    trimmed: bool = True,
) -> Selection:
    """The cheapest model of a scene whose estimated error at the markers is within `tolerance` [m].

    The truth is the converged theory, whatever element the scene names for rods with a modulus: Bernoulli-Euler's beam,
    or in the plane Simo and Reissner's rod where what the former leaves out is estimated to be worth more than a tenth
    of the tolerance, or where the former does not settle, unless torques fold rods (see `folded`). The elements
    ancf-full, simo-reissner and director-rod are theories of their own; a rigid rod in space is taken to twist as well
    as to bend; `solver.theory: slender` keeps the former.
    Integrator, step, element and number of elements are chosen; progress is told every model that is run.
    patience: the answer is "not met" where a refinement would take longer [s]; meshed: rods that have to be made of
    elements, as the strains of their sections are asked for; trimmed: whether a cheaper model than the finest is
    looked for. Raises InputError, and ComputationError where a curved or twisted rod in space, which is never rigid,
    takes too long.
    """
    check(tolerance=tolerance)
    if not patience > 0:
        raise InputError(f"patience: needs a time above 0 s, found {patience:g}")
    begin = clock.now()
    asked = sampling_times(scene, times)
    scene = scene.with_values({"solver.duration": float(asked[-1])}) if asked[-1] > 0 else scene
    limits, closed, counts = _open(scene)
    priors = estimate(scene, tuple(limits)) if limits else {}
    task = _Task(scene, tolerance, asked, priors, closed, progress, patience, meshed, counts, trimmed)
    may_shear = scene.dimensions == 2 and scene.solver.theory == "auto" and SLENDER in limits.values()
    found = _of_theory(task, limits, another=may_shear)
    beyond = folded(scene, limits) if may_shear and not found.met else ""
    if beyond:
        reason = f"{beyond}; slender rods: {found.reason}"
        found = replace(found, reason=reason, trajectory=_rejected(found.trajectory, found.chosen.error, reason))
    elif may_shear and (not found.met or found.shear > COUNTS_FROM * tolerance):
        stout = {rod: SHEARS if limit == SLENDER else limit for rod, limit in limits.items()}
        found = _of_both(found, _of_theory(task, stout))
    model = {**found.trajectory.model, "errors": found.errors.to_json()}
    return replace(found, trajectory=replace(found.trajectory, model=model), wall_s=clock.now() - begin)


class _Task(NamedTuple):
    """What is asked for, and what is known before any theory is chosen, see `Selection`.

    closed, fewest: see `_open`
    """

    scene: Scene
    tolerance: float
    asked: Array
    priors: dict[str, Prior]
    closed: dict[str, str]
    progress: Progress
    patience: float
    meshed: Collection[str]
    fewest: dict[str, int]
    trimmed: bool


def _of_both(slender: Selection, stout: Selection) -> Selection:
    """What to answer where slender rods leave out too much, or do not settle."""
    rungs = [*slender.rungs, *stout.rungs]
    if stout.met:
        why = f"shear and rotary inertia, worth about {slender.shear:.1g} m, count; " if slender.met else ""
        return replace(stout, rungs=rungs, reason=why + stout.reason)
    if not slender.met:
        nearer = stout if stout.chosen.error < slender.chosen.error else slender
        reason = f"slender rods: {slender.reason}; with shear and rotary inertia: {stout.reason}"
        told = _rejected(nearer.trajectory, nearer.chosen.error, reason)
        return replace(nearer, rungs=rungs, reason=reason, trajectory=told)
    reason = f"slender rods leave out about {slender.shear:.1g} m, and with shear and rotary inertia {stout.reason}"
    slender.chosen.error += slender.shear / COUNTS_FROM
    trajectory = _rejected(slender.trajectory, slender.chosen.error, reason)
    return replace(slender, rungs=rungs, met=False, reason=reason, trajectory=trajectory)


def _of_theory(task: _Task, limits: Mapping[str, str], another: bool = False) -> Selection:
    """The cheapest model where the truth of each rod is the limit of that element.

    another: whether there is a theory left for what this one leaves out; see `climb`
    """
    tolerance, priors, grid = task.tolerance, task.priors, _grid(task.asked)
    unmoved = [rod for rod, prior in priors.items() if prior.error * SURELY_RIGID * len(limits) < tolerance]
    surely = [rod for rod in unmoved if rod not in task.meshed]
    closed = task.closed | {rod: f"would move the markers by about {priors[rod].error:.1g} m" for rod in surely}
    runs = Runs(task.scene, grid, limits, task.progress, task.patience, task.meshed, task.fewest)
    fixed = runs.coarsest
    flexible = tuple(rod for rod in limits if rod not in surely)
    known = sum(priors[rod].error for rod in surely)
    if flexible:
        worst = SURELY_RIGID * sum(prior.error for prior in priors.values())
        chosen, reason = _flexible(runs, flexible, fixed, task, known, worst, another)
    else:
        chosen, reason = _rigid(runs, fixed, tolerance, known)
    met = bool(chosen.error <= tolerance)
    return Selection(
        tolerance=tolerance,
        met=met,
        reason=reason,
        chosen=chosen,
        trajectory=_at(chosen, grid, task.asked, met, reason),
        rungs=runs.rungs,
        priors=priors,
        rigid=closed,
        limits=dict(limits),
        shear=_shear(chosen),
    )


def _shear(chosen: Rung, share: Callable[..., float] = max) -> float:
    """See `Selection`, and `left_out` for the share; 0 where it is not known."""
    scene = chosen.scene
    shaped = scene.dimensions == 3 and any(isinstance(rod, Rod) and not rod.straight for rod in scene.bodies.values())
    if shaped:
        return softer(chosen.trajectory, scene, GaussEngine()) or 0.0
    return left_out(chosen.trajectory, scene, GaussEngine(), share) or 0.0


def _open(scene: Scene) -> tuple[dict[str, str], dict[str, str], dict[str, int]]:
    """Rods whose model is open with the element of their limit, the others with the reason, `fewest` of the former."""
    counts = dict[str, int]()
    closed = {
        name: "no youngs_modulus"
        for name, body in scene.bodies.items()
        if isinstance(body, Rod) and body.youngs_modulus is None
    }
    limits = open_rods(scene)
    for rod, limit in limits.items():
        body, start = scene.bodies[rod], scene.start(rod)
        assert isinstance(body, Rod)
        if start.modes or start.mode_rates:
            field = "modes" if start.modes else "mode_rates"
            raise InputError(f"initial.{rod}.{field}: models are chosen of rods that start unstrained; leave it out")
        found = fewest(scene, rod, limit)
        if isinstance(found, int):
            counts[rod] = found
        elif body.element != "rigid":
            raise InputError(f"bodies.{rod}.element: no other model can take the place of {body.element}: {found}")
        else:
            closed[rod] = found
    return {rod: limit for rod, limit in limits.items() if rod not in closed}, closed, counts


def _rigid(runs: Runs, levels: Levels, tolerance: float, known: float) -> tuple[Rung, str]:
    """The coarsest tolerance of an adaptive integrator whose motion the next one confirms."""
    last: Rung | None = None
    for step_tolerance in TOLERANCES:
        scene = rigid_scene(runs.scene, levels, step_tolerance)
        trajectory = run(scene, runs.times)
        rung = Rung(dict(levels), scene, trajectory, float(trajectory.model["evaluations"]), role="candidate")
        rung.tolerance = step_tolerance
        runs.add(rung)
        if last is None:
            last = rung
            continue
        last.error = distance(last.trajectory, rung.trajectory) + known
        if trajectory.steps < MORE_STEPS * last.trajectory.steps and step_tolerance != TOLERANCES[-1]:
            continue  # something else limits the steps, or nothing moves: the two runs are all but one
        if last.error <= WITHIN * tolerance:
            return last, f"the tolerance {step_tolerance:g} moves the markers by {last.error - known:.1g} m"
        last = rung
    assert last is not None
    last.error = runs.rungs[-2].error
    return last, "no tolerance of the integrator settles the motion; it is too sensitive for so long a run"


def _flexible(
    runs: Runs,
    rods: tuple[str, ...],
    fixed: Levels,
    task: _Task,
    known: float,
    worst: float,
    another: bool,
) -> tuple[Rung, str]:
    """Climb to a yardstick, then trim; not if another theory is left and what this one leaves out counts.

    worst: what rigid rods may cost a priori, for want of anything better [m]
    """
    yardstick = climb(runs, rods, fixed, task.tolerance - known, another)
    if isinstance(yardstick, str):
        refined = [rung for rung in runs.rungs if rung.role == YARDSTICK]
        if len(refined) < 2:
            if any(level.element != "rigid" for level in runs.coarsest.values()):
                raise ComputationError(f"{yardstick}; state numbers of elements instead of a tolerance")
            stiff, _ = _rigid(runs, runs.coarsest, task.tolerance, worst)
            return stiff, yardstick
        left, why = settled(refined)
        refined[-1].error = left + known
        return refined[-1], why if refined[-1].error <= task.tolerance else yardstick
    yardstick.error += known
    beyond = f"; but {yardstick.rung.torn}" if yardstick.rung.torn else ""
    if not task.trimmed or (another and _shear(yardstick.rung, min) > COUNTS_FROM * task.tolerance):
        yardstick.rung.error = yardstick.error
        return yardstick.rung, f"the finest model{beyond}"
    chosen = trim(runs, yardstick, rods, task.tolerance)
    if chosen is None:
        return yardstick.rung, f"no model that was run is within the tolerance{beyond}"
    return chosen, f"the yardstick, {yardstick.rung.name}, is {chosen.error - yardstick.error:.1g} m away{beyond}"


def _grid(asked: Array) -> Array:
    """The instants asked for and a grid over the run."""
    both = np.concatenate([asked, np.linspace(0.0, asked[-1], GRID + 1)[1:]])
    values = np.sort(both)
    keep = np.concatenate([[True], np.diff(values) > 1e-9 * values[-1]])
    return np.asarray(values[keep])


def _at(rung: Rung, grid: Array, asked: Array, met: bool, reason: str) -> Trajectory:
    """The run at the times asked for; failed unless it meets the tolerance."""
    index = [int(np.argmin(np.abs(grid - t))) for t in asked]
    run = rung.trajectory
    found = replace(run, times=asked, points=run.points[index], angles=run.angles[index])
    return _rejected(found, rung.error, reason) if run.ok and not met else found


def _rejected(run: Trajectory, error: float, reason: str) -> Trajectory:
    """A run that is off by more than the tolerance [m]; one that is not believed at all keeps its status."""
    if not np.isfinite(error):
        return replace(run, message=reason)
    return replace(run, status=(Status.FAILED,), message=f"tolerance not met, estimated error {error:.2g} m: {reason}")
