"""Selection of a model, in words and as the rows of a table, and whether its positions may be shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory


def tells_places(motion: Trajectory, found: Selection | None = None) -> bool:
    """Return whether positions may be shown: of a run that is accepted, or misses a tolerance by a known error."""
    return motion.ok or (found is not None and bool(np.isfinite(found.chosen.error)))


def why(found: Selection) -> list[str]:
    """The reasons of the choice, in sentences."""
    taken = found.chosen.name if found.met else "none"
    reasons = [f"Of {len(found.candidates)} models, {taken} was taken: {found.reason}."]
    reasons += [f"{rod} stays rigid: {reason}." for rod, reason in found.rigid.items()]
    return reasons


def rows(found: Selection) -> list[list[str]]:
    """Every model that was run: name, unknowns, steps, time [ms], error [m], what came of it."""
    table = []
    for candidate in found.candidates:
        verdict = str(candidate.trajectory.status[0]) if not candidate.ok else ""
        if candidate is found.chosen:
            verdict = "chosen" if found.met else verdict or "nearest"
        name = (
            f"{candidate.name}, tolerance {candidate.tolerance:g}"
            if np.isfinite(candidate.tolerance)
            else candidate.name
        )
        error = f"{candidate.error:.1e}" if np.isfinite(candidate.error) else "–"
        cost = f"{candidate.trajectory.wall_s * 1e3:.1f}"
        table.append(
            [name, str(candidate.trajectory.model["unknowns"]), str(candidate.trajectory.steps), cost, error, verdict]
        )
    return table
