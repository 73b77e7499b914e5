"""Adaptive model selection: a priori estimates, refinement to a reference, coarsening to the cheapest model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shoal.arguments import check
from shoal.compile import clock
from shoal.engines.contract import sampling_times
from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import left_out
from shoal.error_budget import ErrorBudget
from shoal.errors import ComputationError, InputError
from shoal.json_values import plain
from shoal.mechanics import findings as kinds
from shoal.scene import Rod, Scene
from shoal.selection.coarsen import WITHIN, coarsen
from shoal.selection.levels import RIGID, SHEARS, SLENDER, STOUT, Levels, apply, open_rods
from shoal.selection.prior import PriorEstimate, estimate
from shoal.selection.refine import AGREE, PATIENCE, REFERENCE, LevelRuns, Progress, ReferenceModel, refine, settled
from shoal.selection.run import Candidate, distance, fewest, rigid_scene, run
from shoal.selection.strain_limits import excessive_torques
from shoal.trajectory import Array, Trajectory

GRID = 50
"""Instants, evenly spread over the run, at which the tolerance holds in addition to the requested ones."""
SURELY_RIGID = 100.0
"""A rod whose a priori error is below the tolerance by this factor stays rigid."""
COUNTS_FROM = 0.1
"""Neglected shear and rotary inertia count from this fraction of the tolerance on: they are known roughly.

It holds for the first bending mode; in higher ones their effect is up to five times as large.
"""
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
"""Tolerances of the adaptive integrator for rigid machines, from coarse to fine."""
MORE_STEPS = 1.25
"""A run estimates the error of one with a coarser tolerance only if it takes more steps by this factor."""


@dataclass(frozen=True, eq=False)
class Selection:
    """The chosen model and how it was found.

    chosen: its scene reproduces the run; trajectory: at the requested times; met: whether the sum of its known errors,
    that of the theory among them, is within the tolerance [m]; candidates: every run, in order; priors: a priori
    estimates; rigid: rods that stay rigid and why; limits: the element whose limit is the truth of each rod; shear:
    neglected by the theory of the beam, by order of magnitude [m], None if unknown; wall_s: of all runs
    """

    tolerance: float
    met: bool
    reason: str
    chosen: Candidate
    trajectory: Trajectory
    candidates: list[Candidate]
    priors: dict[str, PriorEstimate]
    rigid: dict[str, str]
    limits: dict[str, str]
    shear: float | None
    wall_s: float = 0.0

    @property
    def errors(self) -> ErrorBudget:
        """Return the errors of the chosen model at the markers [m]: of its steps and mesh, and of its theory."""
        return _budget(self.chosen, self.shear)

    @property
    def shear_counts(self) -> bool:
        """Return whether what the theory neglects counts beside the tolerance, as it does where it is not known."""
        return self.shear is None or self.shear > COUNTS_FROM * self.tolerance

    def to_json(self) -> dict[str, Any]:
        """Return the object that `shoal simulate --tolerance --json` prints below `selection`."""
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
            "rungs": [_candidate_json(candidate, candidate is self.chosen) for candidate in self.candidates],
            "wall_s": self.wall_s,
        }
        return dict(plain(data))


def _worth(shear: float | None) -> str:
    return "of unknown size" if shear is None else f"worth about {shear:.1g} m"


def _budget(chosen: Candidate, shear: float | None) -> ErrorBudget:
    """Return `Selection.errors`, whose sum decides whether the tolerance is met."""
    model = chosen.error if np.isfinite(chosen.error) else None
    return ErrorBudget({"model": model, **({} if shear == 0.0 else {"theory": shear})})


def _candidate_json(candidate: Candidate, chosen: bool) -> dict[str, Any]:
    facts = candidate.trajectory.model
    return {
        "model": candidate.name,
        "role": candidate.role,
        "chosen": chosen,
        "status": str(candidate.trajectory.status[0]),
        "unknowns": facts["unknowns"],
        "integrator": facts["integrator"],
        "steps": candidate.trajectory.steps,
        "estimated_error": candidate.error,
        "wall_s": candidate.trajectory.wall_s,
    }


def select(
    scene: Scene,
    tolerance: float,
    times: Sequence[float] | Array | None = None,
    progress: Progress = lambda _: None,
    patience: float = PATIENCE,
    meshed: Collection[str] = (),
    coarsened: bool = True,
) -> Selection:
    """Return the cheapest model of a scene whose known errors at the markers sum to at most `tolerance` [m].

    The error of a model is its distance from the converged theory of rods with a modulus, independent of the element
    that the scene names, and what that theory neglects. The theory is Bernoulli-Euler's beam. Where the shear and
    rotary inertia that it neglects are estimated at more than a tenth of the tolerance, or where its meshes do not
    converge, it is Simo and Reissner's rod in the plane, and rods that stay rigid have the rotary inertia of their
    sections; but not where torques fold rods (see `excessive_torques`) or with `solver.theory: slender`. The elements
    ancf-full, simo-reissner and director-rod are theories of their own; a rigid rod in space is taken to twist as well
    as to bend.
    Integrator, step, element and number of elements are chosen; `progress` gets a line for every model that is run.
    patience: the answer is "not met" where a refinement would take longer [s]; meshed: rods that have to be made of
    elements, as the strains of their sections are asked for; coarsened: whether a cheaper model than the finest is
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
    task = _Task(scene, tolerance, asked, priors, closed, progress, patience, meshed, counts, coarsened)
    auto = scene.solver.theory == "auto"
    may_shear = auto and scene.dimensions == 2 and SLENDER in limits.values()
    found = _of_theory(task, limits, another=may_shear)
    beyond = excessive_torques(scene, limits) if may_shear and not found.met else ""
    if beyond:
        reason = f"{beyond}; slender rods: {found.reason}"
        found = replace(found, reason=reason, trajectory=_rejected(found.trajectory, found.errors, reason))
    elif (may_shear and not found.met) or (
        auto and found.shear_counts and (may_shear or _stout(scene, found.rigid) != scene)
    ):
        shearing = {rod: SHEARS if may_shear and limit == SLENDER else limit for rod, limit in limits.items()}
        found = _of_both(found, _of_theory(task._replace(scene=_stout(scene, closed)), shearing, stout=True))
    model = {**found.trajectory.model, "errors": found.errors.to_json()}
    return replace(found, trajectory=replace(found.trajectory, model=model), wall_s=clock.now() - begin)


