"""Stability map: a machine, two axes, methods, and the class of the run in every cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from shoal.engines.contract import Engine
from shoal.engines.verification import verify
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.trajectory import Array, Status, Trajectory

from shoal_validation.judge import Outcome, judge


@dataclass(frozen=True)
class Axis:
    """One axis of a map: its name, its unit (empty for a pure number) and the values, numbers or names."""

    name: str
    unit: str
    values: tuple[Any, ...]

    @property
    def title(self) -> str:
        """Name and unit, as a chart's axis says them."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def labels(self) -> list[str]:
        """The values as text."""
        return [value if isinstance(value, str) else f"{value:g}" for value in self.values]

    def thinned(self) -> Axis:
        """First, middle and last of the values."""
        last = len(self.values) - 1
        return replace(self, values=tuple(self.values[k] for k in sorted({0, last // 2, last})))


@dataclass(frozen=True)
class Method:
    """One panel of a map: an engine with the fields of the scene that choose the method.

    checked: whether the engine's wrapper judges the run; where not, only what the engine says itself counts.
    """

    name: str
    engine: Engine
    changes: dict[str, object] = field(default_factory=dict)
    checked: bool = True

    @property
    def ours(self) -> bool:
        """Return whether Shoal's own solver runs."""
        return self.engine.name == "gauss"


@dataclass(frozen=True)
class Watched:
    """One machine whose motion is known.

    scene, fields: a scene of the library and what of it the cell changes, by path; marker: which one is watched; times:
    sampling instants [s], (times,); points: where it is [m], (times, 2); size: how far it can be from its bearing [m];
    accuracy: error over size up to which a run holds; left: whether a run has left the branch of the motion.
    """

    scene: Scene
    fields: dict[str, object]
    marker: str
    times: Array
    points: Array
    size: float
    accuracy: float = 1e-3
    left: Callable[[Trajectory], bool] = lambda _: False


@dataclass(frozen=True)
class Cell:
    """One run. error: largest distance from the reference over all times [m]; branch: whether it left its branch.

    settings: the fields of the scene that reproduce it, as `--set` takes them.
    """

    x: Any
    y: Any
    outcome: Outcome
    status: str
    error: float
    energy_drift: float
    constraint_drift: float
    steps: int
    branch: bool
    message: str
    scene: str
    settings: dict[str, object]


@dataclass(frozen=True)
class StabilityMap:
    """One question and the grid of runs that answers it.

    teaches: what a reader should take from it, in a sentence or two; watched: the machine of a cell (x, y); solver: the
    fields of the solver that the cell sets beside the method's.
    """

    name: str
    question: str
    teaches: str
    x: Axis
    y: Axis
    methods: tuple[Method, ...]
    watched: Callable[[Any, Any], Watched]
    solver: Callable[[Any, Any], dict[str, object]]

    def cell(self, method: Method, x: Any, y: Any) -> Cell:
        """Run and judge one cell."""
        machine = self.watched(x, y)
        end = {"solver.duration": float(machine.times[-1])}
        settings = {**end, **machine.fields, **self.solver(x, y), **method.changes}
        engine: Any = method.engine
        try:
            scene = machine.scene.with_values(settings)
            run = simulated(engine, scene.model_dump_json(), machine.times.tobytes())
        except InputError as refusal:
            return _refused(machine, settings, x, y, str(refusal))
        error = float(np.max(np.linalg.norm(run.marker(machine.marker) - machine.points, axis=1)))
        if method.checked and run.ok and error > machine.accuracy * machine.size:
            run = checked(run, scene)
        status = run.status[0] if method.checked else said(run)
        return Cell(
            x,
            y,
            judge(status, error, machine.size, machine.accuracy),
            str(status),
            error,
            float(run.energy_drift[0]),
            float(run.constraint_drift[0]),
            run.steps,
            bool(np.isfinite(error)) and machine.left(run),
            run.message if method.checked else "",
            machine.scene.name,
            settings,
        )

    def reduced(self) -> StabilityMap:
        """The same question on three values of each axis."""
        return replace(self, x=self.x.thinned(), y=self.y.thinned())


@lru_cache(maxsize=512)
def simulated(engine: Any, scene_json: str, times: bytes) -> Trajectory:
    """The run of one cell; a checked and an unchecked panel share it. Raises InputError."""
    run: Trajectory = engine.simulate(Scene.model_validate_json(scene_json), np.frombuffer(times))
    return run


def checked(run: Trajectory, scene: Scene) -> Trajectory:
    """The run as `shoal simulate` reports it, after a second and more careful one; only asked where it is off."""
    findings = verify(run, scene).findings
    return replace(run, lane_findings=[findings]) if any(one.kind.implies for one in findings) else run


def said(run: Trajectory) -> Status:
    """Message of the engine on a run: that it failed, or none, where its numbers are plainly not finite."""
    if run.status[0] is Status.FAILED:
        return Status.FAILED
    return Status.OK if np.all(np.isfinite(run.points)) else Status.DIVERGED


def _refused(machine: Watched, settings: dict[str, object], x: Any, y: Any, why: str) -> Cell:
    nan = float("nan")
    status = str(Status.REFUSED)
    return Cell(x, y, Outcome.REFUSED, status, nan, nan, nan, 0, False, why, machine.scene.name, settings)


@dataclass(frozen=True)
class Panel:
    """All cells of one method, row by row of y."""

    method: str
    ours: bool
    checked: bool
    cells: tuple[Cell, ...]

    @property
    def count(self) -> Counter[Outcome]:
        """Number of cells of each class."""
        return Counter(cell.outcome for cell in self.cells)
