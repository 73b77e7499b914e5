"""The main path: scene, tolerance -> what rigid rods leave out -> up the ladder -> down again -> the cheapest model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.engines.contract import sampling_times
from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import left_out
from shoal.errors import InputError
from shoal.scene import Rod, Scene
from shoal.selection.climb import YARDSTICK, Progress, Runs, climb
from shoal.selection.levels import RIGID, Levels, open_rods
from shoal.selection.prior import Prior, estimate
from shoal.selection.run import Rung, can_be_flexible, distance, rigid_scene, run
from shoal.selection.trim import WITHIN, trim
from shoal.trajectory import Array, Status, Trajectory, plain

GRID = 50
"""The tolerance holds at so many instants spread over the run, beside those that were asked for."""
SURELY_RIGID = 100.0
"""A rod whose a priori error is below the tolerance by this factor is not modelled any further."""
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13)
"""Of the adaptive integrator for rigid machines, from coarse to fine."""


@dataclass(frozen=True)
class Selection:
    """The chosen model and how it was found.

    chosen: its scene reproduces the run; trajectory: at the times asked for; met: whether its estimated error is
    within the tolerance [m]; rungs: every run, in order; priors: what was known before; rigid: rods that stay rigid
    and why; shear: what the theory of the beam leaves out, by order of magnitude [m]
    """

    tolerance: float
    met: bool
    reason: str
    chosen: Rung
    trajectory: Trajectory
    rungs: list[Rung]
    priors: dict[str, Prior]
    rigid: dict[str, str]
    shear: float
    wall_s: float

    def to_json(self) -> dict[str, Any]:
        """The ladder, which `shoal simulate --tolerance --json` prints below `selection`."""
        data = {
            "tolerance": self.tolerance,
            "status": "met" if self.met else "not met",
            "reason": self.reason,
            "estimated_error": self.chosen.error,
            "neglected_shear": self.shear,
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
    scene: Scene, tolerance: float, times: Sequence[float] | Array | None = None, progress: Progress = lambda _: None
) -> Selection:
    """The cheapest model of a scene whose estimated error at the markers is within `tolerance` [m].

    The truth is the converged theory: Bernoulli-Euler's beam for rods with a modulus, whatever element the scene
    names for them, but for ancf-full and director-rod, which are theories of their own; a rigid rod in space is taken
    to twist as well as to bend. Integrator, step, element and number of elements
    are chosen; progress is told every model that is run. Raises InputError.
    """
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise InputError(f"tolerance: needs a length above 0 m, found {tolerance:g}")
    begin = time.perf_counter()
    asked = sampling_times(scene, times)
    scene = scene.with_values({"solver.duration": float(asked[-1])}) if asked[-1] > 0 else scene
    grid = _grid(asked)
    limits, rigid = _open(scene)
    rods = tuple(limits)
    priors = estimate(scene, rods) if rods else {}
    surely = [rod for rod, prior in priors.items() if prior.error * SURELY_RIGID * len(rods) < tolerance]
    rigid |= {rod: f"would move the markers by about {priors[rod].error:.1g} m" for rod in surely}
    fixed: Levels = dict.fromkeys(rods, RIGID)
    runs = Runs(scene, grid, limits, progress)
    flexible = tuple(rod for rod in rods if rod not in surely)
    known = sum(priors[rod].error for rod in surely)
    if flexible:
        worst = SURELY_RIGID * sum(prior.error for prior in priors.values())
        chosen, reason = _flexible(runs, flexible, fixed, tolerance, known, worst)
    else:
        chosen, reason = _rigid(runs, fixed, tolerance, known)
    met = bool(chosen.error <= tolerance)
    return Selection(
        tolerance=tolerance,
        met=met,
        reason=reason,
        chosen=chosen,
        trajectory=_at(chosen, grid, asked, met, reason),
        rungs=runs.rungs,
        priors=priors,
        rigid=rigid,
        shear=left_out(chosen.trajectory, chosen.scene, GaussEngine()) or 0.0,
        wall_s=time.perf_counter() - begin,
    )


def _open(scene: Scene) -> tuple[dict[str, str], dict[str, str]]:
    """Rods whose model is open with the element of their limit, and the other rods with the reason."""
    limits = open_rods(scene)
    closed = {
        name: "no youngs_modulus"
        for name, body in scene.bodies.items()
        if isinstance(body, Rod) and body.youngs_modulus is None
    }
    for rod, limit in limits.items():
        body = scene.bodies[rod]
        assert isinstance(body, Rod)
        if limit == "director-rod" and not body.straight:
            raise InputError(
                f"bodies.{rod}.element: models are chosen of straight rods in space, and {rod} is curved or twisted; "
                "state its number of elements instead of a tolerance"
            )
        if reason := can_be_flexible(scene, rod, limit):
            if body.element != "rigid":
                raise InputError(f"bodies.{rod}.element: no other model can take the place of {body.element}: {reason}")
            closed[rod] = reason
    return {rod: limit for rod, limit in limits.items() if rod not in closed}, closed


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
        if last.error == known and step_tolerance != TOLERANCES[-1]:
            continue  # something else limits the steps, or nothing moves: the two runs are one
        if last.error <= WITHIN * tolerance:
            return last, f"the tolerance {step_tolerance:g} moves the markers by {last.error - known:.1g} m"
        last = rung
    assert last is not None
    last.error = runs.rungs[-2].error
    return last, "no tolerance of the integrator settles the motion; it is too sensitive for so long a run"


def _flexible(
    runs: Runs, rods: tuple[str, ...], fixed: Levels, tolerance: float, known: float, worst: float
) -> tuple[Rung, str]:
    """Climb to a yardstick, then trim. worst: what rigid rods may cost a priori, for want of anything better [m]."""
    yardstick = climb(runs, rods, fixed, tolerance - known)
    if isinstance(yardstick, str):
        refined = [rung for rung in runs.rungs if rung.role == YARDSTICK]
        if len(refined) < 2:
            rigid, _ = _rigid(runs, dict.fromkeys(runs.limits, RIGID), tolerance, worst)
            return rigid, yardstick
        refined[-1].error = distance(refined[-2].trajectory, refined[-1].trajectory) + known
        return refined[-1], yardstick
    yardstick.error += known
    chosen = trim(runs, yardstick, rods, tolerance)
    if chosen is None:
        return yardstick.rung, "no model that was run is within the tolerance"
    return chosen, f"the yardstick, {yardstick.rung.name}, is {chosen.error - yardstick.error:.1g} m away"


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
    status, message = run.status, run.message
    if run.ok and not met:
        status, message = (Status.FAILED,), f"tolerance not met, estimated error {rung.error:.2g} m: {reason}"
    return replace(run, times=asked, points=run.points[index], angles=run.angles[index], status=status, message=message)
