"""A scene over a grid of values: where its markers are at one instant (the paper's Figure 4)."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.arguments import check, mapping, numbers
from shoal.engines.contract import Engine, sampling_times
from shoal.engines.starts import Elsewhere, StatedStart
from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.json_values import plain
from shoal.scene import Scene
from shoal.trajectory import Array, Status, Trajectory

if TYPE_CHECKING:
    import pandas as pd

LONE = 4
"""So many of the points that failed are tried alone."""


@dataclass(frozen=True)
class SpotCheck:
    """Largest estimated errors at the markers [m], by source, among the points that were looked at.

    complaint: the first point that a more careful run does not bear out, and why
    """

    looked_at: int
    points: int
    errors: ErrorBudget = field(default_factory=ErrorBudget)
    complaint: str = ""

    def __str__(self) -> str:
        return f"estimated error at the markers, largest of {self.looked_at} points: {self.errors}"

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        by_source = {f"{source}_error": self.errors.estimates.get(source) for source in ("time", "mesh")}
        by_source |= {f"{source}_error": error for source, error in self.errors.estimates.items()}
        counted = {"looked_at": self.looked_at, "points": self.points, "complaint": self.complaint}
        return dict(plain({**counted, **by_source, "errors": self.errors.to_json()}))


@dataclass(frozen=True, eq=False)
class Sweep:
    """Marker positions and displacements from the start at `time` [s] over a grid.

    grid: path -> value of every point, (points,); positions, displacements [m]: marker -> (points, 2), not a number
    where a point is not ok; check: by more careful runs of some points, None without
    reasons: why each point is not ok, empty for one that is; changes: values that each point uses in place of
    stated ones of its start, see `Trajectory.changed`; stated: those that count
    """

    scene: Scene
    engine: str
    time: float
    grid: dict[str, Array]
    positions: dict[str, Array]
    displacements: dict[str, Array]
    status: tuple[Status, ...]
    wall_s: float
    check: SpotCheck | None = None
    reasons: tuple[str, ...] = ()
    changes: tuple[Mapping[str, Any], ...] = ()
    stated: StatedStart = field(default_factory=StatedStart)

    @property
    def ok(self) -> bool:
        """Return whether every point may be believed."""
        return not self.complaint

    @property
    def complaint(self) -> str:
        """Return why parts of it are rejected; empty if none are."""
        wrong = [status for status in self.status if status is not Status.OK]
        if wrong:
            why = next(filter(None, self.reasons), "")
            told = f"{len(wrong)} of {len(self.status)} points: {', '.join(sorted(set(wrong)))}"
            return f"{told}; the first: {why}" if why else told
        return self.check.complaint if self.check is not None else ""

    @property
    def message(self) -> str:
        """Return why parts of it are rejected, and whether points start elsewhere than stated; empty if neither."""
        return "; ".join(filter(None, (self.complaint, self.elsewhere.describe("points"))))

    @property
    def errors(self) -> ErrorBudget:
        """Return the errors of the markers [m], the largest of the checked points; empty without checks."""
        return ErrorBudget() if self.check is None else self.check.errors

    @property
    def elsewhere(self) -> Elsewhere:
        """Summarise the accepted points that start elsewhere than stated."""
        good = (one for one, status in zip(self.changes, self.status, strict=False) if status is Status.OK)
        away = [self.stated.away(one) for one in good]
        return self.stated.elsewhere(np.reshape(away, (len(away), len(self.stated.values))))

    @cached_property
    def begun(self) -> dict[str, tuple[Array, str]]:
        """Return the starts of points that do not keep a stated value: name -> values (points,), NaN at others; unit.

        Names are `start.BODY.QUANTITY`, of vectors one for each component.
        """
        found: dict[str, tuple[Array, str]] = {}
        for point, changed in enumerate(self.changes):
            if self.status[point] is not Status.OK:
                continue
            for (body, quantity), change in self.stated.given_way(changed).items():
                used = np.atleast_1d(change["used"])
                ends = [""] if used.size == 1 else [f".{axis}" for axis in "xyz"[: used.size]]
                for end, value in zip(ends, used, strict=True):
                    name = f"start.{body}.{quantity}{end}"
                    column, _ = found.setdefault(name, (np.full(len(self.status), np.nan), change["unit"]))
                    column[point] = value
        return found

    def rows(self) -> list[dict[str, Any]]:
        """The table: one row a point, with the values, positions, displacements and status.

        Where some points start elsewhere than stated it says where (`begun`), where some are not ok it has the reason.
        """
        table = []
        for k, status in enumerate(self.status):
            row: dict[str, Any] = {path: float(values[k]) for path, values in self.grid.items()}
            for marker, positions in self.positions.items():
                moved = self.displacements[marker]
                for prefix, vectors in (("", positions), ("d", moved)):
                    row |= {f"{marker}.{prefix}{axis}": part for axis, part in zip("xyz", vectors[k], strict=False)}
            row |= {name: values[k] for name, (values, _) in self.begun.items()}
            why = {"reason": self.reasons[k]} if any(self.reasons) else {}
            table.append(plain({**row, "status": str(status), **why}))
        return table

    def to_pandas(self) -> pd.DataFrame:
        """The same as a table."""
        import pandas as pd

        return pd.DataFrame(self.rows())

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal sweep --json` prints."""
        return {
            "status": "ok" if self.ok else "failed",
            "message": self.message,
            "scene": self.scene.name,
            "engine": self.engine,
            "time": self.time,
            "rows": self.rows(),
            "error": self.errors.total,
            "verification": None if self.check is None else self.check.to_json(),
            "starts": self.elsewhere.to_json(),
            "wall_s": self.wall_s,
        }


