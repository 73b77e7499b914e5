"""Adaptive model selection, second part: coarsen the rods to the cheapest model that agrees with the reference."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.numerics.alike import FEW
from shoal.mechanics.simulate import STEP_MARGIN
from shoal.scene import FRAMED
from shoal.selection.levels import LADDERS, Level, Levels, below
from shoal.selection.refine import PACE, TELL, LevelRuns, ReferenceModel
from shoal.selection.run import Candidate, distance

WITHIN = 0.9
"""A model meets the tolerance if its estimated error is within this fraction of it."""
CHEAPER = 0.95
"""A coarser level is tried only if the rod's foreseen work is below this fraction of the last that was tried."""
HARMLESS = 0.1
"""While a rod is coarsened, the others have the cheapest level with at most this part of the tolerance as error."""
MISSES = 2
"""Levels in a row with an error beyond twice the tolerance that end the coarsening of a rod."""
GAINS = 2.0
"""Doubling the modes ends where it gains less than this factor."""
HOPEFUL = 1.6
"""Errors of rods may cancel: combinations are tried up to this multiple of the tolerance."""
TRIES = 10
"""Combinations that are run before the reference itself is taken."""
STRIDES = (3.0, 2.0, 1.4)
"""Longer steps, in stable ones, that are tried with capped inertia."""
SHARE, SEARCH = 1.0, TELL * PACE
"""Work that a coarsening may take: this share of that of the refinement, and this much in any case."""
VECTORS = {"rigid": 0, "ancf-cable": 2, "ancf-quintic": 3}
"""Nodal vectors that an element adds, of those whose inertia can be capped."""


def coarsen(runs: LevelRuns, reference: ReferenceModel, rods: tuple[str, ...], tolerance: float) -> Candidate | None:
    """Return the cheapest candidate within the tolerance; None if none is.

    A rod in a floating frame costs more than a few elements, unless it lets the machine take longer steps: so the rods
    whose elements limit the step most get frames, together. Each coarsening starts with some of them or none, the one
    with the least forecast work first, and takes no more work than the refinement did, or about five seconds.
    """
    share = max(SHARE * runs.work, SEARCH)
    fewest = {rod: _fewest(runs, rod) for rod in rods}
    fastest = sorted(rods, key=lambda rod: runs.forecast.step({rod: fewest[rod]}))
    ways = [fastest[:count] for count in range(len(rods) + 1)]

    def least(framed: Sequence[str]) -> float:
        levels = {**runs.coarsest, **fewest, **{rod: runs.coarsest[rod] for rod in framed}}
        return runs.forecast.work(levels) / (max(STRIDES) if _few(levels) else 1.0)

    found: list[Candidate] = []
    for framed in sorted(ways, key=least):
        if found and min(candidate.work for candidate in found) <= least(framed):
            break
        start = _start(runs, reference, framed, tolerance)
        candidate = _down(runs, reference, start, rods, tolerance, runs.work + share) if start else None
        found += [candidate] if candidate else []
    if not found:
        finest = judged(runs, reference, reference.base), reference.candidate
        found = [candidate for candidate in finest if candidate.error <= tolerance]
    return min(found, key=lambda candidate: candidate.work, default=None)


def _start(runs: LevelRuns, reference: ReferenceModel, framed: Sequence[str], tolerance: float) -> Candidate | None:
    """Return the base with some rods in floating frames, rigid if that is accurate enough; None if no modes suffice."""
    if any(runs.coarsest[rod].element not in FRAMED for rod in framed):
        return None
    if not framed:
        return judged(runs, reference, reference.base)
    rigid = judged(runs, reference, reference.base | {rod: runs.coarsest[rod] for rod in framed})
    if rigid.error <= WITHIN * tolerance:
        return rigid
    most = judged(runs, reference, reference.base | _modes(runs, reference, framed))
    return most if most.error <= HOPEFUL * tolerance else None


def _modes(runs: LevelRuns, reference: ReferenceModel, framed: Sequence[str]) -> dict[str, Level]:
    """Return numbers of modes that allow one step, the largest with which the model costs less than the base."""
    steps = {
        rod: {
            one: runs.forecast.step({rod: one})
            for one in LADDERS[runs.limits[rod]]
            if one.element in FRAMED and runs.knows(rod, one)
        }
        for rod in framed
    }
    frames = dict[str, Level]()
    for shortest in sorted({step for taken in steps.values() for step in taken.values()}):
        frames = {rod: [one for one, step in taken.items() if step >= shortest][-1] for rod, taken in steps.items()}
        if runs.forecast.work(reference.base | frames) < runs.forecast.work(reference.base):
            break
    return frames


def _fewest(runs: LevelRuns, rod: str) -> Level:
    """Return the cheapest level of a rod that has elements."""
    fewest = dict[str, Level]()
    for level in LADDERS[runs.limits[rod]]:
        if level.element not in (*FRAMED, *fewest) and runs.knows(rod, level):
            fewest[level.element] = level
    return min(fewest.values(), key=lambda level: runs.forecast.own(rod, level))