class _Task(NamedTuple):
    """The request and the prior estimates, from which a theory is chosen; see `Selection`.

    closed, fewest: see `_open`
    """

    scene: Scene
    tolerance: float
    asked: Array
    priors: dict[str, PriorEstimate]
    closed: dict[str, str]
    progress: Progress
    patience: float
    meshed: Collection[str]
    fewest: dict[str, int]
    coarsened: bool


def _of_both(slender: Selection, shearing: Selection) -> Selection:
    """Choose between theories where that of slender rods neglects too much, or its meshes do not converge."""
    candidates = [*slender.candidates, *shearing.candidates]
    if shearing.met:
        why = f"shear and rotary inertia, {_worth(slender.shear)}, count; " if slender.shear_counts else ""
        return replace(shearing, candidates=candidates, reason=why + shearing.reason)
    if not slender.met:
        nearer = shearing if _error(shearing) < _error(slender) else slender
        reason = f"slender rods: {slender.reason}; with shear and rotary inertia: {shearing.reason}"
        rejected = _rejected(nearer.trajectory, nearer.errors, reason)
        return replace(nearer, candidates=candidates, reason=reason, trajectory=rejected)
    assert slender.shear is not None  # else it would not be met
    reason = f"slender rods leave out about {slender.shear:.1g} m, and with shear and rotary inertia {shearing.reason}"
    rough = replace(slender, shear=slender.shear / COUNTS_FROM)  # known roughly, and nothing confirms it
    trajectory = _rejected(slender.trajectory, rough.errors, reason)
    return replace(rough, candidates=candidates, met=False, reason=reason, trajectory=trajectory)


