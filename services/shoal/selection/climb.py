"""Up the ladder: refine every rod that needs it until two neighbours agree, which makes the finer one a yardstick."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from shoal.mechanics.simulate import STEP_MARGIN
from shoal.scene import Scene
from shoal.selection.levels import REFINEMENTS, Level, Levels, coarsest, words
from shoal.selection.run import Rung, distance, flexible_scene, run
from shoal.selection.work import Forecast
from shoal.trajectory import Array

WORK_LIMIT = 1.5e8
"""Work of one run beyond which the climb gives up, in steps of one cable element: about ten seconds."""
REJECTED = 3
"""So many refinements in a row whose run is rejected end the climb where another theory is left."""
AGREE = 0.5
"""Two neighbours agree when they are closer than this fraction of the tolerance."""
FINE, GAIN = 16, 3.0
"""From so many elements on a doubling that gains less than this factor is little."""
HALF = 0.5 * STEP_MARGIN
"""A yardstick takes half the stable step, so that its time error is a quarter of its neighbours'."""
SLOW, FAST = 1.25, 16.0
"""No error of a climb that ended unsettled is taken to fall slower, or faster, from one refinement to the next."""
UNKNOWN_FALL = 4.0
"""By which factor an error is taken to fall from one refinement to the next before two falls were seen."""

YARDSTICK = "yardstick"
"""Role of the refinements in the list of rungs."""

Progress = Callable[[str], None]


@dataclass
class Yardstick:
    """The finest model that was run and the coarser one that agrees with it.

    rung, error: the finest and its own estimated error [m]; base: levels of the coarser
    """

    rung: Rung
    error: float
    base: dict[str, Level]


class Runs:
    """Runs of one scene on different levels, each made once.

    limits: the open rods with the element whose limit is their truth; coarsest: where their ladders begin; rungs: all
    runs, in the order they were made
    """

    def __init__(self, scene: Scene, times: Array, limits: Mapping[str, str], progress: Progress) -> None:
        scene = scene.with_values({"solver.inertia_cap": False})
        self.scene, self.times, self.limits, self.progress = scene, times, limits, progress
        self.coarsest = coarsest(scene, limits)
        self.forecast = Forecast(scene, self.coarsest)
        self.rungs: list[Rung] = []
        self._done: dict[tuple[tuple[tuple[str, Level], ...], float], Rung] = {}

    def __call__(self, levels: Levels, fraction: float = STEP_MARGIN, role: str = "") -> Rung:
        """The run on these levels with a fraction of the stable step, see `flexible_scene`."""
        key = tuple(levels.items()), fraction
        if key not in self._done:
            scene = flexible_scene(self.scene, levels, fraction)
            work = self.forecast.work(levels) * min(1.0, STEP_MARGIN / fraction)
            rung = Rung(dict(levels), scene, run(scene, self.times), work, role=role)
            self.add(rung)
            self._done[key] = rung
        return self._done[key]

    def refined(self, count: Mapping[str, int]) -> dict[str, Level]:
        """Rods of so many elements of the kind whose limit is their truth."""
        return {rod: Level(self.limits[rod], n) for rod, n in count.items()}

    def add(self, rung: Rung) -> None:
        """Note a run."""
        self.rungs.append(rung)
        self.progress(rung.name)


def climb(
    runs: Runs, rods: tuple[str, ...], fixed: Levels, tolerance: float, impatient: bool = False
) -> Yardstick | str:
    """Refine the rods until two neighbours agree; else say why that was not to be had.

    impatient: another theory is left; so also where runs are rejected, or a doubling of the elements gains little, as
    where no limit is near. Else a kink that coarse meshes cannot follow may be met by a fine one.
    """
    count = {rod: runs.coarsest[rod].elements for rod in rods}
    growing, gap, last_gap, rejected = rods, np.inf, np.nan, 0
    levels = {**fixed, **runs.refined(count)}
    if (work := 2 * runs.forecast.work(levels)) > WORK_LIMIT:
        return _too_much(levels, work)
    fine = runs(levels, HALF, YARDSTICK)
    while True:
        coarse, base = fine, dict(count)
        if any(count[rod] == REFINEMENTS[-1] for rod in growing):
            return f"{REFINEMENTS[-1]} elements for {', '.join(growing)} do not settle it"
        count |= {rod: REFINEMENTS[REFINEMENTS.index(count[rod]) + 1] for rod in growing}
        levels = {**fixed, **runs.refined(count)}
        if (work := 2 * runs.forecast.work(levels)) > WORK_LIMIT:
            return _too_much(levels, work)
        fine = runs(levels, HALF, YARDSTICK)
        rejected = 0 if fine.ok else rejected + 1
        if impatient and rejected == REJECTED:
            return f"the runs are rejected: {fine.trajectory.message}"
        last_gap, gap = gap, distance(coarse.trajectory, fine.trajectory)
        coarse.error = gap
        if gap <= AGREE * tolerance:
            fall = np.clip(last_gap / gap, 2.0, FAST) if np.isfinite(last_gap) and gap > 0 else UNKNOWN_FALL
            fine.error = gap / (fall - 1.0)
            return Yardstick(fine, float(fine.error), {**fixed, **runs.refined(base)})
        if impatient and max(count.values()) >= FINE and last_gap < GAIN * gap < np.inf:
            return f"twice as many elements gain a factor of {last_gap / gap:.2g} only"
        count, growing = _next(runs, fine, count, base, growing, tolerance)


def _next(
    runs: Runs, fine: Rung, count: dict[str, int], base: dict[str, int], growing: tuple[str, ...], tolerance: float
) -> tuple[dict[str, int], tuple[str, ...]]:
    """Element counts to go on with, and the rods that the gap comes from: each set back alone shows its part."""
    if len(growing) == 1 or not fine.ok:
        return count, growing
    parts = {}
    for rod in growing:
        levels = fine.levels | runs.refined({rod: base[rod]})
        parts[rod] = distance(runs(levels, STEP_MARGIN, f"part of {rod}").trajectory, fine.trajectory)
    guilty = tuple(rod for rod, part in parts.items() if part > AGREE * tolerance / (4 * len(growing)))
    settled = {rod: base[rod] for rod, part in parts.items() if part < tolerance / 50}
    return count | settled, guilty or growing


def _too_much(levels: Levels, work: float) -> str:
    flexible = words({rod: level for rod, level in levels.items() if level.element != "rigid"})
    return f"the next refinement ({flexible}) takes {work:.1g} element steps, more than {WORK_LIMIT:.1e}"


def settled(refined: Sequence[Rung]) -> tuple[float, str]:
    """The estimated error of the last of some refinements [m], and why: what the last doublings moved the markers by.

    Of two factors by which the distances fell the smaller one tells what is left; without them it is taken to be SLOW.
    """
    gaps = [distance(a.trajectory, b.trajectory) for a, b in pairwise(refined)][-3:]
    falls = [a / b for a, b in pairwise(gaps) if 0 < b < np.inf and a < np.inf]
    fall = min(falls) if len(falls) > 1 else SLOW
    said = f"twice as many elements moved the markers by {gaps[-1]:.1g} m, each time {fall:.2g} times less at least"
    return gaps[-1] / float(np.clip(fall, SLOW, FAST) - 1.0), said
