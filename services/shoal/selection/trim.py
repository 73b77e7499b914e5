"""Down again: the cheapest model that still agrees with the yardstick."""

from __future__ import annotations

from itertools import product

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.numerics.alike import FEW
from shoal.mechanics.simulate import STEP_MARGIN
from shoal.selection.climb import PACE, TELL, Runs, Yardstick
from shoal.selection.levels import FRAMED, LADDERS, Level, Levels, below
from shoal.selection.run import Rung, distance

WITHIN = 0.9
"""A model meets the tolerance if its estimated error is within this fraction of it."""
CHEAPER = 0.95
"""A coarser level is tried only if the rod's foreseen work is below this fraction of the last that was tried."""
HARMLESS = 0.1
"""While one rod goes down, those before it stay at the cheapest level that costs this part of the tolerance at most."""
MISSES = 2
"""So many levels in a row beyond twice the tolerance end the way down the elements."""
GAINS = 2.0
"""Twice as many modes that gain less end the way up."""
HOPEFUL = 1.6
"""Errors of rods may cancel: combinations are tried up to this multiple of the tolerance."""
TRIES = 10
"""Combinations that are run before the climb's own model is taken."""
STRIDES = (3.0, 2.0, 1.4)
"""Longer steps, in stable ones, that are tried with capped inertia."""
SHARE, SEARCH = 1.0, TELL * PACE
"""A way down may take so much of the climb's work, and so much in any case."""
VECTORS = {"rigid": 0, "ancf-cable": 2, "ancf-quintic": 3}
"""Nodal vectors that an element adds, of those whose inertia can be capped."""


def trim(runs: Runs, yardstick: Yardstick, rods: tuple[str, ...], tolerance: float) -> Rung | None:
    """The cheapest rung found within the tolerance; None if none is.

    The way goes down from the base, and before that from all rods in frames: beside elements, which limit the steps,
    rods in frames cost more than they save. Each way takes no more work than the climb did, or about five seconds.
    """
    share = max(SHARE * runs.work, SEARCH)
    framed = _in_frames(runs, yardstick, rods, tolerance, share)
    if framed and framed.work <= _lightest(runs, rods) / max(STRIDES):
        return framed
    base = judged(runs, yardstick, yardstick.base)
    meshed = _down(runs, yardstick, base, rods, tolerance, runs.work + share)
    found = [rung for rung in (framed, meshed) if rung] or [r for r in (base, yardstick.rung) if r.error <= tolerance]
    return min(found, key=lambda rung: rung.work, default=None)


def _in_frames(runs: Runs, yardstick: Yardstick, rods: tuple[str, ...], tolerance: float, share: float) -> Rung | None:
    """The cheapest rung within the tolerance all of whose rods move with frames; None if none is found."""
    if any(runs.coarsest[rod].element not in FRAMED for rod in rods):
        return None
    ladders = [
        [level for level in LADDERS[runs.limits[rod]] if level.element in FRAMED and runs.knows(rod, level)]
        for rod in rods
    ]
    coarsest, finest = (
        yardstick.base | {rod: levels[end] for rod, levels in zip(rods, ladders, strict=True)} for end in (0, -1)
    )
    rung = judged(runs, yardstick, coarsest)
    if rung.error <= WITHIN * tolerance:
        return rung
    if runs.forecast.work(finest) >= runs.forecast.work(yardstick.base):
        return None
    top = judged(runs, yardstick, finest)
    return _down(runs, yardstick, top, rods, tolerance, runs.work + share) if top.error <= WITHIN * tolerance else None


def _lightest(runs: Runs, rods: tuple[str, ...]) -> float:
    """The least work of a model in which at least one rod has elements."""
    works = []
    for rod in rods:
        fewest = {level.element: level for level in reversed(LADDERS[runs.limits[rod]]) if level.element not in FRAMED}
        levels = [level for level in fewest.values() if runs.knows(rod, level)]
        works += [runs.forecast.work({**runs.coarsest, rod: level}) for level in levels]
    return min(works, default=np.inf)