def _error(found: Selection) -> float:
    """Return the sum of the known errors of a model [m]; infinite where that of its mesh is unknown."""
    return np.inf if found.errors.unknown else found.errors.total or 0.0


def _stout(scene: Scene, rods: Collection[str]) -> Scene:
    """Return the scene with these rods rigid, and with the rotary inertia of their sections."""
    return apply(scene, dict.fromkeys(rods, STOUT))


def _of_theory(task: _Task, limits: Mapping[str, str], another: bool = False, stout: bool = False) -> Selection:
    """Return the cheapest model where the truth of each rod is the limit of that element.

    another: whether a richer theory remains; see `refine`; stout: whether rods that stay rigid have rotary inertia
    """
    tolerance, priors, grid = task.tolerance, task.priors, _grid(task.asked)
    unmoved = [rod for rod, prior in priors.items() if prior.error * SURELY_RIGID * len(limits) < tolerance]
    surely = [rod for rod in unmoved if rod not in task.meshed]
    closed = task.closed | {rod: f"would move the markers by about {priors[rod].error:.1g} m" for rod in surely}
    runs = LevelRuns(task.scene, grid, limits, task.progress, task.patience, task.meshed, task.fewest)
    fixed = {
        rod: replace(level, rotary=level.rotary or (stout and level == RIGID)) for rod, level in runs.coarsest.items()
    }
    flexible = tuple(rod for rod in limits if rod not in surely)
    known = sum(priors[rod].error for rod in surely)
    if flexible:
        worst = SURELY_RIGID * sum(prior.error for prior in priors.values())
        chosen, reason, theory = _flexible(runs, flexible, fixed, task, known, worst, another)
    else:
        chosen, reason = _rigid(runs, fixed, tolerance, known)
        theory = chosen
        within = _for_mesh(tolerance, chosen, known)
        if not another and chosen.error > within:
            chosen, reason = _rigid(runs, fixed, within, known)
    shear = _shear(theory)
    errors = _budget(chosen, shear)
    met = not errors.unknown and (errors.total or 0.0) <= tolerance
    if not met and chosen.error <= tolerance:
        reason = f"shear and rotary inertia that the rods leave out are {_worth(shear)}; {reason}"
    return Selection(
        tolerance=tolerance,
        met=met,
        reason=reason,
        chosen=chosen,
        trajectory=_at(chosen, grid, task.asked, errors, met, reason),
        candidates=runs.candidates,
        priors=priors,
        rigid=closed,
        limits=dict(limits),
        shear=shear,
    )


def _for_mesh(tolerance: float, chosen: Candidate, known: float) -> float:
    """Return the part of the tolerance [m] that the theory of the rods leaves to mesh and steps.

    All of it where the theory alone neglects more: the answer is not met, but its mesh and steps are as accurate as
    was asked for.
    """
    left = tolerance - (_shear(chosen) or 0.0)
    return left if left > known else tolerance


def _shear(chosen: Candidate, share: Callable[..., float] = max) -> float | None:
    """Return `Selection.shear`; share: see `theory_deviations`."""
    return left_out(chosen.trajectory, chosen.scene, GaussEngine(), share)


