"""The forward model of a problem: parameters in, residuals out, every evaluation counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from shoal.engines import Engine, get_engine
from shoal.errors import InputError
from shoal.identification.measurement import Measurement, observe
from shoal.identification.problem import Parameter, Problem
from shoal.scene import Scene
from shoal.swarm import EvaluationCounter
from shoal.trajectory import Array, Status

Progress = Callable[[int, float, float], None]
"""Called with (iteration, best fitness, mean fitness of the iteration)."""


@dataclass
class ForwardModel:
    """Simulates parameter sets, one per lane, and compares them with the measurement.

    `residuals` is wrapped by one counter, which every method shares. Fitness is the mean over the
    samples of the sum of squared residuals (for a tip: the mean squared distance [m^2]).
    """

    problem: Problem
    scene: Scene
    engine: Engine
    measurement: Measurement
    counter: EvaluationCounter = field(init=False)
    placements: int = field(init=False, default=0)
    """Poses computed without simulating a motion."""

    def __post_init__(self) -> None:
        self.counter = EvaluationCounter(self._residuals, cost=self.cost)

    @property
    def _parameters(self) -> tuple[Parameter, ...]:
        return tuple(self.problem.parameters.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters, in the order of the vectors."""
        return tuple(self.problem.parameters)

    @property
    def lower(self) -> Array:
        """Lower bounds, (parameters,)."""
        return np.array([p.lower for p in self.problem.parameters.values()])

    @property
    def upper(self) -> Array:
        """Upper bounds, (parameters,)."""
        return np.array([p.upper for p in self.problem.parameters.values()])

    def residuals(self, points: Array) -> Array:
        """Model minus measurement, (points, samples * channels); inf where a simulation failed. Counted."""
        return np.asarray(self.counter(points))

    def fitness(self, points: Array) -> Array:
        """Mean squared deviation of each point, (points,). Counted."""
        return self.cost(self.residuals(points))

    def cost(self, residuals: Array) -> Array:
        """Fitness of residuals (points, samples * channels)."""
        return np.asarray(np.sum(residuals**2, axis=1) / len(self.measurement.times))

    def observe(self, points: Array, times: Array, scene: Scene | None = None) -> Array:
        """Channels of the model at `times`, (points, samples, channels); nan where a simulation failed. Not counted."""
        if not np.all(valid := self._valid(points)):
            seen = np.full((len(points), len(times), len(self.measurement.channels)), np.nan)
            if np.any(valid):
                seen[valid] = self.observe(points[valid], times, scene)
            return seen
        values = {p.path: points[:, k] for k, p in enumerate(self._parameters)}
        trajectory = self.engine.simulate_many(scene or self.scene, values, times)
        seen = observe(trajectory, self.measurement.channels)
        seen[[status is not Status.OK for status in trajectory.status]] = np.nan
        return seen

    def poses(self, points: Array) -> Array:
        """Channels at time zero, (points, channels). No motion is simulated, so nothing is counted as an evaluation."""
        self.placements += len(points)
        # Placing bodies is the same for every engine, and the native one places all points in one call.
        native = replace(self, engine=get_engine("gauss"))
        return native.observe(points, np.zeros(1))[:, 0]

    def _valid(self, points: Array) -> Array:
        """Which points are scenes at all, (points,): inside the box all are, outside a mass may be negative."""
        valid = np.ones(len(points), dtype=bool)
        outside = np.any((points < self.lower) | (points > self.upper), axis=1)
        # Limits of fields are intervals: where the extremes are accepted, so is what lies between.
        extremes = (points[outside].min(axis=0), points[outside].max(axis=0)) if np.any(outside) else ()
        if not all(self._is_scene(extreme) for extreme in extremes):
            valid[outside] = [self._is_scene(point) for point in points[outside]]
        return valid

    def _is_scene(self, point: Array) -> bool:
        try:
            self.scene.with_values({p.path: float(x) for p, x in zip(self._parameters, point, strict=True)})
        except InputError:
            return False
        return True

    def _residuals(self, points: Array) -> Array:
        seen = self.observe(points, self.measurement.times)
        difference = (seen - self.measurement.values).reshape(len(points), -1)
        return np.where(np.isfinite(difference), difference, np.inf)