def _down(
    runs: Runs, yardstick: Yardstick, base: Rung, rods: tuple[str, ...], tolerance: float, enough: float
) -> Rung | None:
    """The cheapest rung found below a base within the tolerance; None if none is.

    Each rod alone goes down from the base. Their errors are taken to add up, which tells the combinations worth
    trying, the cheapest first; what counts is the distance of the combination itself from the yardstick.
    """
    tables: dict[str, dict[Level, float]] = {}
    context = base
    for rod in sorted(rods, key=lambda rod: -runs.forecast.own(rod, base.levels[rod])):
        tables[rod] = table = _alone(runs, yardstick, context, rod, tolerance, enough)
        harmless = [level for level, part in table.items() if part <= HARMLESS * tolerance]
        cheapest = min(harmless, key=lambda level: runs.forecast.own(rod, level))
        context = judged(runs, yardstick, {**context.levels, rod: cheapest})
    for rod, table in tables.items():
        if not np.all(np.isfinite(list(table.values()))):  # other rods, as fine as they were, may have diverged
            again = _alone(runs, yardstick, context, rod, tolerance, enough)
            table |= {level: part for level, part in again.items() if part < table.get(level, np.inf)}
    combinations = _combinations(runs, base, tables, tolerance)
    for levels in combinations[:TRIES]:
        if runs.work > enough:
            break
        rung = judged(runs, yardstick, levels)
        if rung.error <= WITHIN * tolerance:
            return _strided(runs, yardstick, combinations, tolerance, rung)
    return None


def _strided(runs: Runs, yardstick: Yardstick, combinations: list[Levels], tolerance: float, found: Rung) -> Rung:
    """A cheaper rung within the tolerance by longer steps with capped inertia, or else the one that was found.

    Models whose mass matrix is not inverted as a whole lose more by the capped one than longer steps gain.
    """
    few = [levels for levels in combinations if _few(levels) and runs.forecast.work(levels) > 0]
    longer = [(runs.forecast.work(levels) / stride, stride, levels) for levels in few for stride in STRIDES]
    cheaper = [one for one in longer if one[0] < CHEAPER * found.work]
    for _, stride, levels in sorted(cheaper, key=lambda one: one[0])[:TRIES]:
        try:
            rung = judged(runs, yardstick, levels, stride * STEP_MARGIN)
        except InputError:
            continue  # bending is as fast as stretching
        if rung.error <= WITHIN * tolerance:
            return rung
    return found


def _few(levels: Levels) -> bool:
    cappable = all(level.element in VECTORS for level in levels.values())
    return cappable and sum(VECTORS[level.element] * level.elements for level in levels.values()) <= FEW


def judged(runs: Runs, yardstick: Yardstick, levels: Levels, fraction: float = STEP_MARGIN) -> Rung:
    """The run on these levels with its estimated error."""
    rung = runs(levels, fraction, role="candidate")
    rung.error = distance(rung.trajectory, yardstick.rung.trajectory) + yardstick.error
    return rung


def _alone(
    runs: Runs, yardstick: Yardstick, context: Rung, rod: str, tolerance: float, enough: float
) -> dict[Level, float]:
    """Distance from the context [m] of the models in which one rod alone is coarser, until so much work is done."""
    start = context.levels[rod]
    table = {start: 0.0}

    def miss(level: Level) -> float:
        rung = judged(runs, yardstick, {**context.levels, rod: level})
        table[level] = distance(rung.trajectory, context.trajectory)
        return rung.error

    lower = [level for level in below(start, runs.limits[rod], runs.coarsest[rod]) if runs.knows(rod, level)]
    framed = [level for level in reversed(lower) if level.element in FRAMED]
    before = np.inf
    for level in framed:
        miss(level)
        if table[level] <= HARMLESS * tolerance or GAINS * table[level] > before or runs.work > enough:
            break
        before = table[level] if level.modes else np.inf
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


def _combinations(runs: Runs, base: Rung, tables: dict[str, dict[Level, float]], tolerance: float) -> list[Levels]:
    """Combinations that may meet the tolerance, by foreseen work."""
    found = []
    for chosen in product(*tables.values()):
        levels = {**base.levels, **dict(zip(tables, chosen, strict=True))}
        error = base.error + sum(table[level] for table, level in zip(tables.values(), chosen, strict=True))
        if np.isfinite(error) and error <= HOPEFUL * tolerance:
            found.append((runs.forecast.work(levels), levels))
    return [levels for _, levels in sorted(found, key=lambda pair: pair[0])]