def _open(scene: Scene) -> tuple[dict[str, str], dict[str, str], dict[str, int]]:
    """Return the rods whose model is open with the element of their limit, the others with the reason, and `fewest`."""
    counts = dict[str, int]()
    closed = {
        name: "no EA and EI" if body.section == "numbers" else "no youngs_modulus"
        for name, body in scene.bodies.items()
        if isinstance(body, Rod) and body.modulus is None
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


def _rigid(runs: LevelRuns, levels: Levels, tolerance: float, known: float) -> tuple[Candidate, str]:
    """Return the run with the coarsest tolerance of an adaptive integrator that the next tolerance confirms."""
    last: Candidate | None = None
    for step_tolerance in TOLERANCES:
        scene = rigid_scene(runs.scene, levels, step_tolerance)
        trajectory = run(scene, runs.times)
        candidate = Candidate(dict(levels), scene, trajectory, float(trajectory.model["evaluations"]), role="candidate")
        candidate.tolerance = step_tolerance
        runs.add(candidate)
        if last is None:
            last = candidate
            continue
        last.error = distance(last.trajectory, candidate.trajectory) + known
        if trajectory.steps < MORE_STEPS * last.trajectory.steps and step_tolerance != TOLERANCES[-1]:
            continue  # something else limits the steps, or nothing moves: the two runs are all but one
        if last.error <= WITHIN * tolerance:
            return last, f"the tolerance {step_tolerance:g} moves the markers by {last.error - known:.1g} m"
        last = candidate
    assert last is not None
    last.error = runs.candidates[-2].error
    return last, "no tolerance of the integrator settles the motion; it is too sensitive for so long a run"


def _flexible(
    runs: LevelRuns,
    rods: tuple[str, ...],
    fixed: Levels,
    task: _Task,
    known: float,
    worst: float,
    another: bool,
) -> tuple[Candidate, str, Candidate]:
    """Refine to a reference, then coarsen, unless a richer theory remains and what this one neglects counts.

    Return the chosen model, the reason, and the finest, which shows best what the theory neglects.

    What the theory neglects leaves the mesh that much less of the tolerance; see `_for_mesh`.
    worst: a priori error of rigid rods, where nothing better is known [m]
    """
    within, reference = task.tolerance, refine(runs, rods, fixed, task.tolerance - known, another)
    if not another and isinstance(reference, ReferenceModel):
        within = _for_mesh(task.tolerance, reference.candidate, known)
        if reference.error > AGREE * (within - known):
            reference = refine(runs, rods, fixed, within - known)
    if isinstance(reference, str):
        refined = [candidate for candidate in runs.candidates if candidate.role == REFERENCE]
        if len(refined) < 2:
            if any(level.element != "rigid" for level in fixed.values()):
                raise ComputationError(f"{reference}; state numbers of elements instead of a tolerance")
            stiff, _ = _rigid(runs, fixed, task.tolerance, worst)
            return stiff, reference, stiff
        left, why = settled(refined)
        refined[-1].error = left + known
        return refined[-1], why if refined[-1].error <= within else reference, refined[-1]
    reference.error += known
    beyond = f"; but {reference.candidate.excess}" if reference.candidate.excess else ""
    if not task.coarsened or (another and (_shear(reference.candidate, min) or 0.0) > COUNTS_FROM * task.tolerance):
        reference.candidate.error = reference.error
        return reference.candidate, f"the finest model{beyond}", reference.candidate
    chosen = coarsen(runs, reference, rods, within)
    if chosen is None:
        return reference.candidate, f"no model that was run is within the tolerance{beyond}", reference.candidate
    away = chosen.error - reference.error
    return chosen, f"the reference, {reference.candidate.name}, is {away:.1g} m away{beyond}", reference.candidate


def _grid(asked: Array) -> Array:
    """Return the requested instants and a grid over the run."""
    both = np.concatenate([asked, np.linspace(0.0, asked[-1], GRID + 1)[1:]])
    values = np.sort(both)
    keep = np.concatenate([[True], np.diff(values) > 1e-9 * values[-1]])
    return np.asarray(values[keep])


def _at(candidate: Candidate, grid: Array, asked: Array, errors: ErrorBudget, met: bool, reason: str) -> Trajectory:
    """Return the run at the requested times; failed unless it meets the tolerance."""
    index = [int(np.argmin(np.abs(grid - t))) for t in asked]
    run = candidate.trajectory
    found = replace(run, times=asked, points=run.points[index], angles=run.angles[index])
    return _rejected(found, errors, reason) if run.ok and not met else found


def _rejected(run: Trajectory, errors: ErrorBudget, reason: str) -> Trajectory:
    """Return a run marked as failed, as its errors exceed the tolerance; a rejected run keeps its status."""
    if errors.unknown or errors.total is None:
        return replace(run, lane_findings=[[*run.findings, kinds.NOT_ESTIMATED.found(reason)]])
    text = f"tolerance not met, {errors.brief}: {reason}"
    return replace(run, lane_findings=[[kinds.TOLERANCE_NOT_MET.found(text, error=errors.total)]])
