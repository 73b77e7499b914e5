"""Result of every engine: trajectories of the markers, and the evidence for believing them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shoal.error_budget import ErrorBudget
from shoal.errors import InputError, needs_extra
from shoal.findings import Concluded, Finding, explained, worst_implied
from shoal.json_values import plain

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = npt.NDArray[np.float64]


class Status(StrEnum):
    """Status of a run at its end. Only `ok` may be believed."""

    OK = "ok"
    REFUSED = "refused"
    DIVERGED = "diverged"
    ENERGY = "energy-check-failed"
    DRIFTED = "drifted"
    OUT_OF_REACH = "out-of-reach"
    FAILED = "failed"


@dataclass(frozen=True, eq=False)
class Trajectory(Concluded):
    """Motion of one or more lanes (scenes that differ in numbers only), sampled at `times`.

    times: sampling instants [s], (samples,)
    markers: names, in the order of the scene
    points: marker positions [m], (samples, markers, d, lanes), d the dimensions of the scene, named by `axes`
    angles: direction of the body (of a cable: of its tangent) at each marker [rad],
        continuous in time, (samples, markers, lanes)
    lane_findings: what was found out about each lane, from which `status`, `message` and `advice` follow; empty where
        nothing was found out about any
    energy_drift: largest |E(t) + dissipated - E(0)| relative to the largest kinetic energy plus
        the size of the elastic one, (lanes,)
    constraint_drift: largest violation of a position constraint, relative to the machine's size, (lanes,)
    steps: time steps taken by each lane; wall_s: wall-clock time of the whole call [s], less that of compiling kernels
    model: what was computed, for the record (unknowns, elements, integrator, step, ...)
    velocities: of the markers [m/s], (samples, markers, d, lanes); rates: of the angles [rad/s],
        (samples, markers, lanes); None where the engine does not tell them
    end: the whole state at the last instant, from which `initial_from` lets a scene go on; None where it is not known,
        as of several lanes and of other engines
    words: events of contacts of each lane in the order of time, as (time [s], what and where), of runs of the native
        engine; empty of machines without contacts
    states: coordinates and rates at `times`, of runs of the native engine that were asked for them, else None
    changes: what each lane uses in place of what is stated of its start, as `model["initial_changes"]` tells it of a
        single one; empty of a single lane, and where the engine does not tell it
    """

    engine: str
    times: Array
    markers: tuple[str, ...]
    points: Array
    angles: Array
    energy_drift: Array
    constraint_drift: Array
    steps: int
    wall_s: float
    lane_findings: Sequence[Sequence[Finding]] = ()
    model: dict[str, Any] = field(default_factory=dict)
    velocities: Array | None = None
    rates: Array | None = None
    end: Mapping[str, Any] | None = None
    words: Sequence[Sequence[tuple[float, str]]] = ()
    states: Any = None
    changes: Sequence[Mapping[str, Any]] = ()

    @cached_property
    def status(self) -> tuple[Status, ...]:
        """The status of each lane, which follows from what was found out about it."""
        if not self.lane_findings:
            return (Status.OK,) * self.lanes
        return tuple(worst_implied(one, Status) if one else Status.OK for one in self.lane_findings)

    @property
    def findings(self) -> Sequence[Finding]:  # type: ignore[override]
        """The findings about the first lane that is not ok, else about the first that has any."""
        if not self.lane_findings:
            return ()
        first = next((k for k, one in enumerate(self.status) if one is not Status.OK), None)
        return next(filter(None, self.lane_findings), ()) if first is None else self.lane_findings[first]

    @property
    def axes(self) -> str:
        """Names of the components of a position, one letter each."""
        return "xyz"[: self.points.shape[2]]

    @property
    def lanes(self) -> int:
        """Number of scenes simulated side by side."""
        return int(self.points.shape[-1])

    @property
    def ok(self) -> bool:
        """Return whether every lane may be believed."""
        return not self.lane_findings or all(status is Status.OK for status in self.status)

    @property
    def errors(self) -> ErrorBudget:
        """Known errors of the markers [m]; empty where they were not estimated."""
        return ErrorBudget.from_json(self.model.get("errors"))

    def __repr__(self) -> str:
        what = f"{self.lanes} lanes" if self.lanes > 1 else str(self.status[0])
        return f"Trajectory({', '.join(self.markers)}; {len(self.times)} samples, {self.engine}, {what})"

    def reason(self, lane: int) -> str:
        """Return why a lane is not ok, and what to do; empty if it is."""
        return "" if self.status[lane] is Status.OK else explained(self.lane_findings[lane])

    def changed(self, lane: int = 0) -> Mapping[str, Any]:
        """Values of its stated start that a lane does not keep: body -> quantity -> stated, used, unit."""
        changed: Mapping[str, Any] = self.changes[lane] if self.changes else self.model.get("initial_changes", {})
        return changed

    def marker(self, name: str, lane: int = 0) -> Array:
        """Path of one marker [m], (samples, d). Raises InputError."""
        return self.points[:, self._place(name), :, lane]

    def angle(self, name: str, lane: int = 0) -> Array:
        """Direction at one marker [rad], (samples,). Raises InputError."""
        return self.angles[:, self._place(name), lane]

    def _place(self, name: str) -> int:
        """Return the number of a marker."""
        if name not in self.markers:
            raise InputError(f"marker: no marker {name!r}; there are {', '.join(self.markers)}")
        return self.markers.index(name)

    def distance(self, other: Trajectory) -> float:
        """Largest distance of a marker from where it is in another run of the same scene, over all times [m]."""
        return float(np.max(np.linalg.norm(self.points - other.points, axis=2)))

    def to_pandas(self, lane: int = 0) -> pd.DataFrame:
        """One lane as a table: index `t` [s], columns NAME.x, NAME.y [m] and NAME.angle [rad] for every marker."""
        import pandas as pd

        columns: dict[str, Array] = {}
        for name in self.markers:
            columns |= {f"{name}.{axis}": x for axis, x in zip(self.axes, self.marker(name, lane).T, strict=True)}
            columns[f"{name}.angle"] = self.angle(name, lane)
        return pd.DataFrame(columns, index=pd.Index(self.times, name="t"))

    def to_xarray(self) -> xr.Dataset:
        """All lanes: x, y [m] and angle [rad] over time [s], marker and lane. Raises InputError without xarray."""
        with needs_extra("notebook"):
            import xarray as xr
        dims = ("time", "marker", "lane")
        columns = {axis: (self.points[:, :, k], "m") for k, axis in enumerate(self.axes)}
        columns["angle"] = self.angles, "rad"
        status = ("lane", [str(status) for status in self.status])
        time = ("time", self.times, {"units": "s"})
        coordinates = {"time": time, "marker": list(self.markers), "status": status}
        return xr.Dataset({name: (dims, x, {"units": unit}) for name, (x, unit) in columns.items()}, coordinates)

    def to_json(self, lane: int = 0) -> dict[str, Any]:
        """One lane as plain data, which `shoal simulate --json` prints; null where nothing finite is known."""
        times = self.times.tolist()
        return {
            "status": str(self.status[lane]),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "engine": self.engine,
            "markers": {
                name: {
                    "t": times,
                    **{axis: plain(x) for axis, x in zip(self.axes, self.marker(name, lane).T, strict=True)},
                    "angle": plain(self.angle(name, lane)),
                }
                for name in self.markers
            },
            "final": {name: plain(self.marker(name, lane)[-1]) for name in self.markers},
            "error": plain(self.errors.total),
            "energy_drift": plain(self.energy_drift[lane]),
            "constraint_drift": plain(self.constraint_drift[lane]),
            "steps": self.steps,
            "wall_s": self.wall_s,
            "model": self.model,
            **({} if self.end is None else {"end": dict(self.end)}),
        }