def _down(
    runs: LevelRuns, reference: ReferenceModel, base: Candidate, rods: tuple[str, ...], tolerance: float, enough: float
) -> Candidate | None:
    """Return the cheapest candidate coarser than a base and within the tolerance; None if none is.

    Each rod is coarsened alone. The sums of their errors choose the combinations to try, the cheapest first; the
    distance of a combination itself from the reference decides.
    """
    tables: dict[str, dict[Level, float]] = {}
    context = base
    for rod in sorted(rods, key=lambda rod: -runs.forecast.own(rod, base.levels[rod])):
        tables[rod] = table = _alone(runs, reference, context, rod, tolerance, enough)
        harmless = [level for level, part in table.items() if part <= HARMLESS * tolerance]
        cheapest = min(harmless, key=lambda level: runs.forecast.own(rod, level))
        context = judged(runs, reference, {**context.levels, rod: cheapest})
    for rod, table in tables.items():
        if not np.all(np.isfinite(list(table.values()))):  # other rods, as fine as they were, may have diverged
            again = _alone(runs, reference, context, rod, tolerance, enough)
            table |= {level: part for level, part in again.items() if part < table.get(level, np.inf)}
    combinations = _combinations(runs, base, tables, tolerance)
    for levels in combinations[:TRIES]:
        if runs.work > enough:
            break
        candidate = judged(runs, reference, levels)
        if candidate.error <= WITHIN * tolerance:
            return _strided(runs, reference, combinations, tolerance, candidate)
    return None


def _strided(
    runs: LevelRuns, reference: ReferenceModel, combinations: list[Levels], tolerance: float, found: Candidate
) -> Candidate:
    """Return a cheaper candidate within the tolerance by longer steps with capped inertia, else the one given.

    Models whose mass matrix is not inverted as a whole lose more by the capped one than longer steps gain.
    """
    few = [levels for levels in combinations if _few(levels) and runs.forecast.work(levels) > 0]
    longer = [(runs.forecast.work(levels) / stride, stride, levels) for levels in few for stride in STRIDES]
    cheaper = [one for one in longer if one[0] < CHEAPER * found.work]
    for _, stride, levels in sorted(cheaper, key=lambda one: one[0])[:TRIES]:
        try:
            candidate = judged(runs, reference, levels, stride * STEP_MARGIN)
        except InputError:
            continue  # bending is as fast as stretching
        if candidate.error <= WITHIN * tolerance:
            return candidate
    return found


def _few(levels: Levels) -> bool:
    cappable = all(level.element in VECTORS for level in levels.values())
    return cappable and sum(VECTORS[level.element] * level.elements for level in levels.values()) <= FEW


def judged(runs: LevelRuns, reference: ReferenceModel, levels: Levels, fraction: float = STEP_MARGIN) -> Candidate:
    """Run these levels and estimate their error by the reference."""
    candidate = runs(levels, fraction, role="candidate")
    candidate.error = distance(candidate.trajectory, reference.candidate.trajectory) + reference.error
    return candidate


def _alone(
    runs: LevelRuns, reference: ReferenceModel, context: Candidate, rod: str, tolerance: float, enough: float
) -> dict[Level, float]:
    """Return the distances from the context [m] of models in which one rod is coarser, until `enough` work is done."""
    start = context.levels[rod]
    table = {start: 0.0}

    def miss(level: Level) -> float:
        candidate = judged(runs, reference, {**context.levels, rod: level})
        table[level] = distance(candidate.trajectory, context.trajectory)
        return candidate.error

    lower = [level for level in below(start, runs.limits[rod], runs.coarsest[rod]) if runs.knows(rod, level)]
    if start.element in FRAMED:
        before = np.inf
        for level in reversed(lower):
            miss(level)
            if table[level] <= HARMLESS * tolerance or GAINS * table[level] > before or runs.work > enough:
                break
            before = table[level] if level.modes else np.inf
        return table
    last, misses = runs.forecast.own(rod, start), 0
    for level in lower:
        work = runs.forecast.own(rod, level)
        if level.element in FRAMED or work > CHEAPER * last:
            continue
        last = work
        misses = misses + 1 if miss(level) > 2 * tolerance else 0
        if misses == MISSES or runs.work > enough:
            break
    return table


def _combinations(
    runs: LevelRuns, base: Candidate, tables: dict[str, dict[Level, float]], tolerance: float
) -> list[Levels]:
    """Return the combinations that may meet the tolerance, by forecast work."""
    found = []
    for chosen in product(*tables.values()):
        levels = {**base.levels, **dict(zip(tables, chosen, strict=True))}
        error = base.error + sum(table[level] for table, level in zip(tables.values(), chosen, strict=True))
        if np.isfinite(error) and error <= HOPEFUL * tolerance:
            found.append((runs.forecast.work(levels), levels))
    return [levels for _, levels in sorted(found, key=lambda pair: pair[0])]
