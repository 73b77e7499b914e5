"""Adaptive model selection, first part: refine the rods until two meshes agree; the finer one is the reference."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.simulate import STEP_MARGIN, stable_step
from shoal.scene import FRAMED, Scene
from shoal.selection.levels import REFINEMENTS, SHEARS, Level, Levels, apply, coarsest, words
from shoal.selection.run import Candidate, distance, flexible_scene, run
from shoal.selection.strain_limits import excessive_strain
from shoal.selection.work import INTEGRATOR, Forecast
from shoal.trajectory import Array

PATIENCE = 60.0
"""Seconds that one run may take before the refinement ends, unless others are stated."""
PACE = 3e7
"""Steps of one cable element per second, about: the answer must not depend on the load of the computer."""
TELL = 5.0
"""A run of more seconds is announced before it begins."""
REJECTED = 3
"""Rejected refinements in a row that end the refinement where another theory remains to be tried."""
AGREE = 0.5
"""Two neighbours agree when they are closer than this fraction of the tolerance."""
FINE, GAIN = 16, 3.0
"""From this number of elements on, a doubling should gain at least this factor."""
FOLLOWED, FAR = 64, 4.0
"""Meshes of this many elements, this many tolerances apart, that strain a rod beyond all theory end the refinement."""
HALF = 0.5 * STEP_MARGIN
"""A reference takes half the stable step: its time error is a quarter of that of the coarser mesh."""
SLOW = 1.25
"""Least factor by which an error is taken to fall from one refinement to the next."""
BELIEVED = (2.0, 4.0, 16.0)
"""Largest factor, after none, one and two observed ones: one may be chance, and elements are of fourth order."""
TWISTS = 4.0
"""Largest factor for director rods, whose twist is of second order."""
SET_BACK = 0.02
"""A rod whose doubling moves the markers by less than this fraction of the tolerance returns to the coarser mesh."""

REFERENCE = "reference"
"""Role of the refinements in the list of candidates."""

Progress = Callable[[str], None]


@dataclass
class ReferenceModel:
    """The finest model that was run and the coarser one that agrees with it.

    candidate, error: the finest and its own estimated error [m]; base: levels of the coarser
    """

    candidate: Candidate
    error: float
    base: dict[str, Level]


class LevelRuns:
    """Runs of one scene on different levels, each made once.

    limits: the open rods with the element whose limit is their truth; fewest: see `run.fewest`; coarsest: the first
    levels of their ladders; candidates: all runs, in order; work: of all of them, in steps of one cable element;
    patience: longest time of a refinement [s]; meshed: see `select`
    """

    def __init__(
        self,
        scene: Scene,
        times: Array,
        limits: Mapping[str, str],
        progress: Progress,
        patience: float = PATIENCE,
        meshed: Collection[str] = (),
        fewest: Mapping[str, int] | None = None,
    ) -> None:
        scene = scene.with_values({"solver.inertia_cap": False})
        self.scene, self.times, self.limits, self.progress = scene, times, limits, progress
        self.patience = patience
        coarse = coarsest(scene, limits, meshed)
        self.fewest = {rod: (fewest or {}).get(rod, level.elements) for rod, level in coarse.items()}
        self.coarsest = {
            rod: level if level.element in FRAMED else replace(level, elements=self.fewest[rod])
            for rod, level in coarse.items()
        }
        self.forecast = Forecast(scene, self.coarsest, self.fewest)
        self.candidates: list[Candidate] = []
        self.work = 0.0
        self._done: dict[tuple[tuple[tuple[str, Level], ...], float], Candidate] = {}

    def __call__(self, levels: Levels, fraction: float = STEP_MARGIN, role: str = "") -> Candidate:
        """Run these levels with a fraction of the stable step, see `flexible_scene`."""
        key = tuple(levels.items()), fraction
        if key not in self._done:
            scene = flexible_scene(self.scene, levels, fraction)
            foreseen = self.forecast.work(levels) * STEP_MARGIN / fraction
            if (seconds := foreseen / PACE) > TELL:
                self.progress(f"run {words(levels)}, about {seconds:.0f} s")
            self.work += foreseen
            work = min(foreseen, self.forecast.work(levels))
            shears = role == REFERENCE and any(level.element == SHEARS for level in levels.values())
            trajectory = run(scene, self.times, whole=shears)
            candidate = Candidate(dict(levels), scene, replace(trajectory, states=None), work, role=role)
            if shears:
                # A run that is rejected at its end is believed where it is accepted up to there: meshes that are too
                # coarse lose their energy, and what they are strained by then is nothing of the rod's.
                candidate.excess = excessive_strain(
                    scene,
                    trajectory.states,
                    self.times,
                    lambda until: candidate.ok or run(scene, self.times[self.times <= until]).ok,
                )
            self.add(candidate)
            self._done[key] = candidate
        return self._done[key]

    def knows(self, rod: str, level: Level) -> bool:
        """Return whether a rod can have a level: not every rod can bend by modes, or has nodes at its joints."""
        try:
            self.forecast.own(rod, level)
            if level.element == "director-rod":
                stable_step(apply(self.scene, {**self.coarsest, rod: level}), INTEGRATOR)
        except InputError:
            return False
        return True

    def refined(self, count: Mapping[str, int]) -> dict[str, Level]:
        """Return levels with these numbers of elements, of the kind whose limit is the truth of each rod."""
        return {rod: Level(self.limits[rod], n) for rod, n in count.items()}

    def add(self, candidate: Candidate) -> None:
        """Record a run."""
        self.candidates.append(candidate)
        self.progress(f"ran {candidate.name}")


def refine(
    runs: LevelRuns, rods: tuple[str, ...], fixed: Levels, tolerance: float, impatient: bool = False
) -> ReferenceModel | str:
    """Refine the rods until two meshes agree; else return the reason why none do.

    impatient: another theory remains: end also where runs are rejected, or a doubling of the elements gains little, as
    where no limit is near. Otherwise a fine mesh may follow a kink that coarse ones cannot; see `FOLLOWED`.
    """
    count, growing, rejected = {rod: runs.fewest[rod] for rod in rods}, rods, 0
    gaps: list[float] = []
    behind: dict[str, float] = {}
    fine = _refinement(runs, {**fixed, **runs.refined(count)})
    while isinstance(fine, Candidate):
        coarse, base = fine, dict(count)
        if any(2 * count[rod] > REFINEMENTS[-1] for rod in growing):
            return f"{max(count[rod] for rod in growing)} elements for {', '.join(growing)} do not settle it"
        count |= {rod: 2 * count[rod] for rod in growing}
        fine = _refinement(runs, {**fixed, **runs.refined(count)})
        if isinstance(fine, str):
            break
        rejected = 0 if fine.ok else rejected + 1
        if impatient and rejected == REJECTED:
            return f"the runs are rejected: {fine.trajectory.message}"
        gaps.append(distance(coarse.trajectory, fine.trajectory))
        if coarse.excess and fine.excess and max(base.values()) >= FOLLOWED and gaps[-1] > FAR * tolerance:
            return fine.excess
        coarse.error = gaps[-1]
        error = left(gaps, fine.levels)[0] + sum(behind.values())
        if max(error, gaps[-1]) <= AGREE * tolerance:
            fine.error = error
            return ReferenceModel(fine, error, {**fixed, **runs.refined(base)})
        if impatient and max(count.values()) >= FINE and len(gaps) > 1 and gaps[-2] < GAIN * gaps[-1] < np.inf:
            return f"twice as many elements gain a factor of {gaps[-2] / gaps[-1]:.2g} only"
        if len(growing) > 1 and fine.ok:
            growing = _next(runs, fine, count, base, growing, behind, tolerance)
    return fine


def _refinement(runs: LevelRuns, levels: Levels) -> Candidate | str:
    """Run these levels by half the stable step; else return that it would take too much work."""
    work = runs.forecast.work(levels) * STEP_MARGIN / HALF
    if (seconds := work / PACE) <= runs.patience:
        return runs(levels, HALF, REFERENCE)
    flexible = words({rod: level for rod, level in levels.items() if level.element != "rigid"})
    return (
        f"the next refinement ({flexible}) takes {work:.1g} element steps, "
        f"about {seconds:.2g} s, more than {runs.patience:.3g} s"
    )


def _next(
    runs: LevelRuns,
    fine: Candidate,
    count: dict[str, int],
    base: dict[str, int],
    growing: tuple[str, ...],
    behind: dict[str, float],
    tolerance: float,
) -> tuple[str, ...]:
    """Return the rods that cause the difference of two meshes: each returned to the coarser one alone shows its part.

    The others stay as they are; `behind` gets the error that this leaves [m], and those of the smallest parts return to
    the coarser mesh in `count`.
    """
    parts = {}
    for rod in growing:
        levels = fine.levels | runs.refined({rod: base[rod]})
        parts[rod] = distance(runs(levels, STEP_MARGIN, f"part of {rod}").trajectory, fine.trajectory)
    guilty = [rod for rod, part in parts.items() if part > AGREE * tolerance / (4 * len(growing))] or growing
    for rod in set(growing) - set(guilty):
        behind[rod] = parts[rod] / (BELIEVED[0] - 1.0)
        if parts[rod] < SET_BACK * tolerance:
            behind[rod] += parts[rod]
            count[rod] = base[rod]
    return tuple(guilty)


def left(gaps: Sequence[float], levels: Levels) -> tuple[float, float]:
    """Estimate the error of the last refinement [m] by Richardson extrapolation, and the factor by which it falls.

    gaps: distances of successive meshes, the finest last [m]; the smaller of the last two factors counts.
    levels: of the last refinement
    """
    falls = [a / b if b > 0 else np.inf for a, b in pairwise(gaps[-3:]) if a < np.inf]
    order = TWISTS if any(level.element == "director-rod" for level in levels.values()) else BELIEVED[-1]
    fall = max(SLOW, min([*falls, BELIEVED[len(falls)], order]))
    return float(gaps[-1] / (fall - 1.0)), float(fall)


def settled(refined: Sequence[Candidate]) -> tuple[float, str]:
    """Return the estimated error of the last refinement [m], and its reason."""
    gaps = [distance(a.trajectory, b.trajectory) for a, b in pairwise(refined)]
    error, fall = left(gaps, refined[-1].levels)
    return error, f"twice as many elements moved the markers by {gaps[-1]:.1g} m, each time {fall:.2g} times less"
