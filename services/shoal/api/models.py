"""The models that UM-Bridge calls: a vector of parameters in, a vector out, derivatives by finite-difference lanes.

tip-motion: the problem's channels at the instants of its samples, sample by sample, as its recordings would show them.
misfit: half the sum of squared residuals.
`config` names the problem: {"problem": ..., "values": ..., "recordings": ...} as for an identification, or for
tip-motion {"scene": ..., "parameters": {name: {path, lower, upper}}, "times": [...]}, which gives x and y of all
markers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
import orjson
from pydantic import Field, ValidationError

from shoal.api.content import problem_of, scene_of, written
from shoal.api.limits import check_scene
from shoal.api.schemas import Asked, BuiltIn, Fields, ModelTask, RecordingName, Table
from shoal.api.tasks import Bench, Note, to_json
from shoal.engines.contract import sampling_times
from shoal.errors import ComputationError, InputError
from shoal.identification import Measurement, Problem, Recording, measure
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.lanes import differentiate_many
from shoal.identification.problem import Parameter
from shoal.identification.recording.source import EngineSource, FileSource
from shoal.scene.record import one_line
from shoal.shelf import shelf
from shoal.trajectory import Array


class Config(Asked):
    """Configuration of a model."""

    problem: BuiltIn | dict[str, Any] | None = None
    values: Fields = {}
    recordings: dict[RecordingName, Table] = {}
    scene: BuiltIn | dict[str, Any] | None = None
    parameters: Annotated[dict[RecordingName, Parameter], Field(min_length=1)] | None = None
    times: Annotated[list[float], Field(min_length=2)] | None = None


@dataclass(frozen=True)
class VectorFunction:
    """A vector function of parameters in their own units: the residuals of a forward model, or half their squares."""

    forward: ForwardModel
    squared: bool

    @property
    def inputs(self) -> int:
        """Return the number of parameters."""
        return len(self.forward.names)

    @property
    def outputs(self) -> int:
        """Return the number of outputs."""
        return 1 if self.squared else len(self.forward.rows.time)

    def evaluate(self, values: Array) -> Array:
        """The outputs at parameters, (outputs,). Raises ComputationError."""
        residual: Array = _finite(self.forward.uncounted(self.forward.parameters.to_vector(values)[None])[0])
        return np.array([0.5 * float(residual @ residual)]) if self.squared else residual

    def jacobian(self, values: Array) -> Array:
        """Their derivatives, (outputs, parameters). Raises ComputationError."""
        parameters = self.forward.parameters
        residuals, jacobians = differentiate_many(self.forward, parameters.to_vector(values)[None])
        residual, jacobian = _finite(residuals[0]), jacobians[0] / np.where(parameters.logarithmic, values, 1.0)
        return np.asarray((residual @ jacobian)[None] if self.squared else jacobian)


def _tip_motion(bench: Bench, config: Config) -> VectorFunction:
    """The channels themselves, which are the residuals of a measurement of zeros without noise and priors."""
    problem = _problem(bench, config)
    blank = {n: p.model_copy(update={"prior": None}) for n, p in problem.parameters.items()}
    problem = problem.model_copy(update={"loss": "squares", "noise": None, "parameters": blank})
    if any(isinstance(source, FileSource) for source in problem.sources.values()):
        recordings = dict(measure(problem, problem.load_scene(), written(config.recordings) or None).recordings)
    else:
        recordings = {name: _instants(problem, source, config.times) for name, source in problem.sources.items()}
    zeros = {
        name: replace(one, values=np.zeros_like(one.values), noise=np.full(len(one.channels), np.nan))
        for name, one in recordings.items()
    }
    forward = ForwardModel(problem, problem.load_scene(config.values), bench.engine, Measurement(zeros))
    return VectorFunction(forward, squared=False)


def _instants(problem: Problem, source: EngineSource | FileSource, times: list[float] | None) -> Recording:
    """A recording without its data; times [s]: of a scene."""
    assert isinstance(source, EngineSource)
    instants = np.linspace(0.0, source.stop, source.count + 1)[1:] if times is None else np.array(times)
    channels = problem.channels_of(source)
    return Recording(instants, channels, np.zeros((len(instants), len(channels))), "", np.empty(0), source)


def _misfit(bench: Bench, config: Config) -> VectorFunction:
    """Half the sum of squares."""
    if config.scene is not None:
        raise InputError("config: scene: misfit needs a problem, whose data tell what fits")
    problem = _problem(bench, config)
    measurement = measure(problem, problem.load_scene(), written(config.recordings) or None)
    forward = ForwardModel(problem, problem.load_scene(config.values), bench.engine, measurement)
    return VectorFunction(forward, squared=True)


_MAKE: dict[str, Callable[[Bench, Config], VectorFunction]] = {"tip-motion": _tip_motion, "misfit": _misfit}


def _problem(bench: Bench, config: Config) -> Problem:
    """The problem that a configuration names, or one that a scene, parameters and times make."""
    if config.scene is None:
        if config.parameters is not None or config.times is not None:
            raise InputError("config: parameters and times belong to a scene")
        return problem_of(config.problem or bench.settings.model, bench.settings, config.values)
    if config.problem is not None or config.parameters is None or config.times is None:
        raise InputError("config: scene: goes with parameters and times, and without a problem")
    sampling_times(scene := scene_of(config.scene), config.times)
    data = {
        "name": scene.name,
        "scene": config.scene,
        "parameters": {name: parameter.model_dump() for name, parameter in config.parameters.items()},
        "channels": [{"marker": marker, "quantity": axis} for marker in scene.markers for axis in ("x", "y")],
        "source": {"kind": "engine", "stop": config.times[-1], "count": len(config.times)},
    }
    return problem_of(data, bench.settings, config.values)


@lru_cache(maxsize=4)
def _model(bench: Bench, name: str, config: bytes, library: int) -> VectorFunction:
    """The model of that name; the data of a problem are computed once. library: its state, which names depend on."""
    try:
        return _MAKE[name](bench, Config.model_validate(orjson.loads(config)))
    except ValidationError as error:
        raise one_line(error, "config") from None


def bridge(bench: Bench, asked: ModelTask, note: Note) -> bytes:
    """Answer a call. Raises InputError, ComputationError."""
    call = asked.call
    # Unsorted: the order of the parameters is that of the vectors.
    model = _model(bench, call.name, orjson.dumps(call.config), shelf().changed)
    if asked.operation == "InputSizes":
        return to_json({"inputSizes": [model.inputs]})
    if asked.operation == "OutputSizes":
        return to_json({"outputSizes": [model.outputs]})
    values = _vector("input", call.input[0] if len(call.input) == 1 else [], model.inputs)
    forward = model.forward
    check_scene(forward.scene, bench.settings, [forward.measurement.end], 1 + model.inputs)
    if asked.operation == "Evaluate":
        return to_json({"output": [model.evaluate(values)]})
    if call.outWrt != 0 or call.inWrt != 0:
        raise InputError(
            f"outWrt, inWrt: there is one input and one output, number 0; found {call.outWrt}, {call.inWrt}"
        )
    if asked.operation == "Gradient":
        return to_json({"output": _vector("sens", call.sens, model.outputs) @ model.jacobian(values)})
    return to_json({"output": model.jacobian(values) @ _vector("vec", call.vec, model.inputs)})


def _vector(name: str, given: list[float], size: int) -> Array:
    if len(given) != size:
        raise InputError(f"{name}: {size} numbers are needed, found {len(given)}")
    return np.array(given)


def _finite(numbers: Array) -> Array:
    if not np.all(np.isfinite(numbers)):
        raise ComputationError("the simulation failed for these parameters")
    return numbers
