"""The answer: values with honest intervals, what is identifiable, and a verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.identification.bootstrap import Bootstrap
from shoal.identification.measurement import Measurement
from shoal.identification.profiles import Profile
from shoal.identification.residual_tests import ResidualTests
from shoal.identification.suspects import Suspect
from shoal.scene import Scene
from shoal.trajectory import Array, plain

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Verdict(StrEnum):
    """What may be made of an estimate. Only the first two are answers."""

    IDENTIFIED = "identified"
    COMBINATION = "identified up to a combination"
    AMBIGUOUS = "ambiguous"
    REJECTED = "model rejected"
    UNFINISHED = "not at a minimum"
    FAILED = "failed"

    @property
    def trusted(self) -> bool:
        """Whether the answer can be used."""
        return self in (Verdict.IDENTIFIED, Verdict.COMBINATION)


@dataclass(frozen=True)
class Value:
    """An estimated number: its standard deviation, and a 95 % interval (Student's t) with the model's own error in it.

    correction: what a mesh twice as fine would add to the value, None if not computed; it is not added, but is in
    the interval
    theory: what shear and rotary inertia would add where slender beams neglect them; likewise
    unit: of all of them, empty where there is none or none is known
    """

    value: float
    std: float
    lower: float
    upper: float
    identifiable: bool
    correction: float | None = None
    at_bound: bool = False
    unit: str = ""
    theory: float | None = None

    def exponential(self) -> Value:
        """The value of a parameter that was sought by its logarithm."""
        value = float(np.exp(self.value))
        correction = None if self.correction is None else value * self.correction
        with np.errstate(over="ignore"):
            lower, upper = float(np.exp(self.lower)), float(np.exp(self.upper))
        theory = None if self.theory is None else value * self.theory
        return replace(
            self, value=value, std=value * self.std, lower=lower, upper=upper, correction=correction, theory=theory
        )


@dataclass(frozen=True)
class Estimate:
    """Result of an identification. fitness: mean squared deviation; rms: per observed thing (position or angle).

    history: evaluations and the best fitness after them; iterations: (iteration, best, mean fitness)
    evaluations: simulations; work: simulated time over that of one run of all recordings
    choice: which method was taken, and why; notes: what was found and mended in the recordings
    advice: what to do next; suspects: properties of the measurement that would explain the misfit
    sensitivity_doubt: relative difference of derivatives by two step sizes; profiles, bootstrap: where wished for
    scenes: the identified machine, by recording; predicted: its channels at the samples of each recording
    covariance: of the parameters, in the products of their units, (parameters, parameters)
    """

    problem: str
    method: str
    engine: str
    seed: int
    verdict: Verdict
    message: str
    advice: list[str]
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

    @property
    def scene(self) -> Scene:
        """The identified machine, in the first recording."""
        return next(iter(self.scenes.values()))

    @property
    def status(self) -> str:
        """`ok` if the answer can be used, else `failed`."""
        return "ok" if self.verdict.trusted else "failed"

    def __repr__(self) -> str:
        values = ", ".join(f"{name} {value.value:.6g} ± {value.std:.2g}" for name, value in self.parameters.items())
        return f"Estimate({self.problem}: {self.verdict}; {values})"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each parameter and quantity: value, std, lower, upper, identifiable, ..."""
        import pandas as pd

        rows = {name: vars(value) for name, value in {**self.parameters, **self.quantities}.items()}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")

    def to_xarray(self, recording: str | None = None) -> xr.Dataset:
        """Parameters, their covariance, and data, model and residual of a recording (else the first), with units.

        Raises InputError without xarray, and for a recording that there is not.
        """
        from shoal.identification.dataset import dataset

        return dataset(self, recording)

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal identify --json` prints."""

        def values(table: dict[str, Value]) -> dict[str, Any]:
            return {name: plain(vars(value)) for name, value in table.items()}

        return {
            "status": self.status,
            "verdict": str(self.verdict),
            "message": self.message,
            "advice": self.advice,
            "problem": self.problem,
            "method": self.method,
            "engine": self.engine,
            "seed": self.seed,
            "parameters": {**values(self.parameters), **values(self.quantities)},
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
            "profiles": {name: found.to_json() for name, found in self.profiles.items()},
            "bootstrap": None if self.bootstrap is None else self.bootstrap.to_json(),
            "sensitivity_doubt": plain(self.sensitivity_doubt),
            "model_error_rms": plain(self.model_error_rms),
            "theory_error_rms": plain(self.theory_error_rms),
            "truth": self.truth,
            "data": self.data,
            "notes": self.notes,
            "iterations": plain([list(row) for row in self.iterations]),
            "model": self.model,
        }
