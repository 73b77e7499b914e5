"""Error of contacts that give way, by runs with stiffer ones: the remaining distance is disagreement.

A spring that stands for a rigid contact is entered by a depth and for a time that are proportional to stiffness^-1/2.
Engines with such springs make them as stiff as the step resolves, stiffness ~ step^-2, so that the error is
proportional to the step, and the limit of rigid contacts follows by extrapolation (Richardson).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.engines.contract import Engine
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

REFINED = (1.0, 0.5, 0.25)
"""Steps of the runs, over the stated one."""
SAFETY = 2.0
"""Of errors, which fall unevenly, as impacts begin anywhere within a step; where laws agree 1.03 was met."""


@dataclass(frozen=True, eq=False)
class PenaltyStudy:
    """Runs of an engine whose contacts are springs, each step half the one before: four times the stiffness."""

    runs: tuple[Trajectory, ...]

    @property
    def ok(self) -> bool:
        """Return whether every run can be believed."""
        return all(run.ok for run in self.runs)

    @property
    def rigid(self) -> tuple[Array, Array]:
        """Return points of the markers for rigid contacts, from the first two runs and from the last two."""
        first, second, third = (run.points[..., 0] for run in self.runs)
        return 2.0 * second - first, 2.0 * third - second

    def row(self, reference: Trajectory) -> dict[str, Any]:
        """Return distances from a run with rigid contacts, root mean squares over the samples, largest of markers [m].

        distances: by stiffness; penalty: of the stiffest run from the limit; rigid: of the limit; uncertainty: of the
        limit, by how much the last run moved it; disagrees: whether the limit is further away than `SAFETY` times both
        """
        names = ("penalty", "rigid", "uncertainty", "disagrees")
        if not self.ok:
            return {"distances": [None] * len(self.runs), **dict.fromkeys(names)}
        ours, (before, limit) = reference.points[..., 0], self.rigid
        distances = [_apart(run.points[..., 0], ours) for run in self.runs]
        penalty, rigid = _apart(self.runs[-1].points[..., 0], limit), _apart(limit, ours)
        uncertainty = _apart(limit, before)
        found = (penalty, rigid, uncertainty, rigid > SAFETY * (penalty + uncertainty))
        return {"distances": distances, **dict(zip(names, found, strict=True))}


def study(engine: Engine, scene: Scene, run: Trajectory) -> PenaltyStudy | None:
    """Return the runs with stiffer contacts of a run of a scene; None where none of its contacts gives way."""
    if not run.model.get("contacts"):
        return None
    finer = (scene.with_values({"solver.step": part * scene.solver.step}) for part in REFINED[1:])
    return PenaltyStudy((run, *(engine.simulate(one, run.times) for one in finer)))


def _apart(one: Array, other: Array) -> float:
    """Return the root mean square of a distance over the samples, (samples, markers, d), the largest of markers."""
    return float(np.sqrt(np.max(np.mean(np.sum((one - other) ** 2, axis=-1), axis=0))))
