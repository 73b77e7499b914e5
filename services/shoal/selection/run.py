"""One candidate: a model of the scene, run once, with the time step or tolerance that goes with it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.mechanics.simulate import stable_step
from shoal.scene import Scene
from shoal.selection.levels import FEWEST, Level, Levels, apply, coarsest, open_rods, words
from shoal.selection.work import INTEGRATOR
from shoal.trajectory import Array, Trajectory

CLOSE = 1e-8
"""The integrator's tolerance for rigid machines beside flexible ones."""


@dataclass
class Candidate:
    """A model that was run.

    error: estimated distance from the truth at the markers [m], nan if unknown
    excess: of references, see `excessive_strain`
    """

    levels: dict[str, Level]
    scene: Scene
    trajectory: Trajectory
    work: float
    error: float = np.nan
    role: str = ""
    tolerance: float = field(default=np.nan)
    excess: str = ""

    @property
    def ok(self) -> bool:
        """Return whether the run may be believed."""
        return self.trajectory.ok

    @property
    def name(self) -> str:
        """Levels in words."""
        said = words(self.levels) or "as stated"
        return f"{said}, inertia capped" if self.scene.solver.inertia_cap else said


def flexible_scene(scene: Scene, levels: Levels, fraction: float) -> Scene:
    """The scene on these levels, by leapfrog with a fraction of its longest stable step, or with more than that step.

    Beyond it, the inertia of axial modes is raised. Where all are rigid, see `rigid_scene`. Raises InputError.
    """
    if all(level.element == "rigid" for level in levels.values()):
        return rigid_scene(scene, levels, CLOSE)
    duration, modelled = scene.solver.duration, apply(scene, levels)
    steps = max(int(np.ceil(duration / (fraction * stable_step(modelled, INTEGRATOR)))), scene.solver.samples)
    pace = {"integrator": INTEGRATOR, "step": duration / steps, "inertia_cap": fraction > 1}
    return modelled.with_values({f"solver.{name}": value for name, value in pace.items()})


def rigid_scene(scene: Scene, levels: Levels, tolerance: float) -> Scene:
    """The scene on rigid levels, by an adaptive integrator that keeps the error of each step below a tolerance."""
    values = {"solver.relative_tolerance": tolerance, "solver.absolute_tolerance": 0.1 * tolerance}
    return apply(scene, levels).with_values({"solver.integrator": "auto", **values})


def run(scene: Scene, times: Array, *, whole: bool = False) -> Trajectory:
    """The motion; whole: with its states. Raises InputError."""
    return GaussEngine().simulate(scene, times, whole=whole)


def distance(one: Trajectory, other: Trajectory) -> float:
    """Largest distance of a marker between two runs over all times [m]; infinite unless both may be believed."""
    if not (one.ok and other.ok):
        return np.inf
    return one.distance(other)


def fewest(scene: Scene, rod: str, limit: str) -> int | str:
    """The least number of elements by which this rod can bend, or why it has to stay rigid.

    limit: the element it would be made of. Of director rods several numbers are tried, as joints hold them at nodes.
    """
    coarse = coarsest(scene, open_rods(scene) | {rod: limit})
    least, reason = coarse[rod].elements, ""
    for n in (least, *(n for n in FEWEST if n > least and limit == "director-rod")):
        try:
            stable_step(apply(scene, coarse | {rod: Level(limit, n)}), INTEGRATOR)
        except InputError as error:
            reason = reason or str(error)
        else:
            return n
    return reason.replace(f"other elements than {least}", "state elements instead of a tolerance")
