"""Result of a study: bounds with the runs that attain them, statistics, and their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.engines.starts import Elsewhere
from shoal.error_budget import GOOD, ErrorBudget, Grade
from shoal.errors import needs_extra
from shoal.findings import Concluded, Finding
from shoal.json_values import plain
from shoal.response.allocation import Allocation
from shoal.response.enclosure import Bounds, unseen
from shoal.response.event_shares import EventShares
from shoal.response.findings import ResponseStatus, status_of
from shoal.response.inputs import Inputs
from shoal.response.limits import LimitResult
from shoal.response.marginals import Interval
from shoal.response.probability_boxes import ProbabilityBoxes
from shoal.response.statistics import QUANTILES, Statistics
from shoal.response.verify import Finer
from shoal.scene import Scene
from shoal.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

FAIR = 0.1
"""Share of what varies up to which a known error of the model is small: a tenth of the width moves no bound far
(convention)."""
BOUNDS = "lower", "upper", "lower_outer", "upper_outer"


@dataclass(frozen=True, eq=False)
class Response(Concluded):
    """Response of the markers of a scene to uncertain parameters.

    findings: about the answer, the decisive first; why: what the method did; times: instants [s]; markers: names;
    horizon: up to when bounds hold [s]; bounds: None if a parameter is random; statistics: None unless all are; boxes:
    bounds of the statistics, if only some are; columns are (instants, markers, quantities) in this order; errors: of
    the markers in extremal runs [m], empty where not estimated; model: the same of every column, by which outer bounds
    and errors of statistics are wider, (columns,); stated: the scene with its model in the middle; engine: its name;
    limits: of what must not happen; allocation: tolerances that keep the limit, where they were asked for; finer: which
    bounds a finer mesh moves, where a model was asked for; controls: runs all over the box of intervals that test what
    was predicted; elsewhere: how many of the runs, those for limits among them, start elsewhere than the scene states;
    words: of events of contacts, None where all runs have the same
    """

    findings: list[Finding]
    scene: str
    method: str
    why: str
    inputs: Inputs
    times: Array
    markers: tuple[str, ...]
    quantities: tuple[str, ...]
    evaluations: int
    repeated: int
    failed: int
    seed: int
    wall_s: float
    horizon: float
    bounds: Bounds | None
    statistics: Statistics | None
    errors: ErrorBudget
    model: Array
    stated: Scene
    engine: str
    limits: tuple[LimitResult, ...] = ()
    allocation: Allocation | None = None
    boxes: ProbabilityBoxes | None = None
    finer: Finer | None = None
    controls: int = 0
    elsewhere: Elsewhere | None = None
    words: EventShares | None = None

    @property
    def status(self) -> ResponseStatus:
        """The worst status that the findings imply."""
        return status_of(self.findings)

    @property
    def mesh_error(self) -> float | None:
        """Mesh error of the markers in extremal runs [m]; None where it was not estimated."""
        return self.errors.estimates.get("mesh")

    @property
    def step_error(self) -> float | None:
        """Error of the time step, as `mesh_error`."""
        return self.errors.estimates.get("time")

    @property
    def scatter(self) -> float:
        """Widest bounds or largest standard deviation of a coordinate [m]."""
        if self.bounds is not None:
            sizes = self.bounds.upper - self.bounds.lower
        else:
            of = self.statistics if self.boxes is None else self.boxes.std
            assert of is not None
            sizes = of.std if isinstance(of, Statistics) else of.upper
        return max(float(self.column(name, axis, sizes).max()) for name in self.markers for axis in self.axes)

    @property
    def grade(self) -> Grade:
        """Grade of the known error as a share of what varies."""
        return self.errors.grade(self.ok, self.scatter * FAIR / GOOD)

    @property
    def ok(self) -> bool:
        """Return whether the answer can be believed as it stands."""
        return self.status is ResponseStatus.OK

    @property
    def unseen(self) -> float | None:
        """Share of the box that control runs may have missed with 95 % confidence; None without such runs."""
        return unseen(self.controls) if self.controls else None

    @property
    def axes(self) -> tuple[str, ...]:
        """Quantities that are coordinates [m]."""
        return tuple(name for name in self.quantities if name in "xyz")

    @property
    def random(self) -> list[str]:
        """Names of the random parameters."""
        return [one.name for one in self.inputs.parameters if one.marginal.random]

    def column(self, marker: str, quantity: str, of: Array) -> Array:
        """Return the values of one marker and quantity over time; of: (..., columns) -> (..., instants)."""
        shape = len(self.times), len(self.markers), len(self.quantities)
        whole = of.reshape(*of.shape[:-1], *shape)
        return np.asarray(whole[..., self.markers.index(marker), self.quantities.index(quantity)])

    def gaps(self, marker: str, quantity: str) -> Array:
        """Distance of outer and attained bounds, without the error of the model, as a share of the largest width over
        time, (instants,), nan where it is not known. Of intervals only.
        """
        assert self.bounds is not None
        found = {name: self.column(marker, quantity, getattr(self.bounds, name)) for name in BOUNDS}
        width = float((found["upper"] - found["lower"]).max())
        beyond = np.maximum(found["lower"] - found["lower_outer"], found["upper_outer"] - found["upper"])
        beyond = np.maximum(beyond - self.column(marker, quantity, self.model), 0.0)
        # What is not known stays so where nothing varies.
        return np.asarray(beyond / width if width > 0 else np.where(np.isfinite(beyond), 0.0, np.nan))

    def gap(self, marker: str, quantity: str) -> float:
        """The largest of `gaps` within the horizon."""
        within = self.gaps(marker, quantity)[self.times <= self.horizon]
        return float(within.max()) if within.size else math.nan

    def missed(self, gap: float) -> dict[str, float]:
        """Return the gaps larger than this by MARKER.QUANTITY, the worst first. Of intervals only."""
        entries = {f"{marker}.{name}": self.gap(marker, name) for marker in self.markers for name in self.quantities}
        return dict(sorted(((name, one) for name, one in entries.items() if one > gap), key=lambda pair: -pair[1]))

    def moved(self) -> dict[str, dict[str, Any]]:
        """Return the bound of every marker's quantity that a finer mesh moves furthest [m or rad], and when, sorted."""
        assert self.finer is not None
        found: dict[str, dict[str, Any]] = {}
        each = len(self.markers) * len(self.quantities)
        columns = np.arange(each * len(self.times))
        for k in range(each):
            most = self.finer.most(columns % each == k)
            if most is not None:
                marker, quantity = divmod(k, len(self.quantities))
                name = f"{self.markers[marker]}.{self.quantities[quantity]}.{most[2]}"
                found[name] = {"by": most[0], "t": float(self.times[most[1] // each])}
        return dict(sorted(found.items(), key=lambda pair: -abs(pair[1]["by"])))

    def table(self) -> tuple[list[str], Array]:
        """Return header and rows over time of the results of every marker, (instants, columns)."""
        entries: dict[str, Array] = {}
        if self.bounds is not None:
            entries = {name: getattr(self.bounds, name) for name in BOUNDS}
        if self.statistics is not None:
            entries = {"mean": self.statistics.mean, "std": self.statistics.std}
            entries |= {f"q{q:g}": self.statistics.quantiles[k] for k, q in enumerate(QUANTILES)}
        if self.boxes is not None:
            entries = {
                f"{name}_{side}": getattr(of, side) for name, of in self.boxes.named().items() for side in BOUNDS
            }
        header, columns = ["t"], [self.times]
        for marker in self.markers:
            for quantity in self.quantities:
                header += [f"{marker}.{quantity}.{name}" for name in entries]
                columns += [self.column(marker, quantity, of) for of in entries.values()]
        return header, np.column_stack(columns)

    def to_xarray(self) -> xr.Dataset:
        """Bounds, or statistics, over time [s], marker and axis (x, y [m] and angle [rad], or x, y, z).

        Raises InputError.

        lower, upper over bound (attained, outer); argument_lower, argument_upper over parameter; mean, std, quantiles
        over quantile; first and total Sobol indices over parameter. With intervals and distributions: mean_lower,
        mean_upper, std_..., quantiles_... over bound (inner, outer), and their arguments over interval; first_lower to
        total_upper over random (parameters).
        """
        with needs_extra("notebook"):
            import xarray as xr
        shape = len(self.times), len(self.markers), len(self.quantities)
        base = ("time", "marker", "axis")
        variables: dict[str, tuple[tuple[str, ...], Array]] = {}

        def put(name: str, of: Array, *more: str) -> None:
            """of: (..., columns)."""
            whole = of.reshape(*of.shape[:-1], *shape)
            variables[name] = (*base, *more), np.moveaxis(whole, range(len(more)), range(-len(more), 0))

        coordinates: dict[str, Any] = {
            "time": ("time", self.times, {"units": "s"}),
            "marker": list(self.markers),
            "axis": list(self.quantities),
            "parameter": self.inputs.names,
        }
        if self.bounds is not None:
            coordinates["bound"] = ["attained", "outer"]
            put("lower", np.stack([self.bounds.lower, self.bounds.lower_outer]), "bound")
            put("upper", np.stack([self.bounds.upper, self.bounds.upper_outer]), "bound")
            put("argument_lower", self.bounds.at_lower.T, "parameter")
            put("argument_upper", self.bounds.at_upper.T, "parameter")
        if self.statistics is not None:
            coordinates["quantile"] = np.array(QUANTILES)
            put("mean", self.statistics.mean)
            put("std", self.statistics.std)
            put("quantiles", self.statistics.quantiles, "quantile")
            put("first", self.statistics.first, "parameter")
            put("total", self.statistics.total, "parameter")
        if self.boxes is not None:
            coordinates |= {"quantile": np.array(QUANTILES), "bound": ["inner", "outer"]}
            coordinates["interval"] = list(self.boxes.names)
            for side in ("lower", "upper"):
                for name, of in (("mean", self.boxes.mean), ("std", self.boxes.std)):
                    put(f"{name}_{side}", np.stack([getattr(of, side), getattr(of, f"{side}_outer")]), "bound")
                    put(f"argument_{name}_{side}", getattr(of, f"at_{side}").T, "interval")
                both = [[getattr(of, side), getattr(of, f"{side}_outer")] for of in self.boxes.quantiles]
                put(f"quantiles_{side}", np.array(both), "quantile", "bound")
                at = np.array([getattr(of, f"at_{side}").T for of in self.boxes.quantiles])
                put(f"argument_quantiles_{side}", at, "quantile", "interval")
            if self.boxes.shares is not None:
                coordinates["random"] = self.random
                for index, sides in zip(("first", "total"), self.boxes.shares, strict=True):
                    put(f"{index}_lower", sides[0], "random")
                    put(f"{index}_upper", sides[1], "random")
        about = {"scene": self.scene, "status": self.status, "method": self.method, "why": self.why}
        about |= {"findings": ", ".join(self.codes)}
        numbers = {"horizon": self.horizon, "evaluations": self.evaluations, "seed": self.seed}
        if self.unseen is not None:
            numbers["unseen"] = self.unseen
        return xr.Dataset(variables, coordinates, {**about, **numbers})

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal uncertain --json` prints."""
        return {
            "status": self.status,
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "scene": self.scene,
            "method": self.method,
            "why": self.why,
            "evaluations": self.evaluations,
            "repeated": self.repeated,
            "failed": self.failed,
            "controls": self.controls,
            "unseen": self.unseen,
            "seed": self.seed,
            "wall_s": self.wall_s,
            "horizon": plain(self.horizon),
            "gap": None if (bounded := self.bounds or self.boxes) is None else plain(bounded.gap),
            **({} if self.boxes is None else {"std_gap": plain(self.boxes.std_gap)}),
            "parameters": self._parameters(),
            "left_out": {name: why for joint in self.inputs.joints for name, why in joint.left.items()},
            "bounds": {} if self.bounds is None else self._by_marker(self._bounds),
            "statistics": self._all_statistics(),
            "mesh_error": plain(self.mesh_error),
            "step_error": plain(self.step_error),
            "error": plain(self.errors.total),
            "errors": plain(self.errors.to_json()),
            "finer_mesh": None if self.finer is None else {**self.finer.to_json(), "moved": self.moved()},
            "limits": [one.to_json() for one in self.limits],
            "allocation": None if self.allocation is None else self.allocation.to_json(),
            **({} if self.words is None else {"events": [one.to_json() for one in self.words.words]}),
            "starts": None if self.elsewhere is None else self.elsewhere.to_json(),
        }

    def _parameters(self) -> dict[str, Any]:
        described: dict[str, dict[str, Any]] = {}
        for one in self.inputs.parameters:
            kind = "distribution" if one.marginal.random else "interval"
            described[one.name] = {"kind": kind, "known": one.marginal.text, "paths": dict(one.factors)}
            if isinstance(one.marginal, Interval):
                described[one.name] |= {"low": one.marginal.low, "high": one.marginal.high}
        return described

    def _all_statistics(self) -> dict[str, Any]:
        if self.boxes is not None:
            return self._by_marker(self._boxes)
        return {} if self.statistics is None else self._by_marker(self._statistics)

    def _by_marker(self, entries: Any) -> dict[str, Any]:
        return {marker: {name: entries(marker, name) for name in self.quantities} for marker in self.markers}

    def _listed(self, marker: str, quantity: str, of: Array) -> Any:
        return plain(self.column(marker, quantity, of))

    def _arguments(self, marker: str, quantity: str, of: Array) -> Any:
        """Return values of parameters at an extreme over time; of: (columns, parameters)."""
        return plain(self.column(marker, quantity, of.T).T)

    def _bounds(self, marker: str, quantity: str) -> dict[str, Any]:
        found, at = self.bounds, partial(self._listed, marker, quantity)
        assert found is not None
        return {
            "t": plain(self.times),
            **{name: at(getattr(found, name)) for name in BOUNDS},
            "error": at(self.model),
            "gap": plain(self.gap(marker, quantity)),
            "argument_lower": self._arguments(marker, quantity, found.at_lower),
            "argument_upper": self._arguments(marker, quantity, found.at_upper),
            **(
                {} if self.finer is None else {"lower_moved": at(self.finer.lower), "upper_moved": at(self.finer.upper)}
            ),
            **({} if found.likely is None else {"lower_95": at(found.likely[0]), "upper_95": at(found.likely[1])}),
        }

    def _boxes(self, marker: str, quantity: str) -> dict[str, Any]:
        """Numbers over time, of quantiles for each level; arguments are values of `intervals`, in their order."""
        found, at = self.boxes, partial(self._listed, marker, quantity)
        assert found is not None
        entries: dict[str, Any] = {"t": plain(self.times), "intervals": list(found.names)}
        for side in ("lower", "upper"):
            for name, of in (("mean", found.mean), ("std", found.std)):
                entries[f"{name}_{side}"] = at(getattr(of, side))
                entries[f"{name}_{side}_outer"] = at(getattr(of, f"{side}_outer"))
                entries[f"argument_{name}_{side}"] = self._arguments(marker, quantity, getattr(of, f"at_{side}"))
            levels = [f"{q:g}" for q in QUANTILES]
            for name, key in ((f"quantiles_{side}", side), (f"quantiles_{side}_outer", f"{side}_outer")):
                entries[name] = {q: at(getattr(of, key)) for q, of in zip(levels, found.quantiles, strict=True)}
            entries[f"argument_quantiles_{side}"] = {
                q: self._arguments(marker, quantity, getattr(of, f"at_{side}"))
                for q, of in zip(levels, found.quantiles, strict=True)
            }
        if found.shares is not None:
            entries["sobol"] = {
                name: {
                    f"{index}_{side}": at(found.shares[i, j, k])
                    for i, index in enumerate(("first", "total"))
                    for j, side in enumerate(("lower", "upper"))
                }
                for k, name in enumerate(self.random)
            }
        return entries

    def _statistics(self, marker: str, quantity: str) -> dict[str, Any]:
        found, at = self.statistics, partial(self._listed, marker, quantity)
        assert found is not None
        return {
            "t": plain(self.times),
            "mean": at(found.mean),
            "std": at(found.std),
            "mean_error": at(found.error),
            "std_error": at(found.std_error),
            "quantiles": {f"{q:g}": at(found.quantiles[k]) for k, q in enumerate(QUANTILES)},
            "sobol": {
                name: {"first": at(found.first[k]), "total": at(found.total[k])}
                for k, name in enumerate(self.inputs.names)
            },
        }
