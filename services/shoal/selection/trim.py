"""Down again: the cheapest model that still agrees with the yardstick."""

from __future__ import annotations

from itertools import product

import numpy as np

from shoal.selection.climb import Runs, Yardstick
from shoal.selection.levels import Level, Levels, below
from shoal.selection.run import Rung, distance

WITHIN = 0.9
"""A model meets the tolerance if its estimated error is within this fraction of it."""
CHEAPER = 0.95
"""A coarser level is tried only if the rod's foreseen work is below this fraction of the last that was tried."""
HARMLESS = 0.1
"""While one rod goes down, those before it stay at the cheapest level that costs this part of the tolerance at most."""
MISSES = 2
"""So many levels in a row beyond twice the tolerance end the way down."""
HOPEFUL = 1.6
"""Errors of rods may cancel: combinations are tried up to this multiple of the tolerance."""
TRIES = 10
"""Combinations that are run before the climb's own model is taken."""


def trim(runs: Runs, yardstick: Yardstick, rods: tuple[str, ...], tolerance: float) -> Rung | None:
    """The cheapest rung found within the tolerance; None if none is.

    Each rod alone goes down from the base. Their errors are taken to add up, which tells the combinations worth
    trying, the cheapest first; what counts is the distance of the combination itself from the yardstick.
    """
    base = judged(runs, yardstick, yardstick.base)
    tables: dict[str, dict[Level, float]] = {}
    context = base
    for rod in sorted(rods, key=lambda rod: -runs.forecast.own(rod, yardstick.base[rod])):
        tables[rod] = table = _down(runs, yardstick, context, rod, tolerance)
        harmless = [level for level, part in table.items() if part <= HARMLESS * tolerance]
        cheapest = min(harmless, key=lambda level: runs.forecast.own(rod, level))
        context = judged(runs, yardstick, {**context.levels, rod: cheapest})
    for levels in _combinations(runs, yardstick, base, tables, tolerance)[:TRIES]:
        rung = judged(runs, yardstick, levels)
        if rung.error <= WITHIN * tolerance:
            return rung
    return next((rung for rung in (base, yardstick.rung) if rung.error <= tolerance), None)


def judged(runs: Runs, yardstick: Yardstick, levels: Levels) -> Rung:
    """The run on these levels with its estimated error."""
    rung = runs(levels, role="candidate")
    rung.error = distance(rung.trajectory, yardstick.rung.trajectory) + yardstick.error
    return rung


def _down(runs: Runs, yardstick: Yardstick, context: Rung, rod: str, tolerance: float) -> dict[Level, float]:
    """Distance from the context [m] of the models in which one rod alone is coarser."""
    start = context.levels[rod]
    table = {start: 0.0}
    last, misses = runs.forecast.own(rod, start), 0
    for level in below(start, runs.limits[rod]):
        if (work := runs.forecast.own(rod, level)) > CHEAPER * last:
            continue
        last = work
        rung = judged(runs, yardstick, {**context.levels, rod: level})
        table[level] = distance(rung.trajectory, context.trajectory)
        misses = misses + 1 if rung.error > 2 * tolerance else 0
        if misses == MISSES:
            break
    return table


def _combinations(
    runs: Runs, yardstick: Yardstick, base: Rung, tables: dict[str, dict[Level, float]], tolerance: float
) -> list[Levels]:
    """Combinations that may meet the tolerance, by foreseen work."""
    found = []
    for chosen in product(*tables.values()):
        levels = {**yardstick.base, **dict(zip(tables, chosen, strict=True))}
        error = base.error + sum(table[level] for table, level in zip(tables.values(), chosen, strict=True))
        if np.isfinite(error) and error <= HOPEFUL * tolerance:
            found.append((runs.forecast.work(levels), levels))
    return [levels for _, levels in sorted(found, key=lambda pair: pair[0])]
