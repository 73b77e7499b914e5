"""Down again: the cheapest model that still agrees with the yardstick."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.numerics.alike import FEW
from shoal.mechanics.simulate import STEP_MARGIN
from shoal.scene import FRAMED
from shoal.selection.climb import PACE, TELL, Runs, Yardstick
from shoal.selection.levels import LADDERS, Level, Levels, below
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

    A rod in a frame costs more than a few elements, unless it lets the machine take longer steps: so the rods whose
    elements limit the step most go into frames, together. Each way down, from some of them or none, the one that
    promises most first, takes no more work than the climb did, or about five seconds.
    """
    share = max(SHARE * runs.work, SEARCH)
    fewest = {rod: _fewest(runs, rod) for rod in rods}
    fastest = sorted(rods, key=lambda rod: runs.forecast.step({rod: fewest[rod]}))
    ways = [fastest[:count] for count in range(len(rods) + 1)]

    def least(framed: Sequence[str]) -> float:
        levels = {**runs.coarsest, **fewest, **{rod: runs.coarsest[rod] for rod in framed}}
        return runs.forecast.work(levels) / (max(STRIDES) if _few(levels) else 1.0)

    found: list[Rung] = []
    for framed in sorted(ways, key=least):
        if found and min(rung.work for rung in found) <= least(framed):
            break
        start = _start(runs, yardstick, framed, tolerance)
        rung = _down(runs, yardstick, start, rods, tolerance, runs.work + share) if start else None
        found += [rung] if rung else []
    if not found:
        finest = judged(runs, yardstick, yardstick.base), yardstick.rung
        found = [rung for rung in finest if rung.error <= tolerance]
    return min(found, key=lambda rung: rung.work, default=None)


def _start(runs: Runs, yardstick: Yardstick, framed: Sequence[str], tolerance: float) -> Rung | None:
    """The base with some rods in frames, rigid ones if that is near enough; None if it is with no number of modes."""
    if any(runs.coarsest[rod].element not in FRAMED for rod in framed):
        return None
    if not framed:
        return judged(runs, yardstick, yardstick.base)
    rigid = judged(runs, yardstick, yardstick.base | {rod: runs.coarsest[rod] for rod in framed})
    if rigid.error <= WITHIN * tolerance:
        return rigid
    most = judged(runs, yardstick, yardstick.base | _modes(runs, yardstick, framed))
    return most if most.error <= HOPEFUL * tolerance else None


def _modes(runs: Runs, yardstick: Yardstick, framed: Sequence[str]) -> dict[str, Level]:
    """Of these rods as many modes as take the same step, the most with which the model costs less than the base."""
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
        if runs.forecast.work(yardstick.base | frames) < runs.forecast.work(yardstick.base):
            break
    return frames


def _fewest(runs: Runs, rod: str) -> Level:
    """The cheapest level of a rod that has elements."""
    fewest = dict[str, Level]()
    for level in LADDERS[runs.limits[rod]]:
        if level.element not in (*FRAMED, *fewest) and runs.knows(rod, level):
            fewest[level.element] = level
    return min(fewest.values(), key=lambda level: runs.forecast.own(rod, level))


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


def _combinations(runs: Runs, base: Rung, tables: dict[str, dict[Level, float]], tolerance: float) -> list[Levels]:
    """Combinations that may meet the tolerance, by foreseen work."""
    found = []
    for chosen in product(*tables.values()):
        levels = {**base.levels, **dict(zip(tables, chosen, strict=True))}
        error = base.error + sum(table[level] for table, level in zip(tables.values(), chosen, strict=True))
        if np.isfinite(error) and error <= HOPEFUL * tolerance:
            found.append((runs.forecast.work(levels), levels))
    return [levels for _, levels in sorted(found, key=lambda pair: pair[0])]
