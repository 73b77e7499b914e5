"""Verification of a study by more careful runs: known errors of decisive runs, and bounds on a finer mesh.

Errors of time step, mesh and neglected theory are known of every marker's quantity over time. What more careful runs
move a place by is what bounds, means and quantiles of the study may be off by, apart from the error of its own method:
outer bounds and errors of statistics take it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shoal.engines.deviation import by_source
from shoal.engines.sources import WRONG
from shoal.engines.verification import Verification, run_verified
from shoal.engines.ways import on_finer_mesh
from shoal.error_budget import ErrorBudget, worst
from shoal.findings import Finding
from shoal.json_values import plain
from shoal.response import findings as kinds
from shoal.response.enclosure import Bounds
from shoal.response.inputs import BoolArray
from shoal.response.machine import ResponseModel, stable
from shoal.response.probability_boxes import ProbabilityBoxes
from shoal.response.problem import UncertainProblem
from shoal.response.respond import ModelResponse
from shoal.response.runs import CachedModel
from shoal.response.statistics import Statistics
from shoal.scene.refined import refined
from shoal.trajectory import Array

REPEATED = 48
"""Runs that are repeated: those that attain most bounds."""


@dataclass(frozen=True)
class Finer:
    """Change of the bounds on a finer mesh at the same values of the parameters.

    mesh: path -> value; runs: repeated; lower, upper: of every column, nan where the run is not among them, (columns,);
    failed: those that failed on the finer mesh
    """

    mesh: dict[str, Any]
    runs: int
    failed: int
    lower: Array
    upper: Array

    def most(self, columns: BoolArray) -> tuple[float, int, str] | None:
        """Return the bound of these columns, (columns,), that moves furthest: by how much, its column and side."""
        found: list[tuple[float, int, str]] = []
        for side, moved in (("lower", self.lower), ("upper", self.upper)):
            known = np.flatnonzero(columns & np.isfinite(moved))
            if known.size:
                k = int(known[np.abs(moved[known]).argmax()])
                found.append((float(moved[k]), k, side))
        return max(found, key=lambda one: abs(one[0]), default=None)

    def to_json(self) -> dict[str, Any]:
        """Return plain data, without the columns."""
        known = np.isfinite(np.concatenate([self.lower, self.upper]))
        return {"mesh": self.mesh, "runs": self.runs, "failed": self.failed, "share_of_bounds": plain(known.mean())}


def repeat_on_finer_mesh(machine: ResponseModel, runs: CachedModel) -> Finer | None:
    """Repeat decisive runs on a finer mesh; None where nothing bends. Raises InputError."""
    mesh = refined(machine.scene, 2)
    if not mesh:
        return None
    values = runs.values
    attain = np.stack([values.argmin(axis=0), values.argmax(axis=0)])
    chosen = [run for run, _ in Counter(attain.ravel().tolist()).most_common(REPEATED)]
    given = runs.inputs.values(runs.xi[chosen])
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


NEGLIGIBLE = 0.01
"""Share of the spread of the runs below which an error rejects none of them (convention: one per cent)."""


@dataclass(frozen=True, eq=False)
class ModelErrors:
    """budget: of the markers, the largest of the runs that were repeated; columns: of every column, all sources
    together, (columns,); findings: that a more careful run rejects the model
    """

    budget: ErrorBudget
    columns: Array
    findings: list[Finding] = field(default_factory=list)

    def widened(self, found: ModelResponse) -> ModelResponse:
        """Return a response whose outer bounds and errors of statistics allow for the model."""
        return replace(
            found,
            bounds=None if found.bounds is None else self.of_bounds(found.bounds),
            statistics=None if found.statistics is None else self.of_statistics(found.statistics),
            boxes=None if found.boxes is None else self.of_boxes(found.boxes),
        )

    def of_bounds(self, found: Bounds) -> Bounds:
        """Bounds whose outer ones allow for the model."""
        off, chance = self.columns, found.likely
        wider = None if chance is None else np.stack([chance[0] - off, chance[1] + off])
        return replace(found.widened(off), likely=wider)

    def of_statistics(self, found: Statistics) -> Statistics:
        """Statistics whose errors allow for the model: a deviation differs by no more than the answers do."""
        return replace(found, error=found.error + self.columns, std_error=found.std_error + self.columns)

    def of_boxes(self, found: ProbabilityBoxes) -> ProbabilityBoxes:
        """Statistics over intervals whose outer bounds allow for the model."""
        off, std = self.columns, found.std.widened(self.columns)
        std = replace(std, lower_outer=np.maximum(std.lower_outer, 0.0))
        return replace(
            found, mean=found.mean.widened(off), std=std, quantiles=tuple(one.widened(off) for one in found.quantiles)
        )


def unestimated(machine: ResponseModel) -> ModelErrors:
    """Return errors of which none is known."""
    return ModelErrors(ErrorBudget(), np.zeros(int(np.prod(machine.columns))))


def model_errors(machine: ResponseModel, runs: CachedModel, chosen: Sequence[int]) -> ModelErrors:
    """Return the largest errors of some runs of a study. chosen: their numbers. Raises InputError."""
    found = unestimated(machine)
    for run in chosen:
        given = {path: float(at[0]) for path, at in runs.inputs.values(runs.xi[[run]]).items()}
        (careful, verification), _ = stable(
            machine.scene.with_values(given), lambda scene: run_verified(machine.engine, scene, machine.times)
        )
        if verification is not None:
            columns = np.maximum(found.columns, _columns(verification, len(found.columns)))
            found = ModelErrors(worst([found.budget, verification.errors]), columns)
        if not careful.ok and not (nothing := _nothing(machine, runs.values))(verification):
            text = f"a more careful run rejects one: {careful.message}{nothing}"
            return replace(found, findings=[kinds.MODEL_REJECTED.found(text)])
    return found


def _columns(verification: Verification, count: int) -> Array:
    """The sum over sources of every column, (columns,)."""
    errors = by_source(verification.deviations, lambda one: one.of_markers().ravel())
    return sum(errors.values(), np.zeros(count))


@dataclass(frozen=True)
class _Nothing:
    """Errors of single runs that are negligible beside the spread of the runs.

    length [m], angle [rad]; name: of the widest coordinate
    """

    length: float
    angle: float
    name: str

    def __call__(self, estimated: Verification | None) -> bool:
        """Return whether these errors are nothing; None where the run has failed."""
        if estimated is None or estimated.rejected:
            return False
        errors = (estimated.error(source) for source in ("time", "mesh", "bending"))
        return max(errors) <= self.length and (estimated.angle_error or 0.0) <= self.angle

    def __str__(self) -> str:
        return f"; {self.length:.2g} m, {100 * NEGLIGIBLE:g} % of the width of {self.name}, would be nothing"


def _nothing(machine: ResponseModel, values: Array) -> _Nothing:
    """values: of all runs, (runs, columns)."""
    widths = np.ptp(values, axis=0).reshape(machine.columns).max(axis=0)
    coordinates = [k for k, name in enumerate(machine.quantities) if name in "xyz"]
    marker, axis = divmod(int(widths[:, coordinates].argmax()), len(coordinates))
    name = f"{list(machine.scene.markers)[marker]}.{machine.quantities[axis]}"
    angle = max(WRONG, NEGLIGIBLE * float(widths[:, -1].max()))
    return _Nothing(NEGLIGIBLE * float(widths[marker, axis]), angle, name)


CHECKED = 6
"""Extremal runs, or drawn ones, that are repeated more carefully."""


def known_errors(problem: UncertainProblem, found: ModelResponse) -> ModelErrors:
    """Return the errors of decisive runs, where they are asked for and there is time. Raises InputError."""
    if not problem.careful:
        return unestimated(problem.model)
    return model_errors(problem.model, found.runs, _decisive(found, problem.asked.seed))


def _decisive(found: ModelResponse, seed: int) -> list[int]:
    """Return the numbers of the runs that attain most bounds, or of some that were drawn."""
    runs = found.runs
    if found.bounds is None:
        drawn = np.random.default_rng(seed).choice(len(runs.xi), min(CHECKED, len(runs.xi)), False)
        return list(drawn.tolist())
    used = Counter([*runs.values.argmin(axis=0).tolist(), *runs.values.argmax(axis=0).tolist()])
    return [run for run, _ in used.most_common(CHECKED)]


def compare_meshes(problem: UncertainProblem, found: ModelResponse) -> Finer | None:
    """Return the bounds that a finer mesh moves, where a model was chosen and there is time. Raises InputError."""
    if problem.asked.tolerance is None or found.bounds is None or not problem.careful:
        return None
    return repeat_on_finer_mesh(problem.model, found.runs)
