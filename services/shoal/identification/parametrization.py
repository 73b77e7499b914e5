"""From the vector that a method sees to fields of the scene and to what describes the measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from shoal.identification.problem import MEASUREMENT, PROPORTIONAL, RESERVED, Parameter, Prior, Problem
from shoal.identification.recording.source import Clocked
from shoal.scene import Scene, expression
from shoal.trajectory import Array


@dataclass(frozen=True)
class VectorComponent:
    """One component of the vector: the parameter `key` of the problem, of one recording or (None) of all."""

    key: str
    parameter: Parameter
    recording: str | None


@dataclass(frozen=True)
class Parametrization:
    """The parameters of a problem as a vector; those with a logarithmic scale stand there by their logarithm.

    A parameter that every recording has for itself is one component for each recording.
    """

    problem: Problem
    recordings: tuple[str, ...]
    constants: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Problem, scene: Scene, recordings: tuple[str, ...]) -> Parametrization:
        """The parameters of a problem whose constants are those of a scene."""
        return cls(problem, recordings, {name: float(scene.value(path)) for name, path in problem.constants.items()})

    @cached_property
    def entries(self) -> dict[str, VectorComponent]:
        """The components by name, in the order of the vector."""
        found: dict[str, VectorComponent] = {}
        for key, parameter in self.problem.parameters.items():
            if parameter.own and self.problem.recordings:
                owners = parameter.own if isinstance(parameter.own, tuple) else self.recordings
                found |= {
                    f"{name}.{key}": VectorComponent(key, parameter, name) for name in self.recordings if name in owners
                }
            else:
                found[key] = VectorComponent(key, parameter, None)
        return found

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the components."""
        return tuple(self.entries)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Paths of the components, empty where one only stands in ties."""
        return tuple(entry.parameter.path or "" for entry in self.entries.values())

    @cached_property
    def initial(self) -> npt.NDArray[np.bool_]:
        """Components of the initial state, (components,), bool."""
        return np.array([path.startswith("initial.") for path in self.paths])

    @cached_property
    def turning(self) -> npt.NDArray[np.bool_]:
        """Components that are angles, of which whole turns do not count, (components,), bool."""
        measured = np.array([path in (f"{RESERVED}.tilt", f"{RESERVED}.mounting") for path in self.paths])
        return np.asarray(measured | self.initial & np.array([path.endswith(".angle") for path in self.paths]))

    @cached_property
    def rotations(self) -> dict[tuple[str | None, str], dict[int, int]]:
        """Sought components of the rotation vector of each recording (None: all) and body, by their number."""
        found: dict[tuple[str | None, str], dict[int, int]] = {}
        for k, (path, entry) in enumerate(zip(self.paths, self.entries.values(), strict=True)):
            if self.initial[k] and ".rotation." in path:
                _, body, _, number = path.split(".")
                found.setdefault((entry.recording, body), {})[int(number)] = k
        return found

    @cached_property
    def proportional(self) -> npt.NDArray[np.bool_]:
        """Components that the channels follow in proportion, with a single minimum, (components,), bool."""
        return np.array([path.startswith(RESERVED) and path.partition(".")[2] in PROPORTIONAL for path in self.paths])

    @cached_property
    def priors(self) -> list[tuple[int, Prior]]:
        """Numbers of the components of which something is known beforehand, and what."""
        known = enumerate(entry.parameter.prior for entry in self.entries.values())
        return [(k, prior) for k, prior in known if prior is not None]

    @cached_property
    def lower(self) -> Array:
        """Lower bounds, (components,)."""
        return self.to_vector(np.array([entry.parameter.lower for entry in self.entries.values()]))

    @cached_property
    def upper(self) -> Array:
        """Upper bounds, (components,)."""
        return self.to_vector(np.array([entry.parameter.upper for entry in self.entries.values()]))

    @cached_property
    def start(self) -> Array:
        """The stated starts, else the middle between the bounds, (components,)."""
        return self.to_vector(np.array([entry.parameter.begin for entry in self.entries.values()]))

    @cached_property
    def logarithmic(self) -> npt.NDArray[np.bool_]:
        """Components that stand by their logarithm, (components,), bool."""
        return np.array([entry.parameter.logarithmic for entry in self.entries.values()])

    def to_vector(self, values: Array) -> Array:
        """Components of parameters in their own units, (..., components)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)

    def to_values(self, points: Array) -> Array:
        """Parameters in their own units of components, (..., components)."""
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, points, 0.0)), points)

    def by_name(self, point: Array) -> dict[str, float]:
        """Parameters by name, in their own units, at a point (components,)."""
        return dict(zip(self.names, self.to_values(point).tolist(), strict=True))

    def named(self, points: Array, recording: str | None) -> dict[str, Array]:
        """Names of expressions at points (n, components): constants, and the parameters of a recording by name."""
        values = self.to_values(points)
        found: dict[str, Array] = {name: np.full(len(points), x) for name, x in self.constants.items()}
        for k, entry in enumerate(self.entries.values()):
            if entry.recording is None or entry.recording == recording:
                found[entry.key] = values[:, k]
        return found

    def scene_values(self, points: Array, recording: str) -> dict[str, Array]:
        """Path in the scene -> one number per point, for a recording, ties included."""
        named = self.named(points, recording)
        found = {
            entry.parameter.path: named[entry.key]
            for entry in self.entries.values()
            if entry.parameter.path is not None
            and not entry.parameter.of_measurement
            and entry.recording in (None, recording)
        }
        for path, text in self.problem.ties.items():
            found[path] = np.broadcast_to(expression.evaluate_array(text, named), (len(points),))
        return found

    def measurement_values(self, points: Array, recording: str, stated: Clocked) -> dict[str, Array]:
        """clock, delay, scale, x, y, tilt -> one number per point: a parameter's, else what the recording states."""
        named = self.named(points, recording)
        found = {name: np.full(len(points), getattr(stated, name)) for name in MEASUREMENT}
        for path, entry in zip(self.paths, self.entries.values(), strict=True):
            if entry.parameter.of_measurement and entry.recording in (None, recording):
                found[path.removeprefix(f"{RESERVED}.")] = named[entry.key]
        return found

    def indices(self, recording: str, suffix: str) -> dict[str, int]:
        """Path -> component, of the initial state's fields `.angle` or `.rate` in a recording."""
        return {
            path: k
            for k, (path, entry) in enumerate(zip(self.paths, self.entries.values(), strict=True))
            if self.initial[k] and path.endswith(suffix) and entry.recording in (None, recording)
        }
