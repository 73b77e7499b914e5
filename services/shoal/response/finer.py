"""Which bounds move if the runs that attain them are repeated on a mesh that is twice as fine."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.engines.ways import on_finer_mesh
from shoal.response.inputs import BoolArray
from shoal.response.machine import ResponseModel
from shoal.response.runs import CachedModel
from shoal.scene.refined import refined
from shoal.trajectory import Array, plain

MOST = 48
"""Runs that are repeated: those that attain most bounds."""


@dataclass(frozen=True)
class Finer:
    """What the finer mesh says at the same values of the parameters, less what the mesh of the study says.

    mesh: path -> value; runs: repeated; lower, upper: of every column, nan where the run is not among them, (columns,);
    failed: those that failed on the finer mesh
    """

    mesh: dict[str, Any]
    runs: int
    failed: int
    lower: Array
    upper: Array

    def most(self, columns: BoolArray) -> tuple[float, int, str] | None:
        """Of these columns, (columns,), the bound that moves furthest: by how much, in which column, and its side."""
        found: list[tuple[float, int, str]] = []
        for side, moved in (("lower", self.lower), ("upper", self.upper)):
            known = np.flatnonzero(columns & np.isfinite(moved))
            if known.size:
                k = int(known[np.abs(moved[known]).argmax()])
                found.append((float(moved[k]), k, side))
        return max(found, key=lambda one: abs(one[0]), default=None)

    def to_json(self) -> dict[str, Any]:
        """Without the columns."""
        known = np.isfinite(np.concatenate([self.lower, self.upper]))
        return {"mesh": self.mesh, "runs": self.runs, "failed": self.failed, "share_of_bounds": plain(known.mean())}


def repeated(machine: ResponseModel, runs: CachedModel) -> Finer | None:
    """None where nothing bends. Raises InputError."""
    mesh = refined(machine.scene, 2)
    if not mesh:
        return None
    values = runs.values
    attain = np.stack([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = [run for run, _ in Counter(attain.ravel().tolist()).most_common(MOST)]
    given = runs.inputs.values(runs.germs[chosen])
    answers = None
    for scene in on_finer_mesh(machine.scene, 2):
        answers = replace(machine, scene=scene, keep=None)(given)
        if answers.good.all():
            break
    assert answers is not None
    moved = np.where(answers.good[:, None], answers.values - values[chosen], np.nan)
    place = {run: k for k, run in enumerate(chosen)}
    sides = []
    for side in attain:
        rows = np.array([place.get(run, -1) for run in side.tolist()])
        sides.append(np.where(rows >= 0, moved[rows, np.arange(len(rows))], np.nan))
    return Finer(mesh, len(chosen), int((~answers.good).sum()), *sides)
