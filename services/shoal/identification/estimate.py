"""An answer as a labelled data set: parameters with their covariance, and one recording with its fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.errors import InputError, needs_extra
from shoal.findings import Concluded, Finding
from shoal.identification.diagnostics.hypotheses import Hypothesis
from shoal.identification.diagnostics.residual_tests import ResidualTests
from shoal.identification.diagnostics.suspects import Suspect
from shoal.identification.findings import Verdict, verdict_of
from shoal.identification.recording.measurement import Measurement, Recording
from shoal.identification.recording.units import of_channel, squared
from shoal.identification.uncertainty.bootstrap import Bootstrap
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.posterior import Posterior
from shoal.identification.uncertainty.prediction import Prediction
from shoal.identification.uncertainty.profiles import Profile
from shoal.json_values import plain
from shoal.scene import Scene
from shoal.trajectory import Array

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def dataset(
    parameters: Mapping[str, Value], covariance: Array | None, recording: Recording, predicted: Array
) -> xr.Dataset:
    """Over `parameter`: value, std, lower, upper, identifiable, covariance; over `time` and `marker`: of each quantity
    of the recording measured_x, predicted_x, residual_x (model minus measurement) and so on.

    predicted: channels of the model at the recording's samples, (samples, channels)
    A gap in the data is nan, and so is a quantity that a marker was not measured in. Units are in the attributes; those
    of the parameters, which differ, are a coordinate. Raises InputError.
    """
    with needs_extra("notebook"):
        import xarray as xr
    return xr.merge([_parameters(parameters, covariance), _signals(recording, predicted)])


def _parameters(values: Mapping[str, Value], covariance: Array | None) -> xr.Dataset:
    import xarray as xr

    units = [value.unit for value in values.values()]
    # Where all share a unit, it is that of the variables too.
    shared = {"units": units[0]} if len(set(units)) == 1 and units[0] else {}
    fields = ("value", "std", "lower", "upper")
    columns: dict[str, Any] = {
        field: ("parameter", [getattr(value, field) for value in values.values()], shared) for field in fields
    }
    columns["identifiable"] = ("parameter", [value.identifiable for value in values.values()])
    if covariance is not None:
        units_of_it = {"units": squared(shared["units"])} if shared else {}
        columns["covariance"] = (("parameter", "other_parameter"), covariance, units_of_it)
    names = list(values)
    return xr.Dataset(columns, {"parameter": names, "other_parameter": names, "unit": ("parameter", units)})


def _signals(recording: Recording, predicted: Array) -> xr.Dataset:
    import xarray as xr

    markers = list(dict.fromkeys(channel.place for channel in recording.channels))
    shape = (len(recording.times), len(markers))
    columns: dict[str, Any] = {}
    for k, channel in enumerate(recording.channels):
        measured, fitted = recording.values[:, k], predicted[:, k]
        parts = {"measured": measured, "predicted": fitted, "residual": fitted - measured}
        for part, signal in parts.items():
            empty = (("time", "marker"), np.full(shape, np.nan), {"units": of_channel(channel)})
            columns.setdefault(f"{part}_{channel.kind}", empty)[1][:, markers.index(channel.place)] = signal
    return xr.Dataset(columns, {"time": ("time", recording.times, {"units": "s"}), "marker": markers})


@dataclass(frozen=True, eq=False)
class Estimate(Concluded):
    """Result of an identification. fitness: mean squared deviation; rms: per observed thing (position or angle).

    history: evaluations and the best fitness after them; iterations: (iteration, best, mean fitness)
    evaluations: simulations; work: simulated time over that of one run of all recordings
    choice: which method was taken, and why; notes: what was found and mended in the recordings
    findings: what was found out about the answer, the decisive first
    suspects: what was taken as known and would explain a misfit if it were freed
    hypotheses: tests of all that was taken as known, the most significant first, then the other minima
    minima: others that were found, by their parameters, the best first
    sensitivity_doubt: relative difference of derivatives by two step sizes
    profiles, bootstrap, posterior: where wished for
    scenes: the identified machine, by recording; predicted: its channels at the samples of each recording
    covariance: of the parameters, in the products of their units, (parameters, parameters)
    values: the fields of the scene that were found, by path, ties evaluated; left_out: what is not among them, and why
    prediction: of the windows that were held out; joint: see `carried.joint`
    """

    problem: str
    method: str
    engine: str
    seed: int
    findings: list[Finding]
    choice: str
    parameters: dict[str, Value]
    quantities: dict[str, Value]
    combinations: list[str]
    fitness: float
    rms: float
    evaluations: int
    work: float
    placements: int
    wall_s: float
    history: tuple[Array, Array]
    iterations: list[tuple[int, float, float]]
    minima: list[dict[str, float]]
    residual_autocorrelation: float
    residual_tests: ResidualTests
    suspects: list[Suspect]
    profiles: dict[str, Profile]
    bootstrap: Bootstrap | None
    posterior: Posterior | None
    sensitivity_doubt: float
    model_error_rms: float | None
    truth: dict[str, float]
    data: str
    notes: list[str]
    model: dict[str, Any]
    scenes: dict[str, Scene]
    predicted: dict[str, Array]
    measurement: Measurement
    covariance: Array | None = None
    theory_error_rms: float | None = None
    values: dict[str, float] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    prediction: list[Prediction] = field(default_factory=list)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    joint: dict[str, Any] = field(default_factory=dict)

    @property
    def scene(self) -> Scene:
        """The identified machine, in the first recording."""
        return next(iter(self.scenes.values()))

    @property
    def verdict(self) -> Verdict:
        """The worst verdict that its findings imply."""
        return verdict_of(self.findings)

    @property
    def status(self) -> str:
        """`ok` if the answer can be used, else `failed`."""
        return "ok" if self.verdict.trusted else "failed"

    def known(self, value: Value) -> str:
        """Return whether a value is known, in a word: of a rejected or failed answer none is."""
        if value.at_bound:
            return "at bound"
        return "yes" if value.identifiable and (self.verdict.trusted or self.verdict is Verdict.AMBIGUOUS) else "no"

    def __repr__(self) -> str:
        values = ", ".join(
            f"{name} {value.value:.6g}" + (f" ± {value.std:.2g}" if self.known(value) == "yes" else " (not known)")
            for name, value in self.parameters.items()
        )
        return f"Estimate({self.problem}: {self.verdict}; {values})"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each parameter and quantity: value, std, lower, upper (nan if open), identifiable, ..."""
        import pandas as pd

        rows = {name: vars(value) for name, value in {**self.parameters, **self.quantities}.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    def to_xarray(self, recording: str | None = None) -> xr.Dataset:
        """Parameters, their covariance, and data, model and residual of a recording (else the first), with units.

        Raises InputError without xarray, and for a recording that there is not.
        """
        known = self.measurement.recordings
        name = next(iter(known)) if recording is None else recording
        if name not in known:
            raise InputError(f"recording: there is no {name!r}; there are {', '.join(known)}")
        attributes = {"problem": self.problem, "recording": name, "verdict": str(self.verdict)}
        attributes |= {"method": self.method, "engine": self.engine}
        return dataset(self.parameters, self.covariance, known[name], self.predicted[name]).assign_attrs(attributes)

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal identify --json` prints."""

        def values(table: dict[str, Value]) -> dict[str, Any]:
            return {name: plain(vars(value)) for name, value in table.items()}

        return {
            "status": self.status,
            "verdict": str(self.verdict),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "problem": self.problem,
            "method": self.method,
            "engine": self.engine,
            "seed": self.seed,
            "parameters": {**values(self.parameters), **values(self.quantities)},
            "values": plain(self.values),
            "left_out": self.left_out,
            "joint": self.joint,
            "prediction": [one.to_json() for one in self.prediction],
            "combinations": self.combinations,
            "fitness": plain(self.fitness),
            "rms": plain(self.rms),
            "choice": self.choice,
            "evaluations": self.evaluations,
            "work": plain(self.work),
            "placements": self.placements,
            "wall_s": self.wall_s,
            "minima": plain(self.minima),
            "residual_autocorrelation": plain(self.residual_autocorrelation),
            "residual_tests": self.residual_tests.to_json(),
            "suspects": [plain(vars(suspect)) for suspect in self.suspects],
            "hypotheses": [plain(vars(one)) for one in self.hypotheses],
            "profiles": {name: found.to_json() for name, found in self.profiles.items()},
            "bootstrap": None if self.bootstrap is None else self.bootstrap.to_json(),
            "posterior": None if self.posterior is None else self.posterior.to_json(),
            "sensitivity_doubt": plain(self.sensitivity_doubt),
            "model_error_rms": plain(self.model_error_rms),
            "theory_error_rms": plain(self.theory_error_rms),
            "truth": self.truth,
            "data": self.data,
            "notes": self.notes,
            "iterations": plain([list(row) for row in self.iterations]),
            "model": self.model,
        }