def sweep(
    scene: Scene, vary: Mapping[str, Sequence[float] | Array], engine: Engine, time: float | None = None
) -> Sweep:
    """Simulate the full grid of the values in `vary` (path -> values). Raises InputError."""
    check(time=time)
    fields = mapping("vary", vary, "fields with their values")
    vary = {path: numbers(f"vary: {path}", axis) for path, axis in fields.items()}
    (instant,) = sampling_times(scene, [scene.solver.duration if time is None else time]).tolist()
    axes = np.meshgrid(*vary.values(), indexing="ij")
    grid = {path: axis.ravel() for path, axis in zip(vary, axes, strict=True)}
    # Time zero as a second instant gives the start, from which displacements count.
    times = np.array([0.0, instant]) if instant > 0 else np.array([0.0])
    trajectory = _gone_on(engine, scene, grid, engine.simulate_many(scene, grid, times))
    good = np.array([one is Status.OK for one in trajectory.status])
    points = np.where(good, trajectory.points, np.nan)
    positions = {name: points[-1, k].T for k, name in enumerate(trajectory.markers)}
    return Sweep(
        scene,
        trajectory.engine,
        instant,
        grid,
        positions,
        {name: positions[name] - points[0, k].T for k, name in enumerate(trajectory.markers)},
        trajectory.status,
        trajectory.wall_s,
        reasons=() if trajectory.ok else tuple(map(trajectory.reason, range(trajectory.lanes))),
        changes=tuple(trajectory.changes),
        stated=StatedStart.of(scene, grid),
    )


def _gone_on(engine: Engine, scene: Scene, grid: Mapping[str, Array], found: Trajectory) -> Trajectory:
    """Points that failed side by side go on as a scene alone does: one finds the settings, the others take them."""
    from shoal.engines.ways import as_run

    started, lanes = time.perf_counter(), found.lanes
    points, findings = found.points.copy(), list(found.lane_findings or [()] * lanes)
    changes = [found.changed(k) for k in range(lanes)]

    def take(run: Trajectory, places: Iterable[int]) -> None:
        for lane, place in enumerate(places):
            points[..., place], changes[place] = run.points[..., lane], run.changed(lane)
            findings[place] = run.lane_findings[lane] if run.lane_findings else ()

    left = np.flatnonzero([one is not Status.OK for one in found.status])
    for _ in range(LONE):
        if scene.solver.integrator != "auto" or not left.size:
            break
        (first, *_), left = left, left[1:]
        values = {path: float(at[first]) for path, at in grid.items()}
        try:
            alone = engine.simulate(scene.with_values(values), found.times)
        except InputError as error:
            # The refusal of the scene alone names the field.
            findings[first] = [replace(one, text=str(error), steps=()) for one in findings[first][:1]]
            continue
        take(alone, [int(first)])
        if left.size and alone.ok:
            run = engine.simulate_many(as_run(scene, alone), {path: at[left] for path, at in grid.items()}, found.times)
            take(run, left.tolist())
            left = left[[one is not Status.OK for one in run.status]]
    wall_s = found.wall_s + time.perf_counter() - started
    return replace(found, points=points, lane_findings=findings, wall_s=wall_s, changes=tuple(changes))


_PIECES = 4
"""Pieces of a grid for each worker."""
_SMALLEST = 64
"""Points below which a piece is not worth its message."""


def pieces(vary: Mapping[str, Array], workers: int) -> list[dict[str, Array]]:
    """A grid (path -> values) cut along its first axis so that no worker waits long for another."""
    first, *others = vary
    points = int(np.prod([values.size for values in vary.values()]))
    count = min(vary[first].size, _PIECES * workers, -(-points // _SMALLEST))
    return [{first: part, **{path: vary[path] for path in others}} for part in np.array_split(vary[first], count)]


def joined(parts: Sequence[Sweep]) -> Sweep:
    """The pieces of a grid, in their order, as the whole; the time is the sum."""
    return replace(
        parts[0],
        grid=_stacked([part.grid for part in parts]),
        positions=_stacked([part.positions for part in parts]),
        displacements=_stacked([part.displacements for part in parts]),
        status=tuple(status for part in parts for status in part.status),
        wall_s=sum(part.wall_s for part in parts),
    )


def _stacked(columns: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([column[name] for column in columns]) for name in columns[0]}
