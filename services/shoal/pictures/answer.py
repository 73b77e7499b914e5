"""An estimate with the model it came from, for pictures that look around the answer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shoal.engines import get_engine
from shoal.identification import Estimate, Problem
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import Linearisation, linearise
from shoal.identification.uncertainty.sensitivity import believed
from shoal.trajectory import Array


@dataclass(frozen=True)
class Answer:
    """An estimate and its problem. Runs around it use the native engine, also where another one was fitted."""

    problem: Problem
    estimate: Estimate

    @cached_property
    def model(self) -> ForwardModel:
        """The forward model on the scene of the answer; its runs are not counted as evaluations."""
        estimate, nominal = self.estimate, self.problem.load_scene()
        # Fields that are different in the first recording must not be carried over to the others.
        known = estimate.measurement.first.stated.known
        scene = estimate.scene.with_values({path: nominal.value(path) for path in known})
        return ForwardModel(self.problem, scene, get_engine("gauss"), estimate.measurement)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters."""
        return self.model.names

    @cached_property
    def point(self) -> Array:
        """The answer as a vector, (parameters,)."""
        return self.to_point({name: value.value for name, value in self.estimate.parameters.items()})

    def to_point(self, values: dict[str, float]) -> Array:
        """Values by name as a vector, (parameters,)."""
        return self.model.parameters.to_vector(np.array([values[name] for name in self.names]))

    @cached_property
    def linearised(self) -> Linearisation:
        """Covariance at the answer."""
        seen = believed(self.model, self.point)
        blocks = blocks_of(self.model, len(seen.residual))
        return linearise(seen.jacobian, seen.residual, self.model.sizes(self.point), blocks, seen.error)

    @cached_property
    def correlation(self) -> Array:
        """Correlations of the parameters, (parameters, parameters); nan where the data say nothing of one."""
        covariance = self.linearised.covariance
        std = np.sqrt(np.diag(covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(covariance / np.outer(std, std))

    def view(self, recording: str) -> dict[str, float]:
        """clock, delay, scale, x, y and tilt of a recording."""
        stated = self.estimate.measurement.recordings[recording].stated
        found = self.model.parameters.measurement_values(self.point[None], recording, stated)
        return {name: float(number[0]) for name, number in found.items()}
