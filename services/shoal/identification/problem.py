"""The identification problem: which numbers of which scene, from which measurement."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from shoal.errors import InputError
from shoal.scene import Scene, expression, load_scene
from shoal.scene.load import names, read_named
from shoal.scene.record import NonNegative, Positive, Record, one_line

Quantity = Literal["x", "y", "angle"]


class Parameter(Record):
    """A number to be found: its path in the scene, its bounds, and where to start if nothing better is known."""

    path: str
    lower: float
    upper: float
    start: float | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lower < self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}")
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise ValueError(f"start {self.start:g} is not between lower {self.lower:g} and upper {self.upper:g}")
        return self


class Channel(Record):
    """One measured signal: a marker's x, y [m] or angle [rad] = offset + scale * column."""

    marker: str
    quantity: Quantity
    column: str = ""
    scale: float = 1.0
    offset: float = 0.0


class EngineSource(Record):
    """Data computed by another engine: the scene with `values` set, sampled `count` times up to `stop` s."""

    kind: Literal["engine"] = "engine"
    engine: str = "exudyn"
    values: dict[str, Any] = {}
    stop: Positive
    count: Annotated[int, Field(ge=2)]


class FileSource(Record):
    """Data from a CSV file (gzip allowed): `duration` s from `start` s on, times in column `time` * time_scale."""

    kind: Literal["file"] = "file"
    path: str | None = None
    time: str = "t"
    time_scale: Positive = 1.0
    start: NonNegative = 0.0
    duration: Positive
    every: Annotated[int, Field(ge=1)] = 1


class Problem(Record):
    """What to identify. `values` replace fields of the scene; `noise` is the standard deviation of a channel.

    `constants` name fields of the scene for use in `quantities`, which are expressions in parameters
    and constants that the answer reports with their uncertainty (ratios, for instance).
    """

    name: str
    description: str = ""
    scene: str
    values: dict[str, Any] = {}
    parameters: Annotated[dict[str, Parameter], Field(min_length=1)]
    channels: Annotated[list[Channel], Field(min_length=1)]
    source: Annotated[EngineSource | FileSource, Field(discriminator="kind")]
    noise: Positive | None = None
    constants: dict[str, str] = {}
    quantities: dict[str, str] = {}
    method: str = "auto"

    @model_validator(mode="after")
    def _known_names(self) -> Self:
        known = {*self.parameters, *self.constants}
        for name, text in self.quantities.items():
            try:
                unknown = expression.names(text) - known
            except InputError as error:
                raise ValueError(f"quantities.{name}: {error}") from None
            if unknown:
                raise ValueError(f"quantities.{name}: {sorted(unknown)[0]!r} is neither a parameter nor a constant")
        if isinstance(self.source, FileSource) and not all(channel.column for channel in self.channels):
            raise ValueError("channels: each needs the `column` of the file it is read from")
        return self

    def load_scene(self, values: Mapping[str, Any] | None = None) -> Scene:
        """The scene to fit, with this problem's and the given values set, and every path checked. Raises InputError."""
        scene = load_scene(self.scene)
        scene = scene.with_values({**self.values, **(values or {})})
        for name, parameter in self.parameters.items():
            for bound in (parameter.lower, parameter.upper):
                try:
                    scene.with_values({parameter.path: bound})
                except InputError as error:
                    raise InputError(f"{self.name}: parameters.{name}: {error}") from None
        for channel in self.channels:
            if channel.marker not in scene.markers:
                known = ", ".join(scene.markers)
                raise InputError(f"{self.name}: channels: no marker {channel.marker!r}; there are {known}")
        return scene

    @classmethod
    def parse(cls, data: Any, source: str) -> Problem:
        """Check `data` as read from YAML. Raises InputError, one line that names the field."""
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise one_line(error, source) from None


def problem_library() -> Traversable:
    """The folder of the built-in problems."""
    return files("shoal.identification") / "library"


def problem_names() -> list[str]:
    """Names of the built-in problems, sorted."""
    return names(problem_library())


def load_problem(name: str) -> Problem:
    """The built-in problem of that name, or the one in that YAML file. Raises InputError."""
    problem = Problem.parse(read_named(name, problem_library(), "problem"), name)
    beside = Path(name).parent / problem.scene
    if Path(name).suffix and Path(problem.scene).suffix and beside.exists():
        problem = problem.model_copy(update={"scene": str(beside)})
    return problem
